"""The compiled kernel of paths that stand still a few steps at most: `motionary.pipeline.alignment.limited`.

A cell has a state for each way of having come there: 0 diagonally, 1 .. most by that many steps down in a
row, most + 1 .. 2 most by that many steps across.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

_kernel = njit(cache=True, nogil=True, error_model="numpy")


@_kernel
def limited_path(
    costs: NDArray[np.floating], most: int, before: NDArray[np.int8], path: NDArray[np.int64]
) -> int:
    """Fill `path` from its end and return the row where it begins, -1 where no path leads there.

    `before` (m, n, 2 most + 1) is room for the state that each state of each cell is best reached from.
    """
    m, n = costs.shape
    states = 2 * most + 1
    totals = np.full((2, n, states), np.inf)
    for i in range(m):
        here, above = i % 2, 1 - i % 2
        totals[here] = np.inf
        for j in range(n):
            if i == 0 and j == 0:
                totals[0, 0, 0] = costs[0, 0]
                continue
            for state in range(states):
                p, q = i if state > most else i - 1, j if 1 <= state <= most else j - 1
                if p < 0 or q < 0:
                    continue
                row = here if p == i else above
                best, come = np.inf, 0
                for last in range(states):
                    if _follows(last, state, most) and totals[row, q, last] < best:
                        best, come = totals[row, q, last], last
                totals[here, j, state] = best + costs[i, j]
                before[i, j, state] = come
    state = int(np.argmin(totals[(m - 1) % 2, n - 1]))
    if totals[(m - 1) % 2, n - 1, state] == np.inf:
        return -1
    i, j, place = m - 1, n - 1, len(path) - 1
    path[place, 0], path[place, 1] = i, j
    while i > 0 or j > 0:
        come = before[i, j, state]
        if state <= most:
            i -= 1
        if not 1 <= state <= most:
            j -= 1
        state = come
        place -= 1
        path[place, 0], path[place, 1] = i, j
    return place


@_kernel
def _follows(last: int, state: int, most: int) -> bool:
    """Tell whether a step into one state may come after a step into another."""
    if state == 0:
        return True
    if state == 1:
        return last == 0 or last > most
    if state == most + 1:
        return last <= most
    return last == state - 1
