"""Why two clips are as far apart as they are: zones, the chosen cover, and what every joint adds [DC 3-5].

A cell of cost c > 0 is shared out among the parts of a frame, its joints and its travel, by their squared
differences:

    c = sum over parts p of d_p^2 / c,    d_p^2 = sum over the columns k of p of (F_ik - G_jk)^2

A path's distance is the mean of its cells, S-DTW the sum of the chosen zones' distances, and the weighted
distance a sum of S-DTWs; so every distance is the sum of its parts' contributions. The rival, how much less a
distance is without a joint, does not add up, and moves the zones that it is to explain.

Costs, zones and cover are those of the kernels, and paths are judged by the same exact totals
(`fixed_point.py`), so the curve is theirs bit for bit. Where several paths or covers are equally cheap, one
of them is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import FeatureKind
from motionary.pipeline.distances.chosen_zones import chosen_zones, segments_of
from motionary.pipeline.distances.cost import checked_clips, checked_costs, cost_matrix
from motionary.pipeline.distances.curve import THRESHOLDS, fuzzy_distance, weighted_sums
from motionary.pipeline.distances.dtw import dtw_path, packed_costs
from motionary.pipeline.distances.fixed_point import mean_quanta
from motionary.pipeline.distances.zones import checked_thresholds, limit_of, similar_zones
from motionary.pipeline.motion import FloatArray

TRAVEL = "travel"
"""The part of a frame that is no joint: the root's own-frame velocity."""


@dataclass(frozen=True, eq=False)
class WarpingPath:
    """A path of least total cost through a rectangle of the cost matrix.

    Parameters
    ----------
    cells : array (L, 2) int
        Frames of the first and of the second clip; those of the second fall where `backward`.
    backward : bool
        Whether the second clip is played backward.
    distance : float
        Mean cost of the cells.
    contributions : array (P,)
        What every part adds to it.
    """

    cells: NDArray[np.int64]
    backward: bool
    distance: float
    contributions: FloatArray


@dataclass(frozen=True, eq=False)
class ExplainedZone:
    """A similar zone: an edge between a segment of the first clip and one of the second.

    Parameters
    ----------
    rectangle : tuple of 4 int
        First row, last row, first column, last column, inclusive.
    row_segment, column_segment : int
        Which segments it joins.
    chosen : bool
        Whether it belongs to the cheapest cover.
    path : WarpingPath
        The cheaper of its two directions, forward where they cost the same.
    """

    rectangle: tuple[int, int, int, int]
    row_segment: int
    column_segment: int
    chosen: bool
    path: WarpingPath


@dataclass(frozen=True, eq=False)
class ExplainedThreshold:
    """S-DTW at one threshold.

    Parameters
    ----------
    threshold, weight : float
        lambda, and 0.1 W(lambda), its weight in the weighted distance (eq. 8).
    limit : float
        delta, the greatest cost in a region (eq. 6).
    distance : float
        S-DTW: the sum over the chosen zones.
    zones : tuple of ExplainedZone
        As `similar_zones` sorts them.
    row_segments, column_segments : array (R, 2), (C, 2) int
        First and last frame of each.
    contributions : array (P,)
        What every part adds to the distance.
    """

    threshold: float
    weight: float
    limit: float
    distance: float
    zones: tuple[ExplainedZone, ...]
    row_segments: NDArray[np.int64]
    column_segments: NDArray[np.int64]
    contributions: FloatArray


@dataclass(frozen=True, eq=False)
class ExplainedPair:
    """Every distance of two clips, and what it is made of.

    Parameters
    ----------
    parts : tuple of P str
        Joints and travel.
    forward, cheaper : WarpingPath
        Of the whole clips: DTW's, and B-DTW's.
    thresholds : tuple of ExplainedThreshold
        The curve.
    distances : dict of str to float
        dtw, b_dtw, weighted, fuzzy_low, fuzzy_high.
    contributions : dict of str to array (P,)
        For each of them, what every part adds.
    """

    parts: tuple[str, ...]
    forward: WarpingPath
    cheaper: WarpingPath
    thresholds: tuple[ExplainedThreshold, ...]
    distances: dict[str, float]
    contributions: dict[str, FloatArray]


def feature_parts(kind: FeatureKind) -> tuple[str, ...]:
    """Name the part that each column of a feature belongs to: 59 names, or the paper's 54."""
    if kind == "paper":
        return tuple(np.repeat(CANONICAL_JOINTS[1:], 3).tolist())
    return (*np.repeat(CANONICAL_JOINTS, 3).tolist(), TRAVEL, TRAVEL)


