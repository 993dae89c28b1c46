"""The pairs at most mu apart by the weighted distance: all that complete linkage cut at mu needs [DC 5].

A pair is refused as soon as a proven bound puts it above mu (`lower_bound.py`): by the distance of the clips'
boxes, by the least cost, by the profile of the costs, or by a *partial sum*, in which the S-DTW of some
lambda are known and the profile stands for the others. The known ones are those of greatest lambda, whose
zones are few. What is left is computed whole, by the kernels of the curve, with the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import pack_clips
from motionary.pipeline.distances.curve import THRESHOLDS, weighted_sums
from motionary.pipeline.distances.lower_bound import box_limit, boxed_clips, principal_axes
from motionary.pipeline.distances.pairwise import PairwiseDistances
from motionary.pipeline.distances.pruned_kernels import fill_found
from motionary.pipeline.distances.segment_dtw import make_workspace
from motionary.pipeline.distances.tiles import comparable_clips, largest_pair, room_for_costs
from motionary.pipeline.distances.zones import checked_thresholds
from motionary.pipeline.motion import FloatArray

# Pairs found before the kernel hands them over.
SLOTS = 4096


@dataclass(frozen=True)
class Pruning:
    """How many pairs there were, and what became of them.

    Parameters
    ----------
    pairs : int
        All of them.
    by_boxes, by_low, by_profile, by_sum : int
        Refused by the boxes, before their costs; by the least cost; by the profile; by a partial sum.
    """

    pairs: int
    by_boxes: int
    by_low: int
    by_profile: int
    by_sum: int

    @property
    def whole(self) -> int:
        """Pairs whose curve was computed whole."""
        return self.pairs - self.by_boxes - self.by_low - self.by_profile - self.by_sum


@dataclass(frozen=True, eq=False)
class PairsUnder:
    """The pairs whose weighted distance, rounded to float32, is at most mu.

    Parameters
    ----------
    first, second : array (found,) int64
        Places of the clips in their lists, ascending by (first, second).
    distances : PairwiseDistances
        Of these pairs, arrays (found,), the curve (found, T).
    pruning : Pruning
        What it took.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    distances: PairwiseDistances
    pruning: Pruning


def compare_under(
    clips_a: Sequence[ArrayLike], clips_b: Sequence[ArrayLike], mu: float, thresholds: ArrayLike = THRESHOLDS
) -> PairsUnder:
    """Find the pairs of a clip of one list and a clip of another that are at most mu apart.

    Parameters
    ----------
    clips_a, clips_b : sequences of array (frames, d)
        Compared in float32 where all of them are float32, else in float64.
    mu : float
        In the unit of the features, not negative; a distance counts as it is stored, in float32.
    thresholds : sequence of float (T,)
        lambda, each 0 to 1.

    Returns
    -------
    PairsUnder
        With the bits of `compare_clips`.

    Raises
    ------
    ValueError
        As `compare_clips`; or mu is negative or not finite.
    """
    names = [f"clips_a[{i}]" for i in range(len(clips_a))] + [f"clips_b[{i}]" for i in range(len(clips_b))]
    clips = comparable_clips([*clips_a, *clips_b], names)
    return _under(
        clips[: len(clips_a)], clips[len(clips_a) :], mu, checked_thresholds(thresholds), upper=False
    )


def pairwise_under(clips: Sequence[ArrayLike], mu: float, thresholds: ArrayLike = THRESHOLDS) -> PairsUnder:
    """Find the pairs of one list of clips that are at most mu apart, first < second.

    Parameters, result and errors are those of `compare_under`, the bits those of `pairwise_distances`.
    """
    arrays = comparable_clips(clips, [f"clips[{i}]" for i in range(len(clips))])
    return _under(arrays, arrays, mu, checked_thresholds(thresholds), upper=True)


class _Found(NamedTuple):
    """Room for the pairs that the kernel finds before it hands them over."""

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    dtw: NDArray[np.float64]
    b_dtw: NDArray[np.float64]
    curve: NDArray[np.float64]

    def copy(self, count: int) -> _Found:
        return _Found._make(column[:count].copy() for column in self)


