"""Labels that people supply with a library: a CSV, a row a clip.

A row names its clip by `path`, relative to the CSV's own folder, or by `clip_id`; `path` wins. All other
columns are labels. Rows for files outside the library are counted and passed over, but not all of them.
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
    outside : list of str
        What the CSV names that is not in the library.
    """

    table: pa.Table
    outside: list[str]


NO_LABELS = SuppliedLabels(pa.table({"clip_id": pa.array([], pa.string())}), [])


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
        The file is missing or no CSV, has neither `path` nor `clip_id`, lacks the label column, labels one
        clip twice, or names no clip of the library.
    """
    rows = _read_csv(file)
    names = list(rows.columns)
    if len(names) == 1 and ";" in names[0]:
        raise LabelsError(f"{file} is separated by semicolons; save it with commas")
    if not {"path", "clip_id"} & set(names):
        raise LabelsError(
            f"{file} has no column path or clip_id to tell the clips by; it has {', '.join(names)}"
        )
    if label_column not in names:
        raise LabelsError(
            f"{file} has no column {label_column!r}; "
            f"name one of its columns with --label-column: {', '.join(names)}"
        )
    clip_ids = _clip_ids(rows, file, sources)
    outside = [name for name, clip_id in zip(_names(rows), clip_ids, strict=True) if clip_id is None]
    if len(outside) == len(rows):
        raise LabelsError(
            f"{file}: none of its {len(rows)} rows names a clip of the library (the first is {outside[:1]}); "
            f"a path is relative to {file.parent}, and a clip_id, with its suffix, is like "
            f"{sources[0].clip_id!r}"
        )
    rows["clip_id"] = clip_ids
    inside = rows[rows["clip_id"].notna()].drop(columns="path", errors="ignore")
    twice = inside[inside["clip_id"].duplicated(keep=False)]
    if len(twice):
        clip_id = twice["clip_id"].iloc[0]
        lines = ", ".join(str(line + 2) for line in twice.index[twice["clip_id"] == clip_id])
        raise LabelsError(f"{file} labels clip {clip_id!r} more than once, in rows {lines}; keep one")
    columns = {name: pa.array(inside[name].to_list(), pa.string()) for name in inside.columns}
    return SuppliedLabels(pa.table(columns), outside)


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

    pairs = zip(_column(rows, "path"), _column(rows, "clip_id"), strict=True)
    return [clip_id(path, name) for path, name in pairs]


def _names(rows: pd.DataFrame) -> list[str]:
    """Return what each row calls its clip."""
    pairs = zip(_column(rows, "path"), _column(rows, "clip_id"), strict=True)
    return [path or name or "" for path, name in pairs]


def _column(rows: pd.DataFrame, name: str) -> list[str | None]:
    return rows[name].to_list() if name in rows else [None] * len(rows)
