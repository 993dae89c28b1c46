"""Slow, obvious references for the distances; they share no code with the product.

Costs are float64 throughout. Totals of small whole numbers are exact, and so are their ties.
"""

from decimal import Decimal, localcontext
from itertools import combinations, pairwise

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, linear_sum_assignment, milp

THRESHOLDS = (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0)


def paths(m, n):
    """Every warping path of an (m, n) matrix, as lists of cells."""
    if (m, n) == (1, 1):
        return [[(0, 0)]]
    before = [(m - 1, n - 1), (m - 1, n), (m, n - 1)]
    return [path + [(m - 1, n - 1)] for i, j in before if i > 0 and j > 0 for path in paths(i, j)]


def dtw_by_enumeration(cost):
    """(total, cells) of the best path, by looking at every path."""
    return min((sum(cost[i][j] for i, j in path), len(path)) for path in paths(*np.shape(cost)))


def dtw_keys(cost):
    """(total, cells) of the best path to every cell, by dynamic programming over pairs."""
    best = {}
    for i, row in enumerate(np.asarray(cost, dtype=np.float64).tolist()):
        for j, value in enumerate(row):
            total, cells = min((best[p] for p in before(i, j) if p in best), default=(0.0, 0))
            best[i, j] = (total + value, cells + 1)
    return best


def before(i, j):
    """Where a path may come from, in the order in which a tie is decided."""
    return (i - 1, j - 1), (i - 1, j), (i, j - 1)


def dtw_key(cost):
    m, n = np.shape(cost)
    return dtw_keys(cost)[m - 1, n - 1]


def dtw_path(cost):
    """The best path that, from its end, steps back in both clips where it can, else in the first."""
    best, path = dtw_keys(cost), [(np.shape(cost)[0] - 1, np.shape(cost)[1] - 1)]
    while path[0] != (0, 0):
        path.insert(0, min((p for p in before(*path[0]) if p in best), key=best.get))
    return path


def dtw(cost):
    total, cells = dtw_key(cost)
    return total / cells


def b_dtw(cost):
    return min(dtw(cost), dtw(np.asarray(cost)[:, ::-1]))


def zones(cost, threshold):
    """Bounding rectangles of the 8-connected regions, by flood fill."""
    cost = np.asarray(cost, dtype=np.float64)
    low, high = cost.min(), cost.max()
    delta = high if threshold == 1 else low + threshold * (high - low)
    left = {(int(i), int(j)) for i, j in np.argwhere(cost <= delta)}
    found = []
    while left:
        region, front = set(), [left.pop()]
        while front:
            i, j = front.pop()
            region.add((i, j))
            touching = {(i + p, j + q) for p in (-1, 0, 1) for q in (-1, 0, 1)} & left
            left -= touching
            front.extend(touching)
        rows, columns = zip(*region, strict=True)
        found.append((min(rows), max(rows), min(columns), max(columns)))
    return sorted(found)


def segments(intervals):
    """Index of each interval's segment: intervals with a common frame belong together, transitively."""
    group = list(range(len(intervals)))
    for a, b in combinations(range(len(intervals)), 2):
        (first, last), (start, end) = intervals[a], intervals[b]
        if first <= end and start <= last and group[a] != group[b]:
            group = [group[a] if g == group[b] else g for g in group]
    return group


def cover_by_enumeration(edges):
    """Least weight of edges (u, v, weight) that touch every u and every v, by looking at every subset."""
    nodes = {("row", u) for u, _, _ in edges} | {("column", v) for _, v, _ in edges}
    best = float("inf")
    for size in range(1, len(edges) + 1):
        for chosen in combinations(edges, size):
            if {("row", u) for u, _, _ in chosen} | {("column", v) for _, v, _ in chosen} == nodes:
                best = min(best, sum(w for _, _, w in chosen))
    return best


def cover_by_integer_programme(edges):
    """The same as an integer programme: each node is touched at least once."""
    nodes = sorted({("row", u) for u, _, _ in edges} | {("column", v) for _, v, _ in edges})
    touches = np.array(
        [[node in (("row", u), ("column", v)) for u, v, _ in edges] for node in nodes], dtype=float
    )
    weights = np.array([w for _, _, w in edges], dtype=float)
    solution = milp(
        weights / max(weights.max(), 1e-300),  # the solver's tolerances are absolute
        constraints=LinearConstraint(touches, lb=1),
        integrality=np.ones(len(edges)),
        bounds=Bounds(0, 1),
        options={"mip_rel_gap": 0},
    )
    assert solution.success
    return sum(w for chosen, (_, _, w) in zip(solution.x, edges, strict=True) if chosen > 0.5)


def cover_by_assignment(edges):
    """The same as an assignment: every node has a copy on the other side, its mate at its cheapest edge."""
    rows, columns = (sorted({edge[side] for edge in edges}) for side in (0, 1))
    size = len(rows) + len(columns)
    costs = np.full((size, size), np.inf)
    for u, v, weight in edges:
        r, c = rows.index(u), columns.index(v)
        for place in ((r, c), (r, len(columns) + r), (len(rows) + c, c)):
            costs[place] = min(costs[place], weight)
    costs[len(rows) :, len(columns) :] = 0
    return costs[linear_sum_assignment(costs)].sum()


def segment_edges(cost, threshold):
    """The zones as edges (row segment, column segment, B-DTW)."""
    cost = np.asarray(cost)
    found = zones(cost, threshold)
    rows, columns = segments([z[:2] for z in found]), segments([z[2:] for z in found])
    weights = [b_dtw(cost[top : bottom + 1, left : right + 1]) for top, bottom, left, right in found]
    return list(zip(rows, columns, weights, strict=True))


def segment_dtw(cost, threshold):
    edges = segment_edges(cost, threshold)
    return cover_by_enumeration(edges) if len(edges) <= 8 else cover_by_integer_programme(edges)


def curve(cost, thresholds=THRESHOLDS):
    return [segment_dtw(cost, threshold) for threshold in thresholds]


def weighted(values, thresholds=THRESHOLDS):
    total = 0.0
    for value, x in zip(values, thresholds, strict=True):
        if 0.3 < x < 1:
            total += 0.1 * np.exp(-((x - 0.7) ** 2) / (2 * 0.3**2)) / (0.3 * np.sqrt(2 * np.pi)) * value
    return total


def distance(f, g):
    """Euclidean distance of two frames of floats to 60 digits."""
    with localcontext() as context:
        context.prec = 60
        return sum(
            ((Decimal(float(x)) - Decimal(float(y))) ** 2 for x, y in zip(f, g, strict=True)), Decimal(0)
        ).sqrt()


def euclidean(a, b):
    return np.array([[float(distance(f, g)) for g in b] for f in a])


def is_path(path, m, n):
    """Whether the cells lead from corner to corner by the three steps."""
    steps = {(p - i, q - j) for (i, j), (p, q) in pairwise(path)}
    return path[0] == (0, 0) and path[-1] == (m - 1, n - 1) and steps <= {(1, 1), (1, 0), (0, 1)}
