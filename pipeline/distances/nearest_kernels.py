"""One clip against those of a library: the search of `nearest.py`, which says why its bounds hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.distances.cost import PackedClips
from motionary.pipeline.distances.fixed_point import mean_quanta, pack
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.recurrence import both_ways, forward
from motionary.pipeline.distances.segment_dtw import Workspace, prepare, segment_quanta
from motionary.pipeline.distances.tiles import CostRoom, pair_costs
from motionary.pipeline.distances.zones import limit_of
from motionary.pipeline.motion import FloatArray

# Places in METRICS; the first two are no curve.
DTW, B_DTW, WEIGHTED, FUZZY = range(4)
# Of the greatest cost: more than a quantum, and than what the bounds' own rounding adds to them.
QUANTUM = 2.0**-22


class RankedCurve(NamedTuple):
    """The curve's thresholds, each one's weight in the weighted distance, and tau of the fuzzy one."""

    thresholds: NDArray[np.float64]
    weights: NDArray[np.float64]
    tau: float


class Best(NamedTuple):
    """The k best groups so far, each by its nearest clip, nearest first; infinity where there is none yet."""

    distance: NDArray[np.float32]
    clip: NDArray[np.int64]
    group: NDArray[np.int64]


class Hidden(NamedTuple):
    """What is known of the costs of all pairs before they are computed.

    Parameters
    ----------
    query, library : PackedClips
        Shadows.
    bounds : array (clips,)
        Of each pair's least cost, from below.
    margins : array (clips,)
        How far the least cost may lie below the shadows' times `kept`.
    kept : float
    """

    query: PackedClips
    library: PackedClips
    bounds: NDArray[np.float64]
    margins: NDArray[np.float64]
    kept: float


class SearchRoom(NamedTuple):
    """Room for a pair: its costs, its paths, the least cost of every column, the curve or what bounds it."""

    costs: CostRoom
    work: Workspace
    column_least: FloatArray
    curve: NDArray[np.float64]


@kernel
def search(query, library, hidden, order, groups, metric, curve, prune, best, room):  # type: ignore[no-untyped-def]
    """Fill `best`; return how many clips' distances were computed."""
    compared = 0
    for place in range(len(order)):
        clip = order[place]
        limit = _limit(groups[clip], best) if prune else np.float32(np.inf)
        if limit < np.inf and _is_beyond(hidden, clip, metric, curve, limit, room):
            continue
        distance = _distance_within(query, library, clip, metric, curve, limit, room)
        if distance < np.inf:
            compared += 1
            _enter(distance, clip, groups[clip], best)
    return compared


@kernel
def _is_beyond(hidden, clip, metric, curve, limit, room):  # type: ignore[no-untyped-def]
    """Whether a clip's box or its shadow (2) is too far for its distance to be within the limit."""
    room.curve[:] = max(hidden.bounds[clip], 0.0)
    if _score(metric, curve, room.curve) > limit:
        return True
    _, _, _, _, low, _ = pair_costs(hidden.query, 0, hidden.library, clip, room.costs)
    room.curve[:] = max(np.float64(low) * hidden.kept - hidden.margins[clip], 0.0)
    return _score(metric, curve, room.curve) > limit


@kernel
def _limit(group, best):  # type: ignore[no-untyped-def]
    """Return the distance above which a clip of a group cannot enter."""
    k = len(best.distance)
    for rank in range(k):
        if best.group[rank] == group:
            return best.distance[rank]
    return best.distance[k - 1]


@kernel
def _enter(distance, clip, group, best):  # type: ignore[no-untyped-def]
    """Give a clip its rank, unless k groups or its own have a nearer one."""
    rank = len(best.distance) - 1
    for other in range(rank):
        if best.group[other] == group:
            rank = other
            break
    if _is_before(best.distance[rank], best.clip[rank], distance, clip):
        return
    while rank > 0 and _is_before(distance, clip, best.distance[rank - 1], best.clip[rank - 1]):
        best.distance[rank], best.clip[rank] = best.distance[rank - 1], best.clip[rank - 1]
        best.group[rank] = best.group[rank - 1]
        rank -= 1
    best.distance[rank], best.clip[rank], best.group[rank] = distance, clip, group


