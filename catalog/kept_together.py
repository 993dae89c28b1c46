"""Which clips a split must not part: those of one recording, and those of one subject.

Two clips are kept together where

- they have the same bytes,
- they share a frame: the same skeleton's joints, in the same place, turned the same way to the last bit.
  What was recorded never comes so twice; clips that were cut from one recording often share the frame of the
  cut (the repetitions of HDM05 do) or more. Drawn animations may all begin with one rest pose, and would all
  be kept together: for them this can be left out,
- a column that people chose, `subject` or any other label, has the same value for both. Clips for which it
  has none are kept together as well: they may be one subject's.

And so on from clip to clip. The rival, to tell recordings by the names of files, knows one library's habits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.places import rows_by_clip
from motionary.catalog.query import Catalog
from motionary.pipeline.stages.columns import matrix

_Edges = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Clips, by their place, and what each is joined to, by a number."""


@dataclass(frozen=True)
class KeptTogether:
    """Clips in groups.

    Parameters
    ----------
    groups : sequence of str
        Each clip's group: the first of its members' values of the chosen columns, or of the digests of their
        bytes where none are chosen. So a group's name outlives the renaming of files.
    without : int
        Clips without a value in one of the columns.
    recordings : int
        Groups by bytes and frames alone.
    """

    groups: Sequence[str]
    without: int
    recordings: int


def kept_together(
    catalog: Catalog, clips: pa.Table, columns: Sequence[str] = (), shared_frames: bool = True
) -> KeptTogether:
    """Find the groups of clips that a split must not part.

    Parameters
    ----------
    catalog : Catalog
    clips : pyarrow.Table
        Rows of `clips`, with the supplied labels.
    columns : sequence of str
        Clips of one value are kept together, in each of the columns.
    shared_frames : bool
        Also clips that share a frame.

    Raises
    ------
    CatalogError
        There is no such column, or it has no value for any of the clips.
    """
    values = [_values(clips, column) for column in columns]
    digests = clips["digest"].to_pylist()
    joined = [_by_value(digests)]
    if shared_frames:
        joined.append(_by_frame(catalog, clips["clip_id"].to_pylist()))
    recordings = len(np.unique(_components(len(clips), joined)))
    together = _components(len(clips), [*joined, *map(_by_value, values)])
    named = [[f"{column}={one or ''}" for one in of] for column, of in zip(columns, values, strict=True)]
    names: dict[int, str] = {}
    for tokens in named or [digests]:
        for group, token in zip(together.tolist(), tokens, strict=True):
            names[group] = min(names.get(group, token), token)
    without = sum(None in row for row in zip(*values, strict=True))
    groups = [names[group] for group in together.tolist()]
    return KeptTogether(groups, without, recordings)


def _values(clips: pa.Table, column: str) -> list[str | None]:
    if column not in clips.column_names:
        known = [field.name for field in clips.schema if pa.types.is_string(field.type)]
        close = nearest(column, known) or f"; they have {', '.join(known)}"
        raise CatalogError(f"clips have no column {column!r} to be grouped by{close}")
    values = [None if value is None else str(value) for value in clips[column].to_pylist()]
    if not any(value is not None for value in values):
        raise CatalogError(
            f"no clip has a value in column {column!r}: there is nothing to group them by; "
            "supply it with the labels, or name another column"
        )
    return values


def _by_value(values: Sequence[str | None]) -> _Edges:
    numbers: dict[str | None, int] = {}
    of = np.array([numbers.setdefault(value, len(numbers)) for value in values], dtype=np.int64)
    return np.arange(len(of)), of


def _by_frame(catalog: Catalog, clip_ids: Sequence[str]) -> _Edges:
    """Join clips to the frames that more than one of them has; a hash a frame is kept in memory, no pose."""
    place = {clip_id: index for index, clip_id in enumerate(clip_ids)}
    owners, hashes = [np.empty(0, np.int32)], [np.empty(0, np.uint64)]
    for clip_id, rows in rows_by_clip(catalog, "frames", clip_ids, ["root_position", "rotations"]):
        hashes.append(np.unique(_frame_hashes(rows)))
        owners.append(np.full(len(hashes[-1]), place[clip_id], np.int32))
    _, of, times = np.unique(np.concatenate(hashes), return_inverse=True, return_counts=True)
    shared = times[of] > 1
    return np.concatenate(owners)[shared].astype(np.int64), of[shared].astype(np.int64)


def _frame_hashes(rows: pa.Table) -> NDArray[np.uint64]:
    """Hash every frame's numbers to 64 bits: SplitMix64 of each and its column, summed."""
    values = np.hstack([matrix(rows["root_position"]), matrix(rows["rotations"])]) + np.float32(0)  # no -0
    mixed = np.ascontiguousarray(values).view(np.uint32).astype(np.uint64)
    mixed += np.arange(1, mixed.shape[1] + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed ^= mixed >> np.uint64(shift)
        mixed *= np.uint64(factor)
    mixed ^= mixed >> np.uint64(31)
    return mixed.sum(axis=1, dtype=np.uint64)


def _components(count: int, joined: Sequence[_Edges]) -> NDArray[np.int32]:
    """Find the group of every clip: those joined to the same things, directly or through others."""
    clips, things, total = [], [], count
    for owners, of in joined:
        clips.append(owners)
        things.append(of + total)
        total += int(of.max(initial=-1)) + 1
    edges = (np.concatenate(clips), np.concatenate(things))
    graph = coo_array((np.ones(len(edges[0]), dtype=np.int8), edges), shape=(total, total))
    return connected_components(graph, directed=False)[1][:count]
