"""Dynamic time warping, and in both directions: DTW and B-DTW [DC 3, eq. 1].

    T(i, j) = D(i, j) + min(T(i-1, j-1), T(i-1, j), T(i, j-1)),    both ends fixed

The distance is the *average* cost along the path of least total cost, as the paper has it (not the total, nor
the total over m + n). Among paths of equal total the shortest counts, which the paper leaves open: T is the
pair (total, number of cells), compared in that order, so the distance does not depend on how it is computed.
B-DTW is the smaller of the distances of M to N and of M to N reversed.

Totals are exact integers (`fixed_point.py`); the distance of a matrix and of its transpose agree bit for bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs
from motionary.pipeline.distances.fixed_point import (
    UNREACHED,
    mean_quanta,
    pack,
    refuse_too_long,
)
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.recurrence import both_ways


def dtw_distance(cost: ArrayLike) -> float:
    """Average cost along the path of least total cost, from the first cell to the last.

    Parameters
    ----------
    cost : array (m, n)
        Cost of showing frame i of one clip with frame j of the other; finite, not negative.

    Returns
    -------
    float
        In the unit of the costs.

    Raises
    ------
    ValueError
        `cost` is not a matrix of finite costs, or too long (m + n above 2^19).
    """
    return _distances(cost)[0]


def bidirectional_dtw_distance(cost: ArrayLike) -> float:
    """B-DTW: the smaller DTW distance of the two with the second clip played forward and backward (eq. 1).

    Parameters
    ----------
    cost : array (m, n)
        Finite costs, not negative.

    Returns
    -------
    float
        In the unit of the costs.

    Raises
    ------
    ValueError
        As `dtw_distance`.
    """
    return min(_distances(cost))


def dtw_path(cost: ArrayLike) -> NDArray[np.int64]:
    """Cells of a path of least total cost, and of the fewest cells among those.

    Where several are left, the one that, followed from its end, steps back in both clips where it can, else
    in the first clip alone, else in the second alone.

    Parameters
    ----------
    cost : array (m, n)
        Finite costs, not negative.

    Returns
    -------
    array (L, 2) of int
        Frames of the first and of the second clip, from (0, 0) to (m - 1, n - 1).

    Raises
    ------
    ValueError
        As `dtw_distance`.
    """
    words, _, _ = packed_costs(checked_costs(cost))
    _accumulate(words)
    m, n = words.shape
    path = np.empty((m + n - 1, 2), dtype=np.int64)
    return path[_trace_back(words, path) :]


def packed_costs(costs: NDArray[np.float64]) -> tuple[NDArray[np.int64], float, int]:
    """Pack checked costs into words (m, n); return them, their quantum and the bits of a path's length."""
    m, n = costs.shape
    refuse_too_long(m, n)
    words = np.empty(m * n, dtype=np.int64)
    quantum, length_bits = pack(costs.ravel(), m, n, costs.max(), words)
    return words.reshape(m, n), quantum, length_bits


def _distances(cost: ArrayLike) -> tuple[float, float]:
    words, quantum, length_bits = packed_costs(checked_costs(cost))
    m, n = words.shape
    ahead, back = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    totals = both_ways(words.ravel(), n, 0, m - 1, 0, n - 1, ahead, back, 0)
    forward, backward = (mean_quanta(total, length_bits) * quantum for total in totals)
    return forward, backward


@kernel
def _accumulate(words):  # type: ignore[no-untyped-def]
    """Replace every word by the least total of a path that ends there."""
    m, n = words.shape
    for j in range(1, n):
        words[0, j] += words[0, j - 1]
    for i in range(1, m):
        words[i, 0] += words[i - 1, 0]
        for j in range(1, n):
            words[i, j] += min(words[i, j - 1], words[i - 1, j - 1], words[i - 1, j])


@kernel
def _trace_back(totals, path):  # type: ignore[no-untyped-def]
    """Fill `path` from its end; return the row where it begins."""
    i, j = totals.shape[0] - 1, totals.shape[1] - 1
    place = len(path) - 1
    path[place] = i, j
    while i > 0 or j > 0:
        diagonal = totals[i - 1, j - 1] if i > 0 and j > 0 else UNREACHED
        above = totals[i - 1, j] if i > 0 else UNREACHED
        beside = totals[i, j - 1] if j > 0 else UNREACHED
        if diagonal <= above and diagonal <= beside:
            i, j = i - 1, j - 1
        elif above <= beside:
            i -= 1
        else:
            j -= 1
        place -= 1
        path[place] = i, j
    return place
