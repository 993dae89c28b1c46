"""The cheapest set of edges that touches every node of a bipartite graph, exactly.

In a cheapest cover every node either takes its cheapest edge, at cost c, or shares an edge chosen for both
its ends. Choosing (u, v) of weight w for both saves c_u + c_v - w, and the edges chosen so form a matching:

    least cover = sum over nodes of c - greatest total saving of a matching

The matching is found as an assignment of the smaller side to the larger one, by successive shortest
augmenting paths with potentials (Kuhn-Munkres in Jonker and Volgenant's form), in O(R^2 C) for R <= C.
Weights are integers: the least total is exact, whichever of several cheapest covers is met.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.distances.fixed_point import UNREACHED
from motionary.pipeline.distances.kernel import kernel


class CoverRoom(NamedTuple):
    """Room for `least_cover` of up to R by C nodes, R <= C.

    Parameters
    ----------
    row_least, column_least : array (C,)
        The cheapest edge of every node.
    row_potential, column_potential : array (C,), (C + 1,)
        Potentials of the assignment.
    owner, came_from : array (C + 1,)
        The row that has each column, and the column before it on the augmenting path.
    distance, reached : array (C,), (C + 1,)
        Length of the shortest augmenting path to each column, and whether it is final.
    """

    row_least: NDArray[np.int64]
    column_least: NDArray[np.int64]
    row_potential: NDArray[np.int64]
    column_potential: NDArray[np.int64]
    owner: NDArray[np.int64]
    came_from: NDArray[np.int64]
    distance: NDArray[np.int64]
    reached: NDArray[np.bool_]


def cover_room(nodes: int) -> CoverRoom:
    """Allocate room for covers of up to (nodes, nodes)."""
    return CoverRoom._make([*np.empty((7, nodes + 1), dtype=np.int64), np.empty(nodes + 1, dtype=np.bool_)])


@kernel
def least_cover(weights, room):  # type: ignore[no-untyped-def]
    """Least total weight of edges that touch every row and every column.

    `weights` (R, C) int64, R <= C, holds the lightest edge of each pair of nodes, UNREACHED where there is
    none; every row and every column has one. It is overwritten.
    """
    rows, columns = weights.shape
    row_least, column_least = room.row_least, room.column_least
    column_least[:columns] = UNREACHED
    total = 0
    for r in range(rows):
        row_least[r] = UNREACHED
        for c in range(columns):
            row_least[r] = min(row_least[r], weights[r, c])
            column_least[c] = min(column_least[c], weights[r, c])
        total += row_least[r]
    if rows == 1:
        total = 0
    for c in range(columns):
        total += column_least[c]
    if rows == 1:
        return total
    for r in range(rows):
        for c in range(columns):
            weights[r, c] = min(0, weights[r, c] - row_least[r] - column_least[c])
    return total + _least_assignment(weights, room)


@kernel
def _least_assignment(costs, room):  # type: ignore[no-untyped-def]
    """Least total cost of giving every row a column of its own; at least as many columns as rows.

    `owner[c]` is the row that has column c. Column `columns` is a place to start from, outside the matrix.
    """
    rows, columns = costs.shape
    owner, came_from, distance, reached = room.owner, room.came_from, room.distance, room.reached
    room.row_potential[:rows] = 0
    room.column_potential[: columns + 1] = 0
    owner[: columns + 1] = -1
    for row in range(rows):
        owner[columns] = row
        distance[:columns] = UNREACHED
        reached[: columns + 1] = False
        column = columns
        while owner[column] >= 0:
            reached[column] = True
            nearest = _extend(costs, owner[column], column, room)
            step = distance[nearest]
            for c in range(columns + 1):
                if reached[c]:
                    room.row_potential[owner[c]] += step
                    room.column_potential[c] -= step
                elif c < columns:
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


@kernel
def _extend(costs, row, column, room):  # type: ignore[no-untyped-def]
    """Shorten distances through `row`, the owner of `column`; return the nearest column not yet reached."""
    distance, reached = room.distance, room.reached
    nearest = -1
    for c in range(costs.shape[1]):
        if not reached[c]:
            reduced = costs[row, c] - room.row_potential[row] - room.column_potential[c]
            if reduced < distance[c]:
                distance[c] = reduced
                room.came_from[c] = column
            if nearest < 0 or distance[c] < distance[nearest]:
                nearest = c
    return nearest
