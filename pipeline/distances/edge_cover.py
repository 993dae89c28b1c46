"""The cheapest set of edges that touches every node of a bipartite graph, exactly.

In a cheapest cover every node either takes its cheapest edge, at cost c, or shares an edge chosen for both
its ends. Choosing (u, v) of weight w for both saves c_u + c_v - w, and the edges chosen so form a matching:

    least cover = sum over nodes of c - greatest total saving of a matching

The matching is found as an assignment of the smaller side to the larger one, by successive shortest
augmenting paths with potentials (Kuhn-Munkres in Jonker and Volgenant's form), in O(R^2 C) for R <= C.
Weights are integers: the least total is exact, whichever of several cheapest covers is met.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from motionary.pipeline.distances.fixed_point import UNREACHED


@njit(cache=True, nogil=True)
def least_cover(weights):  # type: ignore[no-untyped-def]
    """Least total weight of edges that touch every row and every column.

    `weights` (R, C) int64 holds the lightest edge of each pair of nodes, UNREACHED where there is none; every
    row and every column has one. It is overwritten.
    """
    rows, columns = weights.shape
    row_least, column_least = np.full(rows, UNREACHED), np.full(columns, UNREACHED)
    for r in range(rows):
        for c in range(columns):
            row_least[r] = min(row_least[r], weights[r, c])
            column_least[c] = min(column_least[c], weights[r, c])
    if rows == 1:
        return column_least.sum()
    if columns == 1:
        return row_least.sum()
    for r in range(rows):
        for c in range(columns):
            weights[r, c] = min(0, weights[r, c] - row_least[r] - column_least[c])
    savings = _least_assignment(weights) if rows <= columns else _least_assignment(weights.T)
    return row_least.sum() + column_least.sum() + savings


@njit(cache=True, nogil=True)
def _least_assignment(costs):  # type: ignore[no-untyped-def]
    """Least total cost of giving every row a column of its own; at least as many columns as rows.

    `owner[c]` is the row that has column c. Column `columns` is a place to start from, outside the matrix.
    """
    rows, columns = costs.shape
    row_potential, column_potential = np.zeros(rows, np.int64), np.zeros(columns + 1, np.int64)
    owner, came_from = np.full(columns + 1, -1), np.empty(columns + 1, np.int64)
    distance, reached = np.empty(columns, np.int64), np.empty(columns + 1, np.bool_)
    for row in range(rows):
        owner[columns] = row
        distance[:] = UNREACHED
        reached[:] = False
        column = columns
        while owner[column] >= 0:
            reached[column] = True
            nearest = _extend(
                costs, owner[column], column, row_potential, column_potential, distance, came_from, reached
            )
            step = distance[nearest]
            for c in range(columns + 1):
                if reached[c]:
                    row_potential[owner[c]] += step
                    column_potential[c] -= step
                else:
                    distance[c] -= step
            column = nearest
        while column != columns:
            before = came_from[column]
            owner[column] = owner[before]
            column = before
    total = 0
    for c in range(columns):
        if owner[c] >= 0:
            total += costs[owner[c], c]
    return total


@njit(cache=True, nogil=True)
def _extend(costs, row, column, row_potential, column_potential, distance, came_from, reached):  # type: ignore[no-untyped-def]
    """Shorten distances through `row`, the owner of `column`; return the nearest column not yet reached."""
    nearest = -1
    for c in range(len(distance)):
        if not reached[c]:
            reduced = costs[row, c] - row_potential[row] - column_potential[c]
            if reduced < distance[c]:
                distance[c] = reduced
                came_from[c] = column
            if nearest < 0 or distance[c] < distance[nearest]:
                nearest = c
    return nearest
