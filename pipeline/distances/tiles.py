"""All pairs of clips by tiles: every clip of one list against every clip of another.

A tile's pairs share nothing but scratch memory, about 45 bytes a cell of its largest cost matrix for the
curve; each thread holds one tile.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import PackedClips, checked_clips, frame_distances, pack_clips
from motionary.pipeline.distances.fixed_point import refuse_too_long
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES, ROWS, WORD, padded
from motionary.pipeline.motion import FloatArray


def compare_all(
    clips: list[FloatArray],
    jobs: int,
    tile: int,
    compare: Callable[[PackedClips, PackedClips, bool], list[NDArray[np.float64]]],
    results: list[NDArray[np.float64]],
) -> None:
    """Compare comparable clips tile by tile, on `jobs` threads; a thread holds no more than its tile.

    `compare` returns (na, nb, ...) arrays of a tile; where its third argument is true the two lists are the
    same and only pairs above the diagonal are taken. They go to their places in the condensed `results`.
    """
    starts = range(0, len(clips), tile)
    # A clip alone in its tile has no other to be compared with there.
    tiles = [(i, j) for i in starts for j in starts if i < j or (i == j and min(tile, len(clips) - i) > 1)]

    def fill(first: int, second: int) -> None:
        a = pack_clips(clips[first : first + tile])
        b = a if first == second else pack_clips(clips[second : second + tile])
        found = compare(a, b, first == second)
        for row in range(len(found[0])):
            i = first + row
            skipped = row + 1 if first == second else 0
            begin = i * len(clips) - i * (i + 1) // 2 + second + skipped - i - 1
            for result, values in zip(results, found, strict=True):
                result[begin : begin + len(values[row]) - skipped] = values[row, skipped:]

    with ThreadPoolExecutor(jobs) as threads:
        try:
            for task in [threads.submit(fill, i, j) for i, j in tiles]:
                task.result()
        except BaseException:
            threads.shutdown(cancel_futures=True)
            raise


def comparable_clips(clips: Sequence[ArrayLike], names: Sequence[str]) -> list[FloatArray]:
    """Convert clips to arrays of one dtype and check that each can be compared with each.

    Raises
    ------
    ValueError
        As `pairwise_distances`.
    """
    if not len(clips):
        return []
    arrays = checked_clips(clips, names)
    longest = max(len(array) for array in arrays)
    refuse_too_long(longest, longest)
    return arrays


def threads_to_use(n_jobs: int | None, tile: int) -> int:
    """Return the number of threads, after a check of it and of the tile.

    Raises
    ------
    ValueError
        Either is less than 1.
    """
    for name, value in (("n_jobs", n_jobs), ("tile", tile)):
        if value is not None and value < 1:
            raise ValueError(f"{name} is {value}; it must be at least 1")
    return n_jobs or usable_processors()


def usable_processors() -> int:
    """Count the processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def largest_pair(a: PackedClips, b: PackedClips, upper: bool) -> tuple[int, int]:
    """Return the most rows and the most columns of a pair's costs; see `pair_costs`.

    With `upper` no clip is compared with itself: the rows are those of the second longest.
    """
    if upper:
        rows, columns = np.sort(a.frames)[-2:]
    else:
        rows, columns = sorted((a.frames.max(), b.frames.max()))
    return int(rows), int(columns)


class CostRoom(NamedTuple):
    """Room for the costs of one pair, and for the least and the greatest of every lane."""

    costs: FloatArray
    extremes: FloatArray


def room_for_costs(rows: int, columns: int, dtype: np.dtype) -> CostRoom:
    """Allocate room for up to (rows, columns); costs are read by whole words, the last beyond their end."""
    cells = padded(rows, ROWS) * padded(columns, LANES)
    return CostRoom(np.empty(cells + WORD, dtype=dtype), np.empty((2, LANES), dtype=dtype))


@kernel
def pair_costs(a, p, b, q, room):  # type: ignore[no-untyped-def]
    """Fill `room` with the costs of clips p of `a` and q of `b`, the longer one's frames as columns.

    Returns the frames of the rows' and of the columns' clip, the rows and the width of the costs, and the
    least and the greatest of them. Long rows are filled up less, and are quicker to go along.
    """
    if a.frames[p] > b.frames[q]:
        a, p, b, q = b, q, a, p
    rows = a.rows[a.row_start[p] : a.row_start[p + 1]]
    lanes = b.lanes[b.block_start[q] : b.block_start[q + 1]]
    width = len(lanes) * LANES
    costs = room.costs[: len(rows) * width].reshape((len(rows), width))
    low, high = frame_distances(rows, lanes, costs, room.extremes)
    return a.frames[p], b.frames[q], len(rows), width, low, high
