"""Segment DTW: what it costs to explain every similar segment of two clips by similar zones [DC 3].

Zones whose row intervals share a frame belong to one row segment (transitively), and the columns alike; a
zone is then an edge between a row segment and a column segment, and weighs the B-DTW of the costs inside it.
S-DTW is the least total weight of zones that touch every segment: a minimum-weight edge cover of a bipartite
multigraph. The paper enumerates up to n! orders of zones; `edge_cover.py` is exact in polynomial time.

Deviations: the paper does not say when two zones share a segment; one frame in common is our reading. It puts
S-DTW at lambda = 0 to zero; here the cells of least cost are zones like any other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs, filled_up
from motionary.pipeline.distances.edge_cover import CoverRoom, cover_room, least_cover
from motionary.pipeline.distances.fixed_point import (
    UNREACHED,
    mean_quanta,
    pack,
    refuse_too_long,
)
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES, padded
from motionary.pipeline.distances.recurrence import backward, both_ways, forward
from motionary.pipeline.distances.zones import (
    bit_words,
    checked_thresholds,
    find_zones,
    keep_bits,
    limit_of,
    most_zones,
    run_room,
)

# Zones whose weights are remembered, a power of two.
REMEMBERED = 64


class Workspace(NamedTuple):
    """Room for the S-DTW of matrices of up to (m, n), taken once and used for many pairs.

    Parameters
    ----------
    words : array (m * width,)
        Packed costs, row by row; width is n filled up to whole lanes.
    ahead, back : array (m * width,)
        T of the whole matrix, from its first row down and from its last row up (`both_ways`). They hold the
        totals of every zone that begins in the same corner.
    bits : array (m * words of a row,)
        Kept cells.
    zones, parents, runs
        As `find_zones` needs them.
    weights : array (most zones,)
        B-DTW of the zones, in quanta.
    row_segment, column_segment : array (m,), (n,)
        Segment of each frame.
    row_a, row_b : array (n,)
        A row of T of each of two recurrences.
    known_zones, known_weights : array (REMEMBERED, 4), (REMEMBERED,)
        Weights already computed for this pair (-1: none), each in the place of its zone's hash: a zone that
        a threshold leaves as it was is not computed again.
    lightest : array (m * n,)
        The lightest zone of every row segment and column segment; of those there may be m and n.
    cover : CoverRoom
        As `least_cover` needs it.
    """

    words: NDArray[np.int64]
    ahead: NDArray[np.int64]
    back: NDArray[np.int64]
    bits: NDArray[np.uint64]
    zones: NDArray[np.int32]
    parents: NDArray[np.int32]
    runs: NDArray[np.int64]
    weights: NDArray[np.int64]
    row_segment: NDArray[np.int64]
    column_segment: NDArray[np.int64]
    row_a: NDArray[np.int64]
    row_b: NDArray[np.int64]
    known_zones: NDArray[np.int64]
    known_weights: NDArray[np.int64]
    lightest: NDArray[np.int64]
    cover: CoverRoom


def make_workspace(rows: int, columns: int) -> Workspace:
    """Allocate a workspace for matrices of up to (rows, columns)."""
    cells = rows * padded(columns, LANES)
    zones = most_zones(rows, columns)
    return Workspace(
        words=np.empty(cells, dtype=np.int64),
        ahead=np.empty(cells, dtype=np.int64),
        back=np.empty(cells, dtype=np.int64),
        bits=np.empty(rows * bit_words(columns), dtype=np.uint64),
        zones=np.empty((zones, 4), dtype=np.int32),
        parents=np.empty(zones, dtype=np.int32),
        runs=run_room(columns),
        weights=np.empty(zones, dtype=np.int64),
        row_segment=np.empty(rows, dtype=np.int64),
        column_segment=np.empty(columns, dtype=np.int64),
        row_a=np.empty(columns, dtype=np.int64),
        row_b=np.empty(columns, dtype=np.int64),
        known_zones=np.full((REMEMBERED, 4), -1, dtype=np.int64),
        known_weights=np.empty(REMEMBERED, dtype=np.int64),
        lightest=np.empty(rows * columns, dtype=np.int64),
        cover=cover_room(max(rows, columns)),
    )


def segment_dtw_distance(cost: ArrayLike, threshold: float) -> float:
    """Least total B-DTW distance of similar zones that cover every similar segment of both clips [DC 3].

    Parameters
    ----------
    cost : array (m, n)
        Finite costs, not negative.
    threshold : float
        lambda, 0 to 1; at 1 the distance is exactly the B-DTW of the matrix.

    Returns
    -------
    float
        In the unit of the costs.

    Raises
    ------
    ValueError
        `cost` is not a matrix of finite costs or too long, or `threshold` is outside 0 .. 1.
    """
    costs = checked_costs(cost)
    m, n = costs.shape
    refuse_too_long(m, n)
    low, high = costs.min(), costs.max()
    (value,) = checked_thresholds([threshold])
    limit = limit_of(low, high, value)
    work = make_workspace(m, n)
    filled = filled_up(costs)
    _, _, quantum, length_bits = prepare(filled, m, n, high, work)
    return segment_quanta(filled, m, n, limit, length_bits, work) * quantum


@kernel
def prepare(costs, m, n, high, work):  # type: ignore[no-untyped-def]
    """Pack costs (rows, width), of which (m, n) count, and run over the whole matrix in both directions.

    Returns the means of both directions in quanta, the quantum and the bits of a length.
    """
    width = costs.shape[1]
    words = work.words[: m * width]
    quantum, length_bits = pack(costs.reshape(costs.size), m, n, high, words)
    ahead, back = both_ways(words, width, 0, m - 1, 0, n - 1, work.ahead, work.back, width)
    work.known_zones[:] = -1
    return mean_quanta(ahead, length_bits), mean_quanta(back, length_bits), quantum, length_bits


@kernel
def segment_quanta(costs, m, n, limit, length_bits, work):  # type: ignore[no-untyped-def]
    """S-DTW in quanta, of the cells with cost at most `limit`, after `prepare`."""
    bits = work.bits[: m * bit_words(n)].reshape((m, bit_words(n)))
    zones, weights = work.zones, work.weights
    keep_bits(costs, limit, n, bits)
    count = find_zones(bits, zones, work.parents, work.runs)
    for z in range(count):
        weights[z] = _weight(
            np.int64(zones[z, 0]), np.int64(zones[z, 1]), np.int64(zones[z, 2]), np.int64(zones[z, 3]),
            m, costs.shape[1], length_bits, work,
        )  # fmt: skip
    if count == 1:
        return weights[0]
    row_segments = _segments(zones, count, 0, work.row_segment, m)
    column_segments = _segments(zones, count, 2, work.column_segment, n)
    fewer, more = min(row_segments, column_segments), max(row_segments, column_segments)
    lightest = work.lightest[: fewer * more].reshape((fewer, more))
    lightest[:] = UNREACHED
    for z in range(count):
        r, c = work.row_segment[zones[z, 0]], work.column_segment[zones[z, 2]]
        if row_segments > column_segments:
            r, c = c, r
        lightest[r, c] = min(lightest[r, c], weights[z])
    return least_cover(lightest, work.cover)


@kernel
def _weight(top, bottom, left, right, rows, width, length_bits, work):  # type: ignore[no-untyped-def]
    """B-DTW of a zone in quanta: read off the whole matrix's T, remembered, or computed."""
    from_first, from_last = left == 0 and top == 0, left == 0 and bottom == rows - 1
    if from_first and from_last:
        ahead, back = work.ahead[bottom * width + right], work.back[bottom * width + right]
        return min(mean_quanta(ahead, length_bits), mean_quanta(back, length_bits))
    # Another zone of the same place overwrites: what that costs is a computation.
    place = (top * 31 + bottom * 37 + left * 41 + right * 43) % REMEMBERED
    known = work.known_zones[place]
    if known[0] == top and known[1] == bottom and known[2] == left and known[3] == right:
        return work.known_weights[place]
    words = work.words
    if from_first:
        ahead = work.ahead[bottom * width + right]
        back = backward(words, width, top, bottom, left, right, work.row_a, work.row_b)
    elif from_last:
        ahead = forward(words, width, top, bottom, left, right, work.row_a, work.row_b)
        back = work.back[(rows - 1 - top) * width + right]
    else:
        ahead, back = both_ways(words, width, top, bottom, left, right, work.row_a, work.row_b, 0)
    known[0], known[1], known[2], known[3] = top, bottom, left, right
    work.known_weights[place] = min(mean_quanta(ahead, length_bits), mean_quanta(back, length_bits))
    return work.known_weights[place]


@kernel
def _segments(zones, count, side, segment, frames):  # type: ignore[no-untyped-def]
    """Count the unions of the zones' row (side 0) or column (side 2) intervals that share a frame.

    Fills `segment` with the number of the union at each frame that lies in one.
    """
    for frame in range(frames):
        segment[frame] = -1
    for z in range(count):
        segment[zones[z, side]] = max(segment[zones[z, side]], zones[z, side + 1])
    unions = 0
    end = -1
    for frame in range(frames):
        if segment[frame] >= 0:
            if frame > end:
                unions += 1
            end = max(end, segment[frame])
        segment[frame] = unions - 1
    return unions
