"""The compiled kernels of `pruned.py`: every pair through the bounds, from cheapest to the whole curve."""

from __future__ import annotations

import numpy as np

from motionary.pipeline.distances.fixed_point import pack
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES
from motionary.pipeline.distances.lower_bound import fill_profile, near_boxes, runs_apart, stretches
from motionary.pipeline.distances.segment_dtw import prepare, segment_quanta
from motionary.pipeline.distances.tiles import pair_costs
from motionary.pipeline.distances.zones import limit_of

PAIRS, BY_BOXES, BY_LOW, BY_PROFILE, BY_SUM = range(5)
"""Places of what is counted."""


@kernel
def fill_found(  # type: ignore[no-untyped-def]
    a, b, boxes_a, boxes_b, thresholds, weights, limit, kept, upper, p, q, room, work, scratch, slots, counts
):
    """Go through the pairs from (p, q) on until all are through or the slots are full.

    Returns how many slots are filled, and the pair to go on from.
    """
    found = 0
    while p < len(a.frames):
        _fill_near(boxes_a.whole, p, boxes_b.whole, limit, scratch.near)
        if upper:
            q = max(q, p + 1)
        while q < len(b.frames):
            if found == len(slots.first):
                return found, p, q
            other, q = q, q + 1
            counts[PAIRS] += 1
            near = scratch.near[other // LANES] >> np.uint64(other % LANES) & np.uint64(1)
            if not near or runs_apart(boxes_a, p, boxes_b, other, limit):
                counts[BY_BOXES] += 1
                continue
            m, n, rows, width, low, high = pair_costs(a, p, b, other, room)
            costs = room.costs[: rows * width].reshape((rows, width))
            refused, dtw, b_dtw = _curve_under(
                costs, m, n, low, high, thresholds, weights, kept, slots.curve[found], work, scratch
            )
            if refused:
                counts[refused] += 1
            elif np.float32(_weighted(slots.curve[found], weights)) <= kept:
                slots.first[found], slots.second[found] = p, other
                slots.dtw[found], slots.b_dtw[found] = dtw, b_dtw
                found += 1
        p += 1
        q = 0
    return found, p, q


@kernel
def _fill_near(boxes, row, others, limit, near):  # type: ignore[no-untyped-def]
    """Fill `near` with the bits of the clips whose boxes are near that of one clip."""
    for block in range(len(near)):
        near[block] = near_boxes(
            boxes.low, boxes.high, row, others.low_lanes, others.high_lanes, block, limit
        )


@kernel
def _curve_under(costs, m, n, low, high, thresholds, weights, kept, curve, work, scratch):  # type: ignore[no-untyped-def]
    """Fill `curve` unless a bound puts the weighted distance above `kept`; return what refused it, or 0.

    Returns DTW and B-DTW too, where nothing refused. While it is being filled, `curve` holds bounds in the
    places of what is not known.
    """
    profile, quanta = scratch.profile[: m + n], scratch.quanta[: m + n]
    profile[0] = low
    quantum, length_bits = pack(profile, m, n, high, quanta[:1])
    for t in range(len(thresholds)):
        curve[t] = (quanta[0] >> length_bits) * quantum
    if np.float32(_weighted(curve, weights)) > kept:
        return BY_LOW, 0.0, 0.0
    fill_profile(costs, m, n, profile)
    pack(profile, m, n, high, quanta)
    for i in range(m + n):
        quanta[i] >>= length_bits
    for t in range(len(thresholds)):
        limit = limit_of(low, high, thresholds[t])
        bound = max(stretches(profile, quanta, 0, m, limit), stretches(profile, quanta, m, m + n, limit))
        curve[t] = bound * quantum
    if np.float32(_weighted(curve, weights)) > kept:
        return BY_PROFILE, 0.0, 0.0
    ahead, back, quantum, length_bits = prepare(costs, m, n, high, work)
    for t in range(len(thresholds) - 1, -1, -1):
        if thresholds[t] == 1.0:
            curve[t] = min(ahead, back) * quantum
        else:
            limit = limit_of(low, high, thresholds[t])
            curve[t] = segment_quanta(costs, m, n, limit, length_bits, work) * quantum
        if t > 0 and np.float32(_weighted(curve, weights)) > kept:
            return BY_SUM, 0.0, 0.0
    return 0, ahead * quantum, min(ahead, back) * quantum


@kernel
def _weighted(curve, weights):  # type: ignore[no-untyped-def]
    """Weighted distance of a curve, in the order and with the bits of `weighted_sums`."""
    total = 0.0
    for t in range(len(weights)):
        total += weights[t] * curve[t]
    return total
