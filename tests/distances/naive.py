"""Slow, obvious references for the distances; they share no code with the product.

Costs are float64 throughout. Totals of small whole numbers are exact, and so are their ties.
"""

from itertools import combinations

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

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


def dtw_key(cost):
    """(total, cells) of the best path, by dynamic programming over pairs."""
    m, n = np.shape(cost)
    best = {(0, 0): (float(cost[0][0]), 1)}
    for i in range(m):
        for j in range(n):
            if (i, j) != (0, 0):
                options = [best[p] for p in ((i - 1, j - 1), (i - 1, j), (i, j - 1)) if p in best]
                total, cells = min(options)
                best[i, j] = (total + float(cost[i][j]), cells + 1)
    return best[m - 1, n - 1]


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
        if set(range(intervals[a][0], intervals[a][1] + 1)) & set(
            range(intervals[b][0], intervals[b][1] + 1)
        ):
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


def euclidean(a, b):
    return np.array(
        [[np.sqrt(sum((float(x) - float(y)) ** 2 for x, y in zip(f, g, strict=True))) for g in b] for f in a]
    )
