"""The distances of all pairs: DTW, B-DTW, the curve and what is made of it [DC 5].

A distance has the same bits in any tile, on any thread and in either order of the two clips.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import PackedClips, pack_clips
from motionary.pipeline.distances.curve import THRESHOLDS, fill_curve, weighted_sums
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.segment_dtw import make_workspace
from motionary.pipeline.distances.tiles import (
    comparable_clips,
    compare_all,
    largest_pair,
    pair_costs,
    room_for_costs,
    threads_to_use,
)
from motionary.pipeline.distances.zones import checked_thresholds


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
    return _compare_by_curve(a, b, lambdas, upper=False)


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
        return _arrays(_compare_by_curve(a, b, lambdas, upper))

    compare_all(arrays, jobs, tile, compare, _arrays(result))
    return result


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


def _compare_by_curve(
    a: PackedClips, b: PackedClips, thresholds: NDArray[np.float64], upper: bool
) -> PairwiseDistances:
    """Compare the clips of a tile; distances are zero where `upper` leaves a pair out."""
    shape = len(a.frames), len(b.frames)
    dtw, b_dtw, curve = np.zeros(shape), np.zeros(shape), np.zeros((*shape, len(thresholds)))
    rows, columns = largest_pair(a, b, upper)
    work, room = make_workspace(rows, columns), room_for_costs(rows, columns, a.rows.dtype)
    _fill_curve_tile(a, b, thresholds, upper, room, work, dtw, b_dtw, curve)
    return _record(dtw, b_dtw, curve, thresholds)


@kernel
def _fill_curve_tile(a, b, thresholds, upper, room, work, dtw, b_dtw, curve):  # type: ignore[no-untyped-def]
    """Compare every clip of `a` with every clip of `b`, or with those of higher index alone (`upper`)."""
    for p in range(len(a.frames)):
        for q in range(p + 1 if upper else 0, len(b.frames)):
            m, n, rows, width, low, high = pair_costs(a, p, b, q, room)
            costs = room.costs[: rows * width].reshape((rows, width))
            dtw[p, q], b_dtw[p, q] = fill_curve(costs, m, n, low, high, thresholds, curve[p, q], work)
