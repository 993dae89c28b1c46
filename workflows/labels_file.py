"""Labels that people supply with a library: a CSV, a row a clip.

A row names its clip by `path`, relative to the CSV's own folder, or by `clip_id`; `path` wins. All other
columns are labels. Rows for files outside the library are counted and passed over.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pyarrow as pa

from motionary.pipeline.readers.library import Source
from motionary.workflows.errors import UserError


class LabelsError(UserError):
    """A labels file cannot be used; the message names the file, the place and the mend."""


@dataclass(frozen=True)
class SuppliedLabels:
    """Labels of a library's clips.

    Parameters
    ----------
    table : pyarrow.Table
        clip_id and a text column a label; no value where the CSV has none.
    outside : int
        Rows of the CSV for files that are not in the library.
    """

    table: pa.Table
    outside: int


NO_LABELS = SuppliedLabels(pa.table({"clip_id": pa.array([], pa.string())}), 0)


def read_labels(file: Path, sources: Sequence[Source], label_column: str) -> SuppliedLabels:
    """Read a labels file.

    Parameters
    ----------
    file : Path
        CSV with a header, UTF-8.
    sources : sequence of Source
        The library's clips.
    label_column : str
        The column that clusters are named by.

    Raises
    ------
    LabelsError
        The file is missing or no CSV, has neither `path` nor `clip_id`, lacks the label column, or labels
        one clip twice.
    """
    rows = _read_csv(file)
    names = list(rows.columns)
    if not {"path", "clip_id"} & set(names):
        raise LabelsError(
            f"{file} has no column path or clip_id to tell the clips by; it has {', '.join(names)}"
        )
    if label_column not in names:
        raise LabelsError(
            f"{file} has no column {label_column!r}; "
            f"name one of its columns with --label-column: {', '.join(names)}"
        )
    rows["clip_id"] = _clip_ids(rows, file, sources)
    inside = rows[rows["clip_id"].notna()].drop(columns="path", errors="ignore")
    twice = inside[inside["clip_id"].duplicated(keep=False)]
    if len(twice):
        clip_id = twice["clip_id"].iloc[0]
        lines = ", ".join(str(line + 2) for line in twice.index[twice["clip_id"] == clip_id])
        raise LabelsError(f"{file} labels clip {clip_id!r} more than once, in rows {lines}; keep one")
    columns = {name: pa.array(inside[name].to_list(), pa.string()) for name in inside.columns}
    return SuppliedLabels(pa.table(columns), len(rows) - len(inside))


def _read_csv(file: Path) -> pd.DataFrame:
    try:
        text = pd.read_csv(
            file, dtype=str, keep_default_na=False, encoding="utf-8-sig", skip_blank_lines=False
        )
    except FileNotFoundError:
        raise LabelsError(f"no labels file {file}") from None
    except (OSError, ValueError) as error:  # not UTF-8, not a CSV, empty, a folder
        raise LabelsError(f"{file} cannot be read as CSV: {error}") from None
    text.columns = [name.strip() for name in text.columns]
    text = text.apply(lambda column: column.str.strip())
    return text.astype(object).where(text != "", None)


def _clip_ids(rows: pd.DataFrame, file: Path, sources: Sequence[Source]) -> list[str | None]:
    by_path = {os.path.realpath(source.files[0]): source.clip_id for source in sources}
    known = {source.clip_id for source in sources}
    folder = file.parent

    def clip_id(path: str | None, name: str | None) -> str | None:
        if path is not None:
            return by_path.get(os.path.realpath(folder / path))
        return name if name in known else None

    missing = [None] * len(rows)
    paths = rows["path"] if "path" in rows else missing
    names = rows["clip_id"] if "clip_id" in rows else missing
    return [clip_id(path, name) for path, name in zip(paths, names, strict=True)]