class _Room(NamedTuple):
    """Scratch of the bounds: blocks of clips that may be near, the profile of a pair and its quanta."""

    near: NDArray[np.uint64]
    profile: FloatArray
    quanta: NDArray[np.int64]


def _under(
    clips_a: list[FloatArray], clips_b: list[FloatArray], mu: float, lambdas: NDArray[np.float64], upper: bool
) -> PairsUnder:
    if not 0 <= mu < np.inf:
        raise ValueError(f"mu is {mu}; it must be finite and not negative")
    counts = np.zeros(5, dtype=np.int64)
    found = [_found_room(0, len(lambdas))]
    if clips_a and clips_b and not (upper and len(clips_a) == 1):
        found += _all_found(clips_a, clips_b, mu, lambdas, upper, counts)
    first, second, dtw, b_dtw, curve = (np.concatenate(column) for column in zip(*found, strict=True))
    distances = PairwiseDistances(
        dtw, b_dtw, curve, weighted_sums(curve, lambdas), curve.min(axis=-1), curve.max(axis=-1)
    )
    return PairsUnder(first, second, distances, Pruning(*counts.tolist()))


def _all_found(
    clips_a: list[FloatArray],
    clips_b: list[FloatArray],
    mu: float,
    lambdas: NDArray[np.float64],
    upper: bool,
    counts: NDArray[np.int64],
) -> list[_Found]:
    """Run the kernel until all pairs are through; add to `counts`."""
    clips = clips_a if upper else [*clips_a, *clips_b]
    axes = principal_axes(clips)
    a, boxes_a = pack_clips(clips_a), boxed_clips(clips_a, axes)
    b, boxes_b = (a, boxes_a) if upper else (pack_clips(clips_b), boxed_clips(clips_b, axes))
    # The weighted distance of a curve of ones in one place and zeros elsewhere: exactly that place's weight.
    weights = weighted_sums(np.eye(len(lambdas)), lambdas)
    kept, above = _around(mu)
    dtype = clips[0].dtype
    limit = _squared(box_limit(above, weights, clips, axes), dtype)
    rows, columns = largest_pair(a, b, upper)
    work, room = make_workspace(rows, columns), room_for_costs(rows, columns, dtype)
    scratch = _Room(
        near=np.empty(len(boxes_b.whole.low_lanes), dtype=np.uint64),
        profile=np.empty(rows + columns, dtype=dtype),
        quanta=np.empty(rows + columns, dtype=np.int64),
    )
    slots = _found_room(SLOTS, len(lambdas))
    handed, p, q = [], 0, 0
    while p < len(clips_a):
        count, p, q = fill_found(
            a, b, boxes_a, boxes_b, lambdas, weights, limit, kept, upper, p, q,
            room, work, scratch, slots, counts,
        )  # fmt: skip
        handed.append(slots.copy(count))
    return handed


def _found_room(slots: int, thresholds: int) -> _Found:
    first, second = np.empty((2, slots), dtype=np.int64)
    dtw, b_dtw = np.empty((2, slots))
    return _Found(first, second, dtw, b_dtw, np.empty((slots, thresholds)))


def _around(mu: float) -> tuple[np.float32, float]:
    """Return the greatest float32 that is not above mu, and the one above it."""
    with np.errstate(over="ignore"):
        kept = np.float32(mu)
        # As Python's floats: NumPy would round mu to float32 before it compares.
        if float(kept) > float(mu):
            kept = np.nextafter(kept, np.float32(-np.inf))
        return kept, float(np.nextafter(kept, np.float32(np.inf)))


def _squared(limit: float, dtype: np.dtype) -> np.floating:
    """Return a number of the dtype that is not below the square of `limit`."""
    with np.errstate(over="ignore", under="ignore"):
        square = dtype.type(limit) ** 2 * dtype.type(1.0 + 4.0 * np.finfo(dtype).eps)
    return np.nextafter(square, dtype.type(np.inf))
