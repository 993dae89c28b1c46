"""Agglomerative clustering of N clips by a nearest-neighbour chain [DC 5].

Every method starts with N clusters of one clip and keeps merging the two of least key. The distance of a new
cluster I+J to another cluster K follows from the three distances among them (Lance and Williams 1967):

    complete   max(d_IK, d_JK)                                                                 eq. 9
    average    (|I| d_IK + |J| d_JK) / (|I| + |J|)
    ward       ((|I|+|K|) d_IK + (|J|+|K|) d_JK - |K| d_IJ) / (|I|+|J|+|K|), d the squared length
    fuzzy      [min(c_IK, c_JK), max(d_IK, d_JK)], with the key (1-tau) c + tau d              eq. 11

So a method is one or two channels of distances, a rule for each, and the weights that mix them into the key;
the recurrence below is written once. All four are reducible: no merge brings two clusters nearer than the
nearer of its parts was. The chain of nearest neighbours (Benzecri 1982; Muellner 2011) therefore finds the
merges of the greedy procedure in O(N^2) time, in another order; sorting by height restores theirs.

Deviations from the paper: the key is c + tau (d - c) written as a convex sum, which rounding cannot make
non-monotone, and which is single linkage at tau = 0 and complete linkage at tau = 1 to the bit. Where merges
tie, dendrograms are not unique: here the lowest index wins, save that the chain's last link comes first.

Memory: a condensed float64 working copy, 4 N^2 bytes (100 MB at N = 5000); twice that for fuzzy linkage. The
caller's arrays are left as they are.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.clustering.condensed import checked_distances, clip_count, clips_of

_MIN, _MAX, _MEAN, _WARD = range(4)


def complete_linkage(condensed: ArrayLike) -> NDArray[np.float64]:
    """Merge the clusters whose furthest clips are nearest: equation 9 of [DC 5].

    Parameters
    ----------
    condensed : array (N(N-1)/2,)
        Distances in scipy's squareform order, finite and not negative. None at all means one clip.

    Returns
    -------
    array (N-1, 4)
        SciPy linkage matrix: the two nodes of each merge, its height in the distance's unit, its number of
        clips.

    Raises
    ------
    ValueError
        The length is not that of a condensed matrix, or a distance is not finite or is negative.
    """
    return _link([checked_distances("condensed", condensed)], (_MAX,), (1.0,))


def average_linkage(condensed: ArrayLike) -> NDArray[np.float64]:
    """Merge the clusters whose clips are nearest on average (UPGMA).

    Parameters, returned matrix and errors are those of `complete_linkage`.
    """
    return _link([checked_distances("condensed", condensed)], (_MEAN,), (1.0,))


def ward_linkage(condensed: ArrayLike) -> NDArray[np.float64]:
    """Merge the clusters that least raise the mean distance inside clusters: Ward's method on square roots.

    The distance takes the place of a squared length, so the result is that of
    `scipy.cluster.hierarchy.linkage(np.sqrt(condensed), "ward")`. The rival convention, Ward on the distance
    itself, would square it.

    Parameters
    ----------
    condensed : array (N(N-1)/2,)
        As for `complete_linkage`.

    Returns
    -------
    array (N-1, 4)
        SciPy linkage matrix; heights are SciPy's, in the square root of the distance's unit.

    Raises
    ------
    ValueError
        As for `complete_linkage`.
    """
    merges = _link([checked_distances("condensed", condensed)], (_WARD,), (1.0,))
    merges[:, 2] = np.sqrt(merges[:, 2])
    return merges


def fuzzy_linkage(low: ArrayLike, high: ArrayLike, tau: float = 0.5) -> NDArray[np.float64]:
    """Merge by interval distances: equation 11 of [DC 5].

    Two clusters lie [c, d] apart: c the least low, d the greatest high among their pairs of clips. The merge
    key, and the height, is c + tau (d - c).

    Parameters
    ----------
    low, high : array (N(N-1)/2,)
        Ends of every pair's interval (equation 10), in scipy's squareform order.
    tau : float
        0 is single linkage on `low`, 1 complete linkage on `high`; .5 in the paper.

    Returns
    -------
    array (N-1, 4)
        SciPy linkage matrix, heights in the distance's unit.

    Raises
    ------
    ValueError
        As for `complete_linkage`; or lengths differ, a low exceeds its high, or tau is outside 0 .. 1.
    """
    lows, highs = checked_distances("low", low), checked_distances("high", high)
    if len(lows) != len(highs):
        raise ValueError(f"low holds {len(lows)} pairs and high {len(highs)}; they must be of the same clips")
    if not 0 <= tau <= 1:
        raise ValueError(f"tau is {tau}; it must lie in 0 .. 1")
    if (lows > highs).any():
        pair = int(np.argmax(lows > highs))
        raise ValueError(
            f"the interval of {clips_of(pair, clip_count(lows))} is [{lows[pair]}, {highs[pair]}]; "
            "low must not exceed high"
        )
    return _link([lows, highs], (_MIN, _MAX), (1 - tau, tau))


def _link(
    channels: list[NDArray[np.float64]], rules: tuple[int, ...], weights: tuple[float, ...]
) -> NDArray[np.float64]:
    clips = clip_count(channels[0])
    if clips == 1:
        return np.empty((0, 4))
    merged, heights = _nearest_neighbour_chain(np.stack(channels), np.array(rules), np.array(weights), clips)
    order = np.argsort(heights, kind="stable")
    return _relabelled(merged[order], heights[order])


def _relabelled(merged: NDArray[np.int64], heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn merges named by a clip of either side, sorted by height, into SciPy's numbered nodes."""
    clips = len(merged) + 1
    above = np.arange(2 * clips - 1)
    size = np.ones(2 * clips - 1)
    linkage = np.empty((clips - 1, 4))
    for row, pair in enumerate(merged):
        nodes = sorted(_top(above, clip) for clip in pair)
        above[nodes] = clips + row
        size[clips + row] = size[nodes].sum()
        linkage[row] = *nodes, heights[row], size[clips + row]
    return linkage


def _top(above: NDArray[np.int64], node: int) -> int:
    while above[node] != node:
        above[node] = above[above[node]]
        node = above[node]
    return int(node)


@njit(nogil=True, cache=True)
def _nearest_neighbour_chain(values, rules, weights, clips):  # type: ignore[no-untyped-def]
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
    if rule == _MIN:
        return min(a, b)
    if rule == _MAX:
        return max(a, b)
    if rule == _MEAN:
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
