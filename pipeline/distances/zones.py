"""Similar zones: the rectangles around the connected regions of small cost [DC 4.3, eq. 6].

    delta = min(D) + lambda (max(D) - min(D)),    in float64; at lambda = 1 exactly max(D)

Cells of cost <= delta are kept; those that touch, by an edge or by a corner, form a region (8-connected); the
zone is the region's bounding rectangle (the paper's Least Similar Zone). No two regions have one rectangle:
each reaches all four sides of its own, so two that share it would cross.

Regions are found row by row: the kept cells of a row are bits, their runs are joined with the touching runs
of the row above, and the joined sets are kept in a union-find forest that carries the rectangles.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs, filled_up
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import WORD, bits_at_most, trailing_zeros


def similar_zones(cost: ArrayLike, threshold: float) -> NDArray[np.int64]:
    """Bounding rectangles of the regions of cost at most delta(lambda) (eq. 6).

    Parameters
    ----------
    cost : array (m, n)
        Finite costs, not negative; compared in float64.
    threshold : float
        lambda, 0 to 1.

    Returns
    -------
    array (zones, 4) of int
        First row, last row, first column, last column, all inclusive; sorted in that order. Never empty.

    Raises
    ------
    ValueError
        `cost` is not a matrix of finite costs, or `threshold` is outside 0 .. 1.
    """
    costs = checked_costs(cost)
    m, n = costs.shape
    (value,) = checked_thresholds([threshold])
    bits = np.empty((m, bit_words(n)), dtype=np.uint64)
    keep_bits(filled_up(costs), limit_of(costs.min(), costs.max(), value), n, bits)
    zones = np.empty((most_zones(m, n), 4), dtype=np.int64)
    count = find_zones(bits, zones, np.empty(len(zones), dtype=np.int64), run_room(n))
    found = zones[:count].astype(np.int64)
    return found[np.lexsort(found.T[::-1])]


def checked_thresholds(thresholds: ArrayLike) -> NDArray[np.float64]:
    """Convert thresholds to float64 (count,) and check that there is one and that they lie in 0 .. 1.

    Raises
    ------
    ValueError
        Names the threshold at fault.
    """
    values = np.ascontiguousarray(thresholds, dtype=np.float64)
    if values.ndim != 1 or values.size == 0:
        raise ValueError(f"thresholds have shape {values.shape}; give a sequence of at least one")
    outside = ~((values >= 0) & (values <= 1))
    if outside.any():
        raise ValueError(f"threshold is {values[outside][0]}; it must lie in 0 .. 1")
    return values


def most_zones(rows: int, columns: int) -> int:
    """Return an upper bound on sets: of any two by two cells, at most one begins a set."""
    return -(-rows // 2) * -(-columns // 2)


def run_room(columns: int) -> NDArray[np.int64]:
    """Room for the first column, the last column and the set of every run in two rows."""
    return np.empty((3, 2 * (columns // 2 + 1)), dtype=np.int64)


@kernel
def bit_words(columns):  # type: ignore[no-untyped-def]
    """Words of bits that hold a row."""
    return (columns + WORD - 1) // WORD


@kernel
def limit_of(low, high, threshold):  # type: ignore[no-untyped-def]
    """Delta of a threshold lambda (eq. 6)."""
    least, greatest = np.float64(low), np.float64(high)
    return greatest if threshold == 1.0 else least + threshold * (greatest - least)


@kernel
def keep_bits(costs, limit, columns, bits):  # type: ignore[no-untyped-def]
    """Fill `bits` (m, words): bit j of word w is set where the cost at column 64 w + j is at most `limit`.

    `costs` (rows, width) are filled up to whole lanes and, after the last row, to a whole word; of their
    columns, the first `columns` count.
    """
    width = costs.shape[1]
    flat = costs.reshape(costs.size)
    largest = _rounded_down(limit, flat)
    inside = ~np.uint64(0) >> np.uint64(-columns % WORD)
    last = bits.shape[1] - 1
    for i in range(bits.shape[0]):
        for w in range(last):
            bits[i, w] = bits_at_most(flat, i * width + w * WORD, largest)
        bits[i, last] = bits_at_most(flat, i * width + last * WORD, largest) & inside


@kernel
def _rounded_down(limit, costs):  # type: ignore[no-untyped-def]
    """Return the greatest number of the costs' type that is not above `limit`: it keeps the same costs."""
    nearest = costs.dtype.type(limit)
    if np.float64(nearest) > limit:
        return np.nextafter(nearest, costs.dtype.type(-np.inf))
    return nearest


@kernel
def find_zones(bits, zones, parents, runs):  # type: ignore[no-untyped-def]
    """Fill `zones` (count, 4) with the rectangles around the 8-connected regions of `bits`; return the count.

    `parents` is the union-find forest (a set's representative is its own parent), `zones` the rectangles of
    its sets until, at the end, the representatives' are moved to the front.
    """
    starts, stops, owners = runs[0], runs[1], runs[2]
    half = runs.shape[1] // 2
    row_begin, above_begin, above_end = 0, half, half
    sets = 0
    for i in range(bits.shape[0]):
        place, touching = row_begin, above_begin
        last = -2
        for w in range(bits.shape[1]):
            word = bits[i, w]
            while word:
                low = trailing_zeros(word)
                start: Any = np.int64(low) + w * WORD
                stop = start + np.int64(trailing_zeros(~(word >> low))) - 1
                # Adding its lowest bit carries through the first run of a word and leaves the others.
                word &= word + (np.uint64(1) << low)
                own: Any = -1
                if start == last + 1:
                    # The run goes on from the word before.
                    place -= 1
                    start, own = starts[place], owners[place]
                last = stop
                while touching < above_end and stops[touching] < start - 1:
                    touching += 1
                other = touching
                while other < above_end and starts[other] <= stop + 1:
                    found = _representative(parents, owners[other])
                    own = found if own < 0 else _join(parents, zones, own, found)
                    other += 1
                if own < 0:
                    own = sets
                    sets += 1
                    parents[own] = own
                    zones[own, 0], zones[own, 2], zones[own, 3] = i, start, stop
                zones[own, 1] = i
                zones[own, 2] = min(zones[own, 2], start)
                zones[own, 3] = max(zones[own, 3], stop)
                starts[place], stops[place], owners[place] = start, stop, own
                place += 1
        above_begin, above_end, row_begin = row_begin, place, half - row_begin
    return _move_to_front(parents, zones, sets)


@kernel
def _representative(parents, member):  # type: ignore[no-untyped-def]
    while parents[member] != member:
        parents[member] = parents[parents[member]]
        member = parents[member]
    return member


@kernel
def _join(parents, zones, a, b):  # type: ignore[no-untyped-def]
    """Join two sets, given by their representatives; return the joined set's.

    The last row is left: who joins is at a row below, and sets it.
    """
    if a == b:
        return a
    kept, gone = min(a, b), max(a, b)
    parents[gone] = kept
    zones[kept, 0] = min(zones[kept, 0], zones[gone, 0])
    zones[kept, 2] = min(zones[kept, 2], zones[gone, 2])
    zones[kept, 3] = max(zones[kept, 3], zones[gone, 3])
    return kept


@kernel
def _move_to_front(parents, zones, sets):  # type: ignore[no-untyped-def]
    """Move the representatives' rectangles to the front of `zones`; return their number."""
    count = 0
    for s in range(sets):
        if parents[s] == s:
            for side in range(4):
                zones[count, side] = zones[s, side]
            count += 1
    return count