@kernel
def _is_before(distance, clip, other_distance, other):  # type: ignore[no-untyped-def]
    return distance < other_distance or (distance == other_distance and clip < other)


@kernel
def _distance_within(query, library, clip, metric, curve, limit, room):  # type: ignore[no-untyped-def]
    """Distance of a pair, or infinity as soon as it is known to lie above the limit."""
    m, n, rows, width, low, high = pair_costs(query, 0, library, clip, room.costs)
    quantum = np.float64(high) * QUANTUM
    values = room.curve
    values[:] = max(np.float64(low) - quantum, 0.0)
    if _score(metric, curve, values) > limit:
        return np.float32(np.inf)
    costs = room.costs.costs[: rows * width].reshape((rows, width))
    if metric <= B_DTW:
        if np.float32(_least_average(costs, m, n, low, room.column_least) - quantum) > limit:
            return np.float32(np.inf)
        return _dtw(costs, m, n, high, metric, room.work)
    return _curve_within(costs, m, n, low, high, metric, curve, limit, values, room.work)


@kernel
def _curve_within(costs, m, n, low, high, metric, curve, limit, values, work):  # type: ignore[no-untyped-def]
    """Distance made of the curve, the greatest lambda first, or infinity once it is above the limit."""
    ahead, back, quantum, length_bits = prepare(costs, m, n, high, work)
    for t in range(len(values) - 1, -1, -1):
        if metric == WEIGHTED and curve.weights[t] == 0.0:
            continue
        if curve.thresholds[t] == 1.0:
            values[t] = min(ahead, back) * quantum
        else:
            reach = limit_of(low, high, curve.thresholds[t])
            values[t] = segment_quanta(costs, m, n, reach, length_bits, work) * quantum
        if t > 0 and _score(metric, curve, values) > limit:
            return np.float32(np.inf)
    return _score(metric, curve, values)


@kernel
def _score(metric, curve, values):  # type: ignore[no-untyped-def]
    """Make a distance of the curve's values, or a bound of their bounds; it falls where none of them does.

    Weighted as `weighted_sums` adds it; fuzzy of ends in float32, as they are stored.
    """
    if metric == WEIGHTED:
        total = 0.0
        for t in range(len(values)):
            total += curve.weights[t] * values[t]
        return np.float32(total)
    low, high = values[0], values[0]
    for t in range(1, len(values)):
        low, high = min(low, values[t]), max(high, values[t])
    if metric == FUZZY:
        return np.float32((1.0 - curve.tau) * np.float32(low) + curve.tau * np.float32(high))
    return np.float32(low)


@kernel
def _least_average(costs, m, n, low, column_least):  # type: ignore[no-untyped-def]
    """Bound the average cost along any path through (m, n) cells from below (3)."""
    width = costs.shape[1]
    for j in range(width):
        column_least[j] = costs[0, j]
    by_rows, by_columns = 0.0, 0.0
    for i in range(m):
        least = costs[i, 0]
        for j in range(width):
            least = min(least, costs[i, j])
            column_least[j] = min(column_least[j], costs[i, j])
        by_rows += least
    for j in range(n):
        by_columns += column_least[j]
    return max(by_rows + (n - 1) * low, by_columns + (m - 1) * low) / (m + n - 1)


@kernel
def _dtw(costs, m, n, high, metric, work):  # type: ignore[no-untyped-def]
    """DTW or B-DTW, as `pairwise_dtw` computes it."""
    width = costs.shape[1]
    words = work.words[: m * width]
    quantum, length_bits = pack(costs.reshape(costs.size), m, n, high, words)
    if metric == DTW:
        ahead = forward(words, width, 0, m - 1, 0, n - 1, work.row_a, work.row_b)
        return np.float32(mean_quanta(ahead, length_bits) * quantum)
    ahead, back = both_ways(words, width, 0, m - 1, 0, n - 1, work.row_a, work.row_b, 0)
    return np.float32(min(mean_quanta(ahead, length_bits), mean_quanta(back, length_bits)) * quantum)
