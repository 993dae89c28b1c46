"""All pairs of clips, by tiles [DC 5].

A tile is every clip of one list against every clip of another. Its pairs share nothing but scratch memory,
so a distance has the same bits in any tile, on any thread and in either order of the two clips. A thread's
scratch memory is about 45 bytes a cell of its largest cost matrix.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import (
    PackedClips,
    checked_clips,
    frame_distances,
    pack_clips,
)
from motionary.pipeline.distances.curve import THRESHOLDS, fill_curve, weighted_sums
from motionary.pipeline.distances.fixed_point import refuse_too_long
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES, ROWS, WORD, padded
from motionary.pipeline.distances.segment_dtw import make_workspace
from motionary.pipeline.distances.zones import checked_thresholds
from motionary.pipeline.motion import FloatArray


@dataclass(frozen=True, eq=False)
class PairwiseDistances:
    """Distances of pairs of clips, in the unit of their features.

    Parameters
    ----------
    dtw, b_dtw : array (pairs,)
        DTW, and DTW in both directions (eq. 1). From `compare_clips` the leading shape is (na, nb).
    curve : array (pairs, T)
        S-DTW at each threshold.
    weighted : array (pairs,)
        Weighted distance (eq. 7-8).
    fuzzy_low, fuzzy_high : array (pairs,)
        Ends of the fuzzy distance (eq. 10).
    """

    dtw: NDArray[np.float64]
    b_dtw: NDArray[np.float64]
    curve: NDArray[np.float64]
    weighted: NDArray[np.float64]
    fuzzy_low: NDArray[np.float64]
    fuzzy_high: NDArray[np.float64]


def compare_clips(
    clips_a: Sequence[ArrayLike], clips_b: Sequence[ArrayLike], thresholds: ArrayLike = THRESHOLDS
) -> PairwiseDistances:
    """Compare every clip of one list with every clip of another: the body of a tile.

    Parameters
    ----------
    clips_a, clips_b : sequences of array (frames, d)
        na and nb clips; compared in float32 where all of them are float32, else in float64.
    thresholds : sequence of float (T,)
        lambda, each 0 to 1.

    Returns
    -------
    PairwiseDistances
        Arrays (na, nb), the curve (na, nb, T).

    Raises
    ------
    ValueError
        Names the clip that is empty, not two-dimensional, not finite, too long or of another dimension, or
        the threshold outside 0 .. 1.
    """
    names = [f"clips_a[{i}]" for i in range(len(clips_a))] + [f"clips_b[{i}]" for i in range(len(clips_b))]
    clips = comparable_clips([*clips_a, *clips_b], names)
    lambdas = checked_thresholds(thresholds)
    if not len(clips_a) or not len(clips_b):
        empty = np.empty((len(clips_a), len(clips_b), len(lambdas)))
        return _record(empty[..., 0], empty[..., 0], empty, lambdas)
    a, b = pack_clips(clips[: len(clips_a)]), pack_clips(clips[len(clips_a) :])
    return _compare_packed(a, b, lambdas, upper=False)


def pairwise_distances(
    clips: Sequence[ArrayLike],
    n_jobs: int | None = None,
    thresholds: ArrayLike = THRESHOLDS,
    tile: int = 64,
) -> PairwiseDistances:
    """Compare every clip with every later one.

    Parameters
    ----------
    clips : sequence of array (frames, d)
        N clips; compared in float32 where all of them are float32, else in float64.
    n_jobs : int, optional
        Threads; by default one for every processor that this process may use.
    thresholds : sequence of float (T,)
        lambda, each 0 to 1.
    tile : int
        Clips a side of a tile. Neither it nor `n_jobs` changes a bit of the result.

    Returns
    -------
    PairwiseDistances
        Condensed arrays (N (N-1) / 2,) in the order of `scipy.spatial.distance.squareform`, the curve
        (N (N-1) / 2, T).

    Raises
    ------
    ValueError
        Names the clip that is empty, not two-dimensional, not finite, too long or of another dimension, or
        the threshold, `n_jobs` or `tile` that is out of its range.
    """
    lambdas = checked_thresholds(thresholds)
    jobs = threads_to_use(n_jobs, tile)
    arrays = comparable_clips(clips, [f"clips[{i}]" for i in range(len(clips))])
    pairs = len(arrays) * (len(arrays) - 1) // 2
    result = PairwiseDistances(
        dtw=np.empty(pairs),
        b_dtw=np.empty(pairs),
        curve=np.empty((pairs, len(lambdas))),
        weighted=np.empty(pairs),
        fuzzy_low=np.empty(pairs),
        fuzzy_high=np.empty(pairs),
    )

    def compare(a: PackedClips, b: PackedClips, upper: bool) -> list[NDArray[np.float64]]:
        return _arrays(_compare_packed(a, b, lambdas, upper))

    compare_all(arrays, jobs, tile, compare, _arrays(result))
    return result


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
            for task in [threads.submit(fill, i, j) for i in starts for j in starts if i <= j]:
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


def _record(
    dtw: NDArray[np.float64],
    b_dtw: NDArray[np.float64],
    curve: NDArray[np.float64],
    lambdas: NDArray[np.float64],
) -> PairwiseDistances:
    return PairwiseDistances(
        dtw=dtw,
        b_dtw=b_dtw,
        curve=curve,
        weighted=weighted_sums(curve, lambdas),
        fuzzy_low=curve.min(axis=-1),
        fuzzy_high=curve.max(axis=-1),
    )


def _arrays(record: PairwiseDistances) -> list[NDArray[np.float64]]:
    return [getattr(record, field.name) for field in fields(record)]


def _compare_packed(
    a: PackedClips, b: PackedClips, thresholds: NDArray[np.float64], upper: bool
) -> PairwiseDistances:
    """Compare the clips of a tile; distances are zero where `upper` leaves a pair out."""
    shape = len(a.frames), len(b.frames)
    dtw, b_dtw, curve = np.zeros(shape), np.zeros(shape), np.zeros((*shape, len(thresholds)))
    work = make_workspace(*largest_pair(a, b))
    room = room_for_costs(a, b)
    _fill_tile(a, b, thresholds, upper, room, work, dtw, b_dtw, curve)
    return _record(dtw, b_dtw, curve, thresholds)


def largest_pair(a: PackedClips, b: PackedClips) -> tuple[int, int]:
    """Return the most rows and the most columns of a pair's costs; see `pair_costs`."""
    longest = int(a.frames.max()), int(b.frames.max())
    return min(longest), max(longest)


class CostRoom(NamedTuple):
    """Room for the costs of one pair, and for the least and the greatest of every lane."""

    costs: FloatArray
    extremes: FloatArray


def room_for_costs(a: PackedClips, b: PackedClips) -> CostRoom:
    """Allocate room for any pair of a tile; its costs are read by whole words, the last beyond their end."""
    rows, columns = largest_pair(a, b)
    cells = padded(rows, ROWS) * padded(columns, LANES)
    return CostRoom(
        costs=np.empty(cells + WORD, dtype=a.rows.dtype),
        extremes=np.empty((2, LANES), dtype=a.rows.dtype),
    )


@kernel
def _fill_tile(a, b, thresholds, upper, room, work, dtw, b_dtw, curve):  # type: ignore[no-untyped-def]
    """Compare every clip of `a` with every clip of `b`, or with those of higher index alone (`upper`)."""
    for p in range(len(a.frames)):
        for q in range(p + 1 if upper else 0, len(b.frames)):
            m, n, rows, width, low, high = pair_costs(a, p, b, q, room)
            costs = room.costs[: rows * width].reshape((rows, width))
            dtw[p, q], b_dtw[p, q] = fill_curve(costs, m, n, low, high, thresholds, curve[p, q], work)


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
