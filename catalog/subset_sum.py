"""How many groups of each size together come nearest to a number: a bounded knapsack, solved exactly.

Groups of one size are alike here, so the work grows with the number of different sizes, which is at most the
square root of twice the number of clips, and not with the number of groups.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

_NEVER = np.iinfo(np.int64).max // 2


def nearest_counts(
    available: Mapping[int, int], liked: Mapping[int, int], target: float, spare: int
) -> dict[int, int]:
    """Choose how many groups of each size are taken, so that their clips come nearest to a number.

    Parameters
    ----------
    available, liked : mapping of int to int
        How many groups of a size there are, and would like to be taken.
    target : float
        The number of clips.
    spare : int
        How many groups must be left, beside the at least one that is taken.

    Returns
    -------
    dict of int to int
        By size. Of choices as near as can be, one of those that differ from `liked` in the fewest clips.

    Notes
    -----
    `costs[s, n]` is the least number of clips that are not as liked where n are taken and s groups, or
    `spare` and more, left. A size's number is tried only so far from the liked one: a best choice that went
    further would have another size go the other way by as much, and exchanging as many clips of the two would
    cost less.
    """
    total = sum(size * count for size, count in available.items())
    liked_total = sum(size * liked.get(size, 0) for size in available)
    reach = math.ceil(max(available) * (len(available) + spare + 1) + abs(target - liked_total))
    costs = np.full((spare + 1, total + 1), _NEVER)
    costs[0, 0] = 0
    steps: list[tuple[int, np.ndarray, np.ndarray]] = []
    for size, count in sorted(available.items()):
        like = liked.get(size, 0)
        found = np.full_like(costs, _NEVER)
        taken, before = np.zeros(costs.shape, np.int32), np.zeros(costs.shape, np.int8)
        for take in range(max(0, like - reach), min(count, like + reach) + 1):
            for was in range(spare + 1):
                now = min(spare, was + count - take)
                cost = costs[was, : total + 1 - size * take] + size * abs(take - like)
                here = (now, slice(size * take, None))
                better = cost < found[here]
                found[here][better] = cost[better]
                taken[here][better], before[here][better] = take, was
        costs = found
        steps.append((size, taken, before))
    possible = np.flatnonzero(costs[spare] < _NEVER)
    possible = possible[possible > 0]
    away = np.abs(possible - target)
    nearest = possible[away == away.min()]
    clips, left = int(nearest[np.argmin(costs[spare, nearest])]), spare
    counts = {}
    for size, taken, before in reversed(steps):
        counts[size] = int(taken[left, clips])
        clips, left = clips - size * counts[size], int(before[left, clips])
    return counts
