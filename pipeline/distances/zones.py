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
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs

# Columns in a word of bits: one fewer than the machine's 64, so that no word is negative.
WORD = 63


def _count_trailing_zeros(typingctx: Any, word: Any) -> Any:
    """Count the zero bits below the lowest set bit of a 64-bit integer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], cgutils.false_bit)

    return types.int64(types.int64), generate


_trailing_zeros: Any = intrinsic(_count_trailing_zeros)


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
    (value,) = checked_thresholds([threshold])
    bits = np.empty((len(costs), bit_words(costs.shape[1])), dtype=np.int64)
    keep_bits(costs, limit_of(costs.min(), costs.max(), value), bits)
    zones = np.empty((most_zones(*costs.shape), 4), dtype=np.int64)
    count = find_zones(bits, zones, np.empty(len(zones), dtype=np.int64), run_buffer(costs.shape[1]))
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
    """Return an upper bound on regions, and on runs that touch none above: their first cells never touch."""
    return -(-rows // 2) * -(-columns // 2)


def run_buffer(columns: int) -> NDArray[np.int64]:
    """Room for the runs (first column, last column, set) of two rows."""
    return np.empty((2, columns // 2 + 1, 3), dtype=np.int64)


@njit(cache=True, nogil=True)
def bit_words(columns):  # type: ignore[no-untyped-def]
    """Words of bits that hold a row."""
    return (columns + WORD - 1) // WORD


@njit(cache=True, nogil=True)
def limit_of(low, high, threshold):  # type: ignore[no-untyped-def]
    """Delta of a threshold lambda (eq. 6)."""
    return high if threshold == 1.0 else low + threshold * (high - low)


@njit(cache=True, nogil=True)
def keep_bits(costs, limit, bits):  # type: ignore[no-untyped-def]
    """Fill `bits` (m, words): bit j of word w is set where the cost at column 63 w + j is at most `limit`."""
    columns = costs.shape[1]
    for i in range(costs.shape[0]):
        for w in range(bits.shape[1]):
            row = costs[i, w * WORD : min(columns, (w + 1) * WORD)]
            word = np.int64(0)
            for j in range(len(row)):
                word |= np.int64(row[j] <= limit) << j
            bits[i, w] = word


@njit(cache=True, nogil=True)
def find_zones(bits, zones, parents, runs):  # type: ignore[no-untyped-def]
    """Fill `zones` (count, 4) with the rectangles around the 8-connected regions of `bits`; return the count.

    `parents` is the union-find forest (a set's representative is its own parent), `zones` the rectangles of
    its sets until, at the end, the representatives' are moved to the front.
    """
    sets = 0
    count_above = 0
    for i in range(bits.shape[0]):
        row, above = i & 1, 1 - (i & 1)
        count = _find_runs(bits, i, runs, row)
        first_touching = 0
        for r in range(count):
            start, stop = runs[row, r, 0], runs[row, r, 1]
            while first_touching < count_above and runs[above, first_touching, 1] < start - 1:
                first_touching += 1
            own = -1
            touching = first_touching
            while touching < count_above and runs[above, touching, 0] <= stop + 1:
                other = _representative(parents, runs[above, touching, 2])
                own = other if own < 0 else _join(parents, zones, own, other)
                touching += 1
            if own < 0:
                own = sets
                sets += 1
                parents[own] = own
                zones[own, 0], zones[own, 2], zones[own, 3] = i, start, stop
            zones[own, 1] = i
            zones[own, 2] = min(zones[own, 2], start)
            zones[own, 3] = max(zones[own, 3], stop)
            runs[row, r, 2] = own
        count_above = count
    return _move_to_front(parents, zones, sets)


@njit(cache=True, nogil=True)
def _find_runs(bits, i, runs, row):  # type: ignore[no-untyped-def]
    """Fill `runs[row]` with the first and last column of every run of set bits in row i; return their number.

    Here and above, arrays are passed whole with an index: a view of a row costs more than the row's work.
    """
    count = 0
    last = -2
    for w in range(bits.shape[1]):
        word = bits[i, w]
        while word:
            start = _trailing_zeros(word)
            length = _trailing_zeros(~(word >> start))
            word &= -1 << (start + length)
            start += w * WORD
            if start == last + 1:
                count -= 1
            else:
                runs[row, count, 0] = start
            last = start + length - 1
            runs[row, count, 1] = last
            count += 1
    return count


@njit(cache=True, nogil=True)
def _representative(parents, member):  # type: ignore[no-untyped-def]
    while parents[member] != member:
        parents[member] = parents[parents[member]]
        member = parents[member]
    return member


@njit(cache=True, nogil=True)
def _join(parents, zones, a, b):  # type: ignore[no-untyped-def]
    """Join two sets, given by their representatives; return the joined set's."""
    if a == b:
        return a
    kept, gone = min(a, b), max(a, b)
    parents[gone] = kept
    zones[kept, 0] = min(zones[kept, 0], zones[gone, 0])
    zones[kept, 2] = min(zones[kept, 2], zones[gone, 2])
    zones[kept, 3] = max(zones[kept, 3], zones[gone, 3])
    return kept


@njit(cache=True, nogil=True)
def _move_to_front(parents, zones, sets):  # type: ignore[no-untyped-def]
    """Move the representatives' rectangles to the front of `zones`; return their number."""
    count = 0
    for s in range(sets):
        if parents[s] == s:
            for side in range(4):
                zones[count, side] = zones[s, side]
            count += 1
    return count
