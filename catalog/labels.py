"""What people said clips are: table `labels`, a row a clip.

These labels win over supplied and propagated ones, whatever the clusters become. They belong to a clip's
name, and go with its bytes where a file is renamed or moved:

- the name is still in the library: the label stays with it, also where the file's bytes have changed;
- the name is gone, and of the clips without a label exactly one has its bytes: the label is that clip's now;
- the name is gone, and no such clip or several are there: the row stays under the old name. The file may come
  back, or a person says which of the copies is meant.

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
    """Let labels go with files that were renamed or moved; see the module for the rule.

    Parameters
    ----------
    labels : pyarrow.Table
        Table `labels` of the catalog as it was.
    inputs : pyarrow.Table
        clip_id and digest of every file that is in the library now; an empty digest is like no other.

    Returns
    -------
    pyarrow.Table
        As many rows, sorted by clip_id; `digest` is that of the bytes now, where the clip is in the library.
    """
    rows = _by_clip(labels)
    now = dict(zip(inputs["clip_id"].to_pylist(), inputs["digest"].to_pylist(), strict=True))
    for clip_id, row in rows.items():
        row["digest"] = now.get(clip_id) or row["digest"]
    gone, unlabelled = defaultdict(list), defaultdict(list)
    for clip_id in rows.keys() - now.keys():
        gone[rows[clip_id]["digest"]].append(clip_id)
    for clip_id in now.keys() - rows.keys():
        unlabelled[now[clip_id]].append(clip_id)
    for digest, names in gone.items():
        candidates = unlabelled.get(digest, []) if digest else []
        if len(names) == len(candidates) == 1:
            rows[candidates[0]] = rows.pop(names[0]) | {"clip_id": candidates[0]}
    return _table(rows)


def _by_clip(labels: pa.Table) -> dict[str, dict]:
    return {row["clip_id"]: row for row in labels.to_pylist()}


def _table(rows: Mapping[str, dict]) -> pa.Table:
    return pa.Table.from_pylist([rows[clip_id] for clip_id in sorted(rows)], schema=SCHEMAS["labels"])
