"""The compiled nearest-neighbour chain: see `motionary.pipeline.clustering.linkage`."""

from __future__ import annotations

import numpy as np
from numba import njit

from motionary.pipeline.clustering.linkage import MAX, MEAN, MIN


@njit(nogil=True, cache=True)
def nearest_neighbour_chain(values, rules, weights, clips):  # type: ignore[no-untyped-def]
    """Merge until one cluster is left; `values` (pairs, channels) is used up.

    A cluster lives in the slot of its last clip. Once half of the slots are empty, the others close up, in
    their order: what is walked through shrinks with the clusters, and no tie is decided otherwise.

    Returns the last clips of the two clusters of every merge (clips-1, 2), and its key.
    """
    merged = np.empty((clips - 1, 2), np.int64)
    heights = np.empty(clips - 1)
    size = np.ones(clips, np.int64)
    last = np.arange(clips)
    starts = _starts(clips)
    chain = np.empty(clips, np.int64)
    links = 0
    first = 0
    for step in range(clips - 1):
        if 2 * (clips - step) <= len(size):
            size, last, starts = _closed_up(values, size, last, starts, chain[:links])
            first = 0
        if links == 0:
            while size[first] == 0:
                first += 1
            chain[0] = first
            links = 1
        while True:
            tip = chain[links - 1]
            before = chain[links - 2] if links > 1 else -1
            nearest, least = _nearest(values, weights, size, starts, tip, before)
            if nearest == before:
                break
            chain[links] = nearest
            links += 1
        links -= 2
        gone, kept = min(tip, nearest), max(tip, nearest)
        merged[step, 0], merged[step, 1], heights[step] = last[gone], last[kept], least
        _merge(values, rules, size, starts, gone, kept)
    return merged, heights


@njit(nogil=True, cache=True)
def _starts(slots):  # type: ignore[no-untyped-def]
    """Return what is to be added to the second slot of a pair to get its place, for every first one."""
    starts = np.empty(slots, np.int64)
    for slot in range(slots):
        starts[slot] = slot * slots - slot * (slot + 1) // 2 - slot - 1
    return starts


@njit(nogil=True, cache=True)
def _nearest(values, weights, size, starts, tip, before):  # type: ignore[no-untyped-def]
    """Find the cluster nearest to the chain's tip, and its key; `before` is -1 where it is the only link."""
    nearest = before
    least = np.inf
    if before >= 0:
        # Starting from the last link lets it win ties, without which the chain could go round for ever.
        least = _key(values, weights, starts[min(tip, before)] + max(tip, before))
    for other in range(len(size)):
        if size[other] == 0 or other == tip:
            continue
        key = _key(values, weights, starts[min(tip, other)] + max(tip, other))
        if key < least or nearest < 0:
            least, nearest = key, other
    return nearest, least


@njit(nogil=True, cache=True)
def _merge(values, rules, size, starts, gone, kept):  # type: ignore[no-untyped-def]
    between = starts[gone] + kept
    for other in range(len(size)):
        if size[other] == 0 or other in (gone, kept):
            continue
        a = starts[min(gone, other)] + max(gone, other)
        b = starts[min(kept, other)] + max(kept, other)
        for channel in range(len(rules)):
            distances = (values[a, channel], values[b, channel], values[between, channel])
            sizes = (size[gone], size[kept], size[other])
            values[b, channel] = _updated(rules[channel], distances, sizes)
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
        key += weights[channel] * values[pair, channel]
    return key


@njit(nogil=True, cache=True)
def _closed_up(values, size, last, starts, chain):  # type: ignore[no-untyped-def]
    """Move the distances of the slots in use to the front of `values`, and renumber the chain."""
    used = np.flatnonzero(size)
    now = np.zeros(len(size), np.int64)
    place = 0
    for slot in range(len(used)):
        now[used[slot]] = slot
        for other in range(slot + 1, len(used)):
            values[place] = values[starts[used[slot]] + used[other]]
            place += 1
    for link in range(len(chain)):
        chain[link] = now[chain[link]]
    return size[used], last[used], _starts(len(used))
