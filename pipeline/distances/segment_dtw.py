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
from numba import njit
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs
from motionary.pipeline.distances.dtw import both_directions, packed_costs
from motionary.pipeline.distances.edge_cover import least_cover
from motionary.pipeline.distances.fixed_point import UNREACHED, mean_quanta
from motionary.pipeline.distances.zones import (
    bit_words,
    checked_thresholds,
    find_zones,
    keep_bits,
    limit_of,
    most_zones,
    run_buffer,
)

# Zones whose weights are remembered, a power of two.
REMEMBERED = 64


class Workspace(NamedTuple):
    """Room for the S-DTW of matrices of up to (m, n), taken once and used for many pairs.

    Parameters
    ----------
    words : array (m * n,)
        Packed costs.
    bits : array (m * words of a row,)
        Kept cells.
    zones, parents, runs
        As `find_zones` needs them.
    weights : array (most zones,)
        B-DTW of the zones, in quanta.
    row_segment, column_segment : array (m,), (n,)
        Segment of each frame.
    forward, backward : array (n,)
        Rows of the two recurrences.
    known_zones, known_weights : array (REMEMBERED, 4), (REMEMBERED,)
        Weights already computed for this pair (-1: none), each in the place of its zone's hash: a zone that
        a threshold leaves as it was is not computed again.
    """

    words: NDArray[np.int64]
    bits: NDArray[np.int64]
    zones: NDArray[np.int64]
    parents: NDArray[np.int64]
    runs: NDArray[np.int64]
    weights: NDArray[np.int64]
    row_segment: NDArray[np.int64]
    column_segment: NDArray[np.int64]
    forward: NDArray[np.int64]
    backward: NDArray[np.int64]
    known_zones: NDArray[np.int64]
    known_weights: NDArray[np.int64]


def make_workspace(rows: int, columns: int) -> Workspace:
    """Allocate a workspace for matrices of up to (rows, columns)."""
    zones = most_zones(rows, columns)
    return Workspace(
        words=np.empty(rows * columns, dtype=np.int64),
        bits=np.empty(rows * bit_words(columns), dtype=np.int64),
        zones=np.empty((zones, 4), dtype=np.int64),
        parents=np.empty(zones, dtype=np.int64),
        runs=run_buffer(columns),
        weights=np.empty(zones, dtype=np.int64),
        row_segment=np.empty(rows, dtype=np.int64),
        column_segment=np.empty(columns, dtype=np.int64),
        forward=np.empty(columns, dtype=np.int64),
        backward=np.empty(columns, dtype=np.int64),
        known_zones=np.full((REMEMBERED, 4), -1, dtype=np.int64),
        known_weights=np.empty(REMEMBERED, dtype=np.int64),
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
    words, quantum, length_bits = packed_costs(costs)
    limit = limit_of(costs.min(), costs.max(), *checked_thresholds([threshold]))
    return segment_quanta(costs, limit, words, length_bits, make_workspace(*costs.shape)) * quantum


@njit(cache=True, nogil=True)
def segment_quanta(costs, limit, words, length_bits, work):  # type: ignore[no-untyped-def]
    """S-DTW in quanta, of the cells with cost at most `limit`; `words` (m, n) are the packed costs."""
    rows, columns = words.shape
    bits, zones, weights = work.bits[: rows * bit_words(columns)], work.zones, work.weights
    kept = bits.reshape((rows, bit_words(columns)))
    keep_bits(costs, limit, kept)
    count = find_zones(kept, zones, work.parents, work.runs)
    _weigh(words, length_bits, zones, count, weights, work)
    if count == 1:
        return weights[0]
    row_segments = _segments(zones, count, 0, work.row_segment, rows)
    column_segments = _segments(zones, count, 2, work.column_segment, columns)
    lightest = np.full((row_segments, column_segments), UNREACHED)
    for z in range(count):
        r, c = work.row_segment[zones[z, 0]], work.column_segment[zones[z, 2]]
        lightest[r, c] = min(lightest[r, c], weights[z])
    return least_cover(lightest)


@njit(cache=True, nogil=True)
def _weigh(words, length_bits, zones, count, weights, work):  # type: ignore[no-untyped-def]
    """Fill `weights` with the zones' B-DTW in quanta, computed or remembered."""
    known_zones, known_weights = work.known_zones, work.known_weights
    for z in range(count):
        top, bottom, left, right = zones[z, 0], zones[z, 1], zones[z, 2], zones[z, 3]
        place = (top * 31 + bottom * 37 + left * 41 + right * 43) % REMEMBERED
        if (
            known_zones[place, 0] != top
            or known_zones[place, 1] != bottom
            or known_zones[place, 2] != left
            or known_zones[place, 3] != right
        ):
            ahead, back = both_directions(words, top, bottom, left, right, work.forward, work.backward)
            known_weights[place] = min(mean_quanta(ahead, length_bits), mean_quanta(back, length_bits))
            for side in range(4):
                known_zones[place, side] = zones[z, side]
        weights[z] = known_weights[place]


@njit(cache=True, nogil=True)
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
