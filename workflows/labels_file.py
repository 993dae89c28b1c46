"""Labels that people supply with a library: a CSV, a row a clip; a pattern on the clips' names; or both.

A row of the CSV names its clip by `path`, relative to the CSV's own folder, or by `clip_id`; `path` wins. All
other columns are labels. Rows for files outside the library are counted and passed over, but not all of them.

A pattern is a regular expression that is searched in every clip_id; its named groups are label columns:
`(?P<action>[a-z]+)_(?P<style>[a-z]+)_` finds walk and tired in `takes/walk_tired_03.bvh`. Where both speak,
the CSV's value wins, unless it is empty.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pyarrow as pa

from motionary.pipeline.readers.library import Source
from motionary.workflows.errors import UserError
from motionary.workflows.label_pattern import labels_by_pattern


class LabelsError(UserError):
    """Supplied labels cannot be used; the message names the file, the place and the mend."""


@dataclass(frozen=True)
class SuppliedLabels:
    """Labels of a library's clips.

    Parameters
    ----------
    table : pyarrow.Table
        clip_id and a text column a label, in clip_id order; no value where none is supplied.
    outside : list of str
        What the CSV names that is not in the library.
    """

    table: pa.Table
    outside: list[str]


NO_LABELS = SuppliedLabels(pa.table({"clip_id": pa.array([], pa.string())}), [])

_LONGEST_HEADER, _MOST_COLUMNS = 100_000, 1000  # beyond these pandas takes minutes, and no file has them
_LONGEST_PATH = 4096  # no system opens a longer one

Labels = Mapping[str, Mapping[str, str | None]]
"""By clip_id, the values of its label columns."""


def supplied_labels(
    csv: Path | None, pattern: str | None, sources: Sequence[Source], label_column: str
) -> SuppliedLabels:
    """Join what a CSV and a pattern say of a library's clips.

    Parameters
    ----------
    csv : Path, optional
        With a header, UTF-8.
    pattern : str, optional
        Regular expression with named groups.
    sources : sequence of Source
        The library's clips.
    label_column : str
        The column that clusters are named by; one of the two has it.

    Raises
    ------
    LabelsError
        The CSV is missing or no CSV, has neither `path` nor `clip_id`, labels one clip twice, or names no
        clip of the library; or the label column is in neither.
    PatternError
        The pattern cannot be used; see `motionary.workflows.label_pattern`.
    """
    if csv is None and pattern is None:
        return NO_LABELS
    columns, rows, outside = _from_csv(csv, sources) if csv else ((), {}, [])
    names = [source.clip_id for source in sources]
    groups, found = labels_by_pattern(pattern, names) if pattern is not None else ((), {})
    if label_column not in (*columns, *groups):
        raise LabelsError(_without(label_column, csv, columns, pattern, groups))
    clip_ids = sorted({*rows, *found})
    made = {"clip_id": pa.array(clip_ids, pa.string())}
    for name in dict.fromkeys((*columns, *groups)):
        values = [rows.get(one, {}).get(name) or found.get(one, {}).get(name) for one in clip_ids]
        made[name] = pa.array(values, pa.string())
    return SuppliedLabels(pa.table(made), outside)


def read_csv(file: Path) -> pd.DataFrame:
    """Read a CSV of text: cells without the blanks around them, None where nothing is left.

    Raises
    ------
    LabelsError
        It is missing, no CSV or not UTF-8, separated by semicolons, or does not say which clips it is about.
    """
    try:
        with file.open("rb") as start:
            header = start.readline(_LONGEST_HEADER)
        if len(header) == _LONGEST_HEADER or header.count(b",") >= _MOST_COLUMNS:
            raise LabelsError(f"{file}, row 1: a header of so many columns is none; keep those of labels")
        text = pd.read_csv(
            file, dtype=str, keep_default_na=False, encoding="utf-8-sig", skip_blank_lines=False
        )
    except FileNotFoundError:
        raise LabelsError(f"no labels file {file}") from None
    except (OSError, ValueError) as error:  # not UTF-8, not a CSV, empty, a folder
        raise LabelsError(f"{file} cannot be read as CSV: {error}") from None
    text.columns = [name.strip() for name in text.columns]
    if len(text.columns) == 1 and ";" in text.columns[0]:
        raise LabelsError(f"{file} is separated by semicolons; save it with commas")
    if not {"path", "clip_id"} & set(text.columns):
        raise LabelsError(
            f"{file} has no column path or clip_id to tell the clips by; it has {_listed(text.columns)}"
        )
    text = text.apply(lambda column: column.str.strip())
    return text.astype(object).where(text != "", None)


def clips_named(rows: pd.DataFrame, file: Path, clip_of: Mapping[str, str]) -> list[str | None]:
    """Find the clip that each row of a CSV is about.

    Parameters
    ----------
    rows : DataFrame
        Of `read_csv`.
    file : Path
        The CSV, to whose folder its paths are relative.
    clip_of : mapping of str to str
        The clip_id by real path, of every clip that is known.

    Returns
    -------
    list of str or None
        A clip_id a row; None where it is not among them.
    """
    known = set(clip_of.values())

    def clip_id(path: str | None, name: str | None) -> str | None:
        if path is not None:
            possible = "\0" not in path and len(path) <= _LONGEST_PATH
            return clip_of.get(os.path.realpath(file.parent / path)) if possible else None
        return name if name in known else None

    return [clip_id(path, name) for path, name in _names(rows)]


def names_given(rows: pd.DataFrame) -> list[str]:
    """Return what each row of a CSV calls its clip."""
    return [path or name or "" for path, name in _names(rows)]


def refuse_repeats(clip_ids: Sequence[str | None], file: Path) -> None:
    """Refuse a CSV that labels a clip in more than one row.

    Raises
    ------
    LabelsError
        It does; the message names the first such clip and its rows.
    """
    rows: dict[str, list[int]] = {}
    for row, clip_id in enumerate(clip_ids, start=2):  # the header is row 1
        if clip_id is not None:
            rows.setdefault(clip_id, []).append(row)
    for clip_id, places in rows.items():
        if len(places) > 1:
            raise LabelsError(
                f"{file} labels clip {clip_id!r} more than once, in rows {', '.join(map(str, places))}; "
                "keep one"
            )


def _from_csv(file: Path, sources: Sequence[Source]) -> tuple[tuple[str, ...], Labels, list[str]]:
    rows = read_csv(file)
    clip_ids = clips_named(
        rows, file, {os.path.realpath(source.files[0]): source.clip_id for source in sources}
    )
    outside = [name for name, clip_id in zip(names_given(rows), clip_ids, strict=True) if clip_id is None]
    if len(outside) == len(rows):
        raise LabelsError(
            f"{file}: none of its {len(rows)} rows names a clip of the library "
            f"(the first is {_listed(outside[:1])!r}); a path is relative to {file.parent}, and a clip_id, "
            f"with its suffix, is like {sources[0].clip_id!r}"
        )
    refuse_repeats(clip_ids, file)
    labels = rows.drop(columns=["path", "clip_id"], errors="ignore")
    columns = tuple(labels.columns)
    by_clip = {
        one: dict(zip(columns, values, strict=True))
        for one, values in zip(clip_ids, labels.itertuples(index=False, name=None), strict=True)
        if one is not None
    }
    return columns, by_clip, outside


def _without(
    label_column: str, csv: Path | None, columns: Sequence[str], pattern: str | None, groups: Sequence[str]
) -> str:
    if pattern is None:
        return (
            f"{csv} has no column {label_column!r}; "
            f"name one of its columns with --label-column: {_listed(columns)}"
        )
    if csv is None:
        return (
            f"the label pattern {pattern!r} has no group {label_column!r}; "
            f"name one of its groups with --label-column: {', '.join(groups)}"
        )
    return (
        f"neither {csv} ({_listed(columns)}) nor the label pattern {pattern!r} ({', '.join(groups)}) has a "
        f"label {label_column!r}; name one of theirs with --label-column"
    )


def _listed(names: Iterable[str]) -> str:
    """Join names for a message: a dozen at most, each shortened."""
    names = list(names)
    some = ", ".join(name if len(name) <= 60 else f"{name[:60]}..." for name in names[:12])
    return some if len(names) <= 12 else f"{some} and {len(names) - 12} more"


def _names(rows: pd.DataFrame) -> list[tuple[str | None, str | None]]:
    columns = (rows[name].to_list() if name in rows else [None] * len(rows) for name in ("path", "clip_id"))
    return list(zip(*columns, strict=True))
