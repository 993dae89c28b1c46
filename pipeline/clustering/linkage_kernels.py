"""The compiled nearest-neighbour chain: see `motionary.pipeline.clustering.linkage`."""

from __future__ import annotations

import numpy as np
from numba import njit

from motionary.pipeline.clustering.linkage import MAX, MEAN, MIN


@njit(nogil=True, cache=True)
def nearest_neighbour_chain(values, rules, weights, clips):  # type: ignore[no-untyped-def]
    """Merge until one cluster is left; `values` (channels, pairs) is used up.

    A cluster lives in the slot of its last clip. Returns the slots of every merge (clips-1, 2) and its key.
    """
    merged = np.empty((clips - 1, 2), np.int64)
    heights = np.empty(clips - 1)
    size = np.ones(clips, np.int64)
    chain = np.empty(clips, np.int64)
    links = 0
    first = 0
    for step in range(clips - 1):
        if links == 0:
            while size[first] == 0:
                first += 1
            chain[0] = first
            links = 1
        while True:
            tip = chain[links - 1]
            # Starting from the last link lets it win ties, without which the chain could go round for ever.
            nearest = chain[links - 2] if links > 1 else -1
            least = _key(values, weights, _pair(clips, tip, nearest)) if links > 1 else np.inf
            for other in range(clips):
                if size[other] == 0 or other == tip:
                    continue
                key = _key(values, weights, _pair(clips, tip, other))
                if key < least or nearest < 0:
                    least, nearest = key, other
            if links > 1 and nearest == chain[links - 2]:
                break
            chain[links] = nearest
            links += 1
        links -= 2
        gone, kept = min(tip, nearest), max(tip, nearest)
        merged[step, 0], merged[step, 1], heights[step] = gone, kept, least
        _merge(values, rules, size, gone, kept)
    return merged, heights


@njit(nogil=True, cache=True)
def _merge(values, rules, size, gone, kept):  # type: ignore[no-untyped-def]
    clips = len(size)
    between = _pair(clips, gone, kept)
    for other in range(clips):
        if size[other] == 0 or other in (gone, kept):
            continue
        a, b = _pair(clips, gone, other), _pair(clips, kept, other)
        for channel in range(len(rules)):
            row = values[channel]
            distances = (row[a], row[b], row[between])
            row[b] = _updated(rules[channel], distances, (size[gone], size[kept], size[other]))
    size[kept] += size[gone]
    size[gone] = 0


@njit(nogil=True, cache=True)
def _updated(rule, distances, sizes):  # type: ignore[no-untyped-def]
    a, b, between = distances
    size_a, size_b, size_other = sizes
    if rule == MIN:
        return min(a, b)
    if rule == MAX:
        return max(a, b)
    if rule == MEAN:
        updated = (size_a * a + size_b * b) / (size_a + size_b)
    else:
        total = size_a + size_b + size_other
        updated = ((size_a + size_other) * a + (size_b + size_other) * b - size_other * between) / total
    # Reducible in exact arithmetic; rounding may not undo it, or a merge could sort before its own parts.
    return max(updated, min(a, b))


@njit(nogil=True, cache=True)
def _key(values, weights, pair):  # type: ignore[no-untyped-def]
    key = 0.0
    for channel in range(len(weights)):
        key += weights[channel] * values[channel, pair]
    return key


@njit(nogil=True, cache=True)
def _pair(clips, i, j):  # type: ignore[no-untyped-def]
    low, high = min(i, j), max(i, j)
    return low * clips - low * (low + 1) // 2 + high - low - 1
