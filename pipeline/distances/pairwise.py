"""All pairs of clips, by tiles [DC 5].

A tile is every clip of one list against every clip of another. Its pairs share nothing but scratch memory,
so a distance has the same bits in any tile, on any thread and in either order of the two clips. A thread's
scratch memory is about 30 bytes a cell of its largest cost matrix.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import PackedClips, checked_clips, frame_distances, pack_clips
from motionary.pipeline.distances.curve import THRESHOLDS, fill_curve, weighted_sums
from motionary.pipeline.distances.fixed_point import refuse_too_long
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
    clips = _checked([*clips_a, *clips_b], names)
    lambdas = checked_thresholds(thresholds)
    if not len(clips_a) or not len(clips_b):
        empty = np.empty((len(clips_a), len(clips_b), len(lambdas)))
        return _record(empty[..., 0], empty[..., 0], empty, lambdas)
    a, b = pack_clips(clips[: len(clips_a)]), pack_clips(clips[len(clips_a) :])
    return _record(*_compare_packed(a, b, lambdas, upper=False), lambdas)


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
    for name, value in (("n_jobs", n_jobs), ("tile", tile)):
        if value is not None and value < 1:
            raise ValueError(f"{name} is {value}; it must be at least 1")
    arrays = _checked(clips, [f"clips[{i}]" for i in range(len(clips))])
    starts = range(0, len(arrays), tile)
    packed = {start: pack_clips(arrays[start : start + tile]) for start in starts}
    pairs = len(arrays) * (len(arrays) - 1) // 2
    dtw, b_dtw, curve = np.empty(pairs), np.empty(pairs), np.empty((pairs, len(lambdas)))

    def compare(first: int, second: int) -> None:
        tile_dtw, tile_b_dtw, tile_curve = _compare_packed(
            packed[first], packed[second], lambdas, first == second
        )
        for row in range(len(tile_dtw)):
            i = first + row
            skipped = row + 1 if first == second else 0
            begin = i * len(arrays) - i * (i + 1) // 2 + second + skipped - i - 1
            place = slice(begin, begin + tile_dtw.shape[1] - skipped)
            dtw[place], b_dtw[place] = tile_dtw[row, skipped:], tile_b_dtw[row, skipped:]
            curve[place] = tile_curve[row, skipped:]

    with ThreadPoolExecutor(n_jobs or usable_processors()) as threads:
        for task in [threads.submit(compare, i, j) for i in starts for j in starts if i <= j]:
            task.result()
    return _record(dtw, b_dtw, curve, lambdas)


def _checked(clips: Sequence[ArrayLike], names: Sequence[str]) -> list[FloatArray]:
    if not len(clips):
        return []
    arrays = checked_clips(clips, names)
    longest = max(len(array) for array in arrays)
    refuse_too_long(longest, longest)
    return arrays


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


def _compare_packed(
    a: PackedClips, b: PackedClips, thresholds: NDArray[np.float64], upper: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return DTW, B-DTW and curve of a tile, zero where `upper` leaves a pair out."""
    shape = len(a.frames), len(b.frames)
    dtw, b_dtw, curve = np.zeros(shape), np.zeros(shape), np.zeros((*shape, len(thresholds)))
    costs = np.empty(np.diff(a.row_start).max() * np.diff(b.column_start).max())
    work = make_workspace(int(a.frames.max()), int(b.frames.max()))
    _fill_tile(a, b, thresholds, upper, costs, work, dtw, b_dtw, curve)
    return dtw, b_dtw, curve


@njit(cache=True, nogil=True)
def _fill_tile(a, b, thresholds, upper, costs, work, dtw, b_dtw, curve):  # type: ignore[no-untyped-def]
    """Compare every clip of `a` with every clip of `b`, or with those of higher index alone (`upper`)."""
    depth = a.rows.shape[1]
    for p in range(len(a.frames)):
        rows = a.rows[a.row_start[p] : a.row_start[p + 1]]
        for q in range(p + 1 if upper else 0, len(b.frames)):
            start, end = b.column_start[q], b.column_start[q + 1]
            columns = b.columns[start * depth : end * depth].reshape((depth, end - start))
            pair_costs = costs[: len(rows) * (end - start)].reshape((len(rows), end - start))
            frame_distances(rows, columns, pair_costs)
            inner = pair_costs[: a.frames[p], : b.frames[q]]
            dtw[p, q], b_dtw[p, q] = fill_curve(inner, thresholds, curve[p, q], work)
