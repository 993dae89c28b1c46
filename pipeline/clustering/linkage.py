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

Memory: a condensed working copy. Least and greatest distances of float32 ones are float32 themselves, so
complete linkage takes 2 N^2 bytes of them (50 MB at N = 5000) and fuzzy linkage 4 N^2; ward and average take
4 N^2, and all of float64 distances twice as much. The caller's arrays are left as they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.clustering.condensed import blocks, checked_distances, clip_count, clips_of
from motionary.pipeline.clustering.mapped import NewArray

MIN, MAX, MEAN, WARD = range(4)
"""How a channel's distances to a merged cluster follow from those to its parts."""


def complete_linkage(condensed: ArrayLike, new_array: NewArray = np.empty) -> NDArray[np.float64]:
    """Merge the clusters whose furthest clips are nearest: equation 9 of [DC 5].

    Parameters
    ----------
    condensed : array (N(N-1)/2,)
        Distances in scipy's squareform order, finite and not negative. None at all means one clip.
    new_array : callable
        Makes the working copy: `numpy.empty`, or `mapped_array` where it may not fit into memory.

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
    return _link([checked_distances("condensed", condensed)], (MAX,), (1.0,), new_array)


def average_linkage(condensed: ArrayLike, new_array: NewArray = np.empty) -> NDArray[np.float64]:
    """Merge the clusters whose clips are nearest on average (UPGMA).

    Parameters, returned matrix and errors are those of `complete_linkage`.
    """
    return _link([checked_distances("condensed", condensed)], (MEAN,), (1.0,), new_array)


def ward_linkage(condensed: ArrayLike, new_array: NewArray = np.empty) -> NDArray[np.float64]:
    """Merge the clusters that least raise the mean distance inside clusters: Ward's method on square roots.

    The distance takes the place of a squared length, so the result is that of
    `scipy.cluster.hierarchy.linkage(np.sqrt(condensed), "ward")`. The rival convention, Ward on the distance
    itself, would square it.

    Parameters
    ----------
    condensed, new_array
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
    merges = _link([checked_distances("condensed", condensed)], (WARD,), (1.0,), new_array)
    merges[:, 2] = np.sqrt(merges[:, 2])
    return merges


LINKAGES = {"complete": complete_linkage, "ward": ward_linkage, "average": average_linkage}
"""Those that read one distance a pair."""


def fuzzy_linkage(
    low: ArrayLike, high: ArrayLike, tau: float = 0.5, new_array: NewArray = np.empty
) -> NDArray[np.float64]:
    """Merge by interval distances: equation 11 of [DC 5].

    Two clusters lie [c, d] apart: c the least low, d the greatest high among their pairs of clips. The merge
    key, and the height, is c + tau (d - c).

    Parameters
    ----------
    low, high : array (N(N-1)/2,)
        Ends of every pair's interval (equation 10), in scipy's squareform order.
    tau : float
        0 is single linkage on `low`, 1 complete linkage on `high`; .5 in the paper.
    new_array : callable
        As for `complete_linkage`.

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
    for block in blocks(len(lows)):
        wrong = lows[block] > highs[block]
        if wrong.any():
            pair = block.start + int(np.argmax(wrong))
            raise ValueError(
                f"the interval of {clips_of(pair, clip_count(lows))} is [{lows[pair]}, {highs[pair]}]; "
                "low must not exceed high"
            )
    return _link([lows, highs], (MIN, MAX), (1 - tau, tau), new_array)


def _link(
    channels: list[NDArray[np.floating]],
    rules: tuple[int, ...],
    weights: tuple[float, ...],
    new_array: NewArray,
) -> NDArray[np.float64]:
    from motionary.pipeline.clustering.linkage_kernels import nearest_neighbour_chain

    clips = clip_count(channels[0])
    if clips == 1:
        return np.empty((0, 4))
    exact = np.result_type(*channels) if {MIN, MAX}.issuperset(rules) else np.float64
    values = new_array((len(channels[0]), len(channels)), exact)
    for place, channel in enumerate(channels):
        values[:, place] = channel
    merged, heights = nearest_neighbour_chain(values, np.array(rules), np.array(weights), clips)
    order = np.argsort(heights, kind="stable")
    return relabelled(merged[order], heights[order], clips)


def relabelled(merged: NDArray[np.int64], heights: NDArray[np.float64], clips: int) -> NDArray[np.float64]:
    """Turn merges (M, 2), each named by a clip of either side, sorted by height, into SciPy's nodes."""
    above = np.arange(clips + len(merged))
    size = np.ones(clips + len(merged))
    linkage = np.empty((len(merged), 4))
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