def explain_pair(
    a: ArrayLike, b: ArrayLike, column_parts: Sequence[str], thresholds: ArrayLike = THRESHOLDS
) -> ExplainedPair:
    """Take the distances of two clips apart.

    Parameters
    ----------
    a, b : array (m, d), (n, d)
        Two clips; compared in float32 where both are float32, else in float64.
    column_parts : sequence of str (d,)
        The part of every column, as `feature_parts` gives them.
    thresholds : sequence of float
        lambda, each 0 to 1.

    Returns
    -------
    ExplainedPair
        Distances equal those of `compare_clips`, bit for bit.

    Raises
    ------
    ValueError
        A clip is empty, not finite, too long or of another dimension than the other or than
        `column_parts`; or a threshold is outside 0 .. 1.
    """
    lambdas = checked_thresholds(thresholds)
    first, second = checked_clips([a, b], ["a", "b"])
    if len(column_parts) != first.shape[1]:
        raise ValueError(f"{len(column_parts)} column_parts are given for {first.shape[1]} columns")
    paths = _Paths(first, second, column_parts)
    weights = weighted_sums(np.eye(len(lambdas)), lambdas)
    explained = tuple(
        _explained_threshold(paths, float(value), float(weight))
        for value, weight in zip(lambdas, weights, strict=True)
    )
    curve = np.array([one.distance for one in explained])
    low, high = fuzzy_distance(curve)
    m, n = paths.costs.shape
    whole = (0, m - 1, 0, n - 1)
    forward, cheaper = paths.along(whole, backward=False), paths.cheaper(whole)
    return ExplainedPair(
        parts=paths.parts,
        forward=forward,
        cheaper=cheaper,
        thresholds=explained,
        distances={
            "dtw": forward.distance,
            "b_dtw": cheaper.distance,
            "weighted": float(weighted_sums(curve, lambdas)),
            "fuzzy_low": low,
            "fuzzy_high": high,
        },
        contributions={
            "dtw": forward.contributions,
            "b_dtw": cheaper.contributions,
            "weighted": weights @ np.array([one.contributions for one in explained]),
            "fuzzy_low": explained[curve.argmin()].contributions,
            "fuzzy_high": explained[curve.argmax()].contributions,
        },
    )


class _Paths:
    """The cost matrix of two clips, and the best paths through its rectangles."""

    def __init__(self, a: FloatArray, b: FloatArray, column_parts: Sequence[str]) -> None:
        self.a, self.b = a.astype(np.float64), b.astype(np.float64)
        self.costs = checked_costs(cost_matrix(a, b))
        self.words, self.quantum, self.length_bits = packed_costs(self.costs)
        # Whole numbers, so that a path through a part is judged as it is in the whole.
        self.quanta = (self.words >> self.length_bits).astype(np.float64)
        self.parts = tuple(dict.fromkeys(column_parts))
        self._of_part = np.equal.outer(np.array(column_parts), np.array(self.parts)).astype(np.float64)
        self._known: dict[tuple[int, int, int, int], WarpingPath] = {}

    def cheaper(self, rectangle: tuple[int, int, int, int]) -> WarpingPath:
        """B-DTW of a rectangle (eq. 1)."""
        if rectangle not in self._known:
            ahead, back = (self.along(rectangle, backward) for backward in (False, True))
            self._known[rectangle] = back if back.distance < ahead.distance else ahead
        return self._known[rectangle]

    def along(self, rectangle: tuple[int, int, int, int], backward: bool) -> WarpingPath:
        """DTW of a rectangle in one direction."""
        top, bottom, left, right = rectangle
        inside = self.quanta[top : bottom + 1, left : right + 1]
        path = dtw_path(inside[:, ::-1] if backward else inside)
        cells = path * (1, -1 if backward else 1) + (top, right if backward else left)
        total = int(self.words[cells[:, 0], cells[:, 1]].sum())
        distance = mean_quanta(total, self.length_bits) * self.quantum
        return WarpingPath(cells, backward, distance, self._contributions(cells))

    def _contributions(self, cells: NDArray[np.int64]) -> FloatArray:
        rows, columns = cells.T
        squares = np.square(self.a[rows] - self.b[columns]) @ self._of_part
        totals = squares.sum(axis=1, keepdims=True)
        shares = np.divide(squares, totals, out=np.zeros_like(squares), where=totals > 0)
        return (shares * self.costs[rows, columns, None]).mean(axis=0)


def _explained_threshold(paths: _Paths, threshold: float, weight: float) -> ExplainedThreshold:
    rectangles = similar_zones(paths.costs, threshold)
    row_segment, row_segments = segments_of(rectangles[:, :2])
    column_segment, column_segments = segments_of(rectangles[:, 2:])
    found = [paths.cheaper(tuple(one)) for one in rectangles.tolist()]
    # Whole: a quantum is a power of two.
    quanta = np.array([round(one.distance / paths.quantum) for one in found], dtype=np.int64)
    chosen, total = chosen_zones(row_segment, column_segment, quanta)
    zones = tuple(
        ExplainedZone(tuple(rectangle), int(row), int(column), bool(taken), path)
        for rectangle, row, column, taken, path in zip(
            rectangles.tolist(), row_segment, column_segment, chosen, found, strict=True
        )
    )
    return ExplainedThreshold(
        threshold=threshold,
        weight=weight,
        limit=float(limit_of(paths.costs.min(), paths.costs.max(), threshold)),
        distance=total * paths.quantum,
        zones=zones,
        row_segments=row_segments,
        column_segments=column_segments,
        contributions=np.sum([zone.path.contributions for zone in zones if zone.chosen], axis=0),
    )
