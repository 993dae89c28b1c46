"""A CSV of decisions: the list of `motionary label review`, filled in, or any other with a column `label`."""

from __future__ import annotations

import os
from pathlib import Path

from motionary.catalog import Catalog
from motionary.workflows.csv_cells import csv_plain
from motionary.workflows.labels_file import (
    LabelsError,
    clips_named,
    names_given,
    read_csv,
    refuse_repeats,
)
from motionary.workflows.relabel import refuse_unknown


def labels_to_import(file: Path, catalog: Catalog) -> dict[str, str]:
    """Read what a CSV calls clips of a catalog.

    Parameters
    ----------
    file : Path
        CSV with a column `label`, and a `clip_id` or a `path` relative to its own folder; `path` wins. Rows
        without a label, and all other columns, are left alone.
    catalog : Catalog
        Whose clips they are.

    Returns
    -------
    dict of str to str
        The label by clip_id.

    Raises
    ------
    UserError
        The CSV cannot be read or has no such columns, labels one clip twice, or names clips that are not in
        the library.
    """
    rows = read_csv(file)
    if "label" not in rows:
        raise LabelsError(f"{file} has no column label; it has {', '.join(rows.columns)}")
    rows = rows.map(lambda cell: cell if cell is None else csv_plain(cell))
    rows.loc[rows["label"].isna(), [name for name in ("path", "clip_id") if name in rows]] = None
    clip_of = {
        os.path.realpath(Path(one["root"], one["path"])): one["clip_id"]
        for one in catalog.inputs.to_arrow().select(["clip_id", "root", "path"]).to_pylist()
    }
    clip_ids = clips_named(rows, file, clip_of)
    labelled = rows["label"].notna()
    strange = [
        name
        for name, one, said in zip(names_given(rows), clip_ids, labelled, strict=True)
        if said and not one
    ]
    refuse_unknown(strange, sorted(clip_of.values()), catalog.store.url)
    refuse_repeats(clip_ids, file)
    return {one: label for one, label in zip(clip_ids, rows["label"], strict=True) if one is not None}
