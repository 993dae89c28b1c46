"""What people said clips are: table `labels`, a row a clip.

These labels win over supplied and propagated ones, whatever the clusters become. They belong to a motion: to
the bytes that were labelled, and where those are gone to the clip's name.

- The clip has the bytes that were labelled: the label stays with it.
- The clip is gone or has other bytes, and the labelled bytes are in clips without a label, or with one that
  itself goes elsewhere: the label goes there. So it follows files that are renamed, moved or swapped, and a
  new take under an old name gets none.
- Labels of the same bytes that say the same are given out in the order of names, as far as there are clips.
  Where they say different things none goes: a person says which is meant.
- A label that goes nowhere stays under its name. A file that is there was edited in place; one that is gone
  may come back.

A clip whose bytes cannot be read just now keeps its label, and the label its digest.
No row is ever dropped but by `label remove`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from datetime import datetime

import pyarrow as pa

from motionary.catalog.schema import SCHEMAS


def with_labels(
    labels: pa.Table,
    changes: Mapping[str, str | None],
    digests: Mapping[str, str],
    set_at: datetime,
    set_by: str,
) -> pa.Table:
    """Set, replace and remove labels.

    Parameters
    ----------
    labels : pyarrow.Table
        Table `labels`.
    changes : mapping of str to str or None
        The new label by clip_id; None removes one.
    digests : mapping of str to str
        By clip_id, the digest of every clip that a label is set on.
    set_at : datetime
        With its time zone.
    set_by : str
        Who says so.

    Returns
    -------
    pyarrow.Table
        Sorted by clip_id. A label that is set again as it was keeps its row, with who said so first.

    Raises
    ------
    ValueError
        A label is empty, has blanks around it or characters that cannot be printed, or there is none to
        remove.
    """
    rows = _by_clip(labels)
    for clip_id, label in changes.items():
        if label is None:
            if rows.pop(clip_id, None) is None:
                raise ValueError(f"nobody has labelled {clip_id!r}; there is nothing to remove")
            continue
        if not label or label != label.strip() or not label.isprintable():
            raise ValueError(
                f"{label!r} cannot be the label of {clip_id!r}: give text that can be printed, without "
                "blanks around it"
            )
        if rows.get(clip_id, {}).get("label") != label:
            rows[clip_id] = {
                "clip_id": clip_id,
                "digest": digests[clip_id],
                "label": label,
                "set_at": set_at,
                "set_by": set_by,
            }
    return _table(rows)


def following(labels: pa.Table, inputs: pa.Table) -> pa.Table:
    """Let labels go with the bytes that were labelled; see the module for the rule.

    Parameters
    ----------
    labels : pyarrow.Table
        Table `labels` of the catalog as it was.
    inputs : pyarrow.Table
        clip_id and digest of every file that is in the library now; an empty digest means unreadable bytes.

    Returns
    -------
    pyarrow.Table
        As many rows, sorted by clip_id; `digest` is that of the bytes now, where the clip is in the library.
    """
    rows, before = _by_clip(labels), None
    now = dict(zip(inputs["clip_id"].to_pylist(), inputs["digest"].to_pylist(), strict=True))
    while rows != before:  # again, as files that were edited in place no longer contest the bytes they had
        rows, before = _once_moved(rows, now), rows
    return _table(rows)


def _once_moved(rows: Mapping[str, dict], now: Mapping[str, str]) -> dict[str, dict]:
    moves = _moves(rows, now)
    moved = {}
    for clip_id, row in rows.items():
        there = moves.get(clip_id, clip_id)
        moved[there] = row | {"clip_id": there, "digest": now.get(there) or row["digest"]}
    return moved


def _moves(rows: Mapping[str, dict], now: Mapping[str, str]) -> dict[str, str]:
    """Tell which displaced rows go to which clips."""
    displaced = {
        clip_id
        for clip_id, row in rows.items()
        if clip_id not in now or now[clip_id] not in ("", row["digest"])
    }
    leaving, places = defaultdict(list), defaultdict(list)  # by digest
    for clip_id in sorted(displaced):
        leaving[rows[clip_id]["digest"]].append(clip_id)
    for clip_id in sorted(now):
        if clip_id not in rows or clip_id in displaced:
            places[now[clip_id]].append(clip_id)
    for digest, names in leaving.items():
        if not digest or len({rows[name]["label"] for name in names}) > 1:
            places[digest] = []

    staying = [name for digest, names in leaving.items() for name in names[len(places[digest]) :]]
    for name in staying:  # grows: a row that stays keeps out another, which then stays too
        digest = now.get(name, "")
        if name in places[digest]:
            places[digest].remove(name)
            staying += leaving[digest][len(places[digest]) :][:1]
    return {
        name: place
        for digest, names in leaving.items()
        for name, place in zip(names, places[digest], strict=False)
    }


def _by_clip(labels: pa.Table) -> dict[str, dict]:
    return {row["clip_id"]: row for row in labels.to_pylist()}


def _table(rows: Mapping[str, dict]) -> pa.Table:
    return pa.Table.from_pylist([rows[clip_id] for clip_id in sorted(rows)], schema=SCHEMAS["labels"])
