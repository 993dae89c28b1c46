"""The level of a dendrogram with the greatest modularity on the nearest-neighbour graph.

The graph: every clip is joined to its ceil(log2 N) nearest others, and an edge counts whichever end asked for
it. With A and B the neighbourhoods of its ends (a clip's own nearest others and the clip itself, not what the
union adds), an edge weighs |A and B| / |A or B|, as in PhenoGraph (Levine et al. 2015).

Modularity (Newman 2004, resolution 1), with W the total weight and s the weight at a clip:

    Q = sum over clusters of  inside / W - (sum of s / 2 W)^2

A merge of clusters I and J adds  between(I, J) / W - s_I s_J / (2 W^2), so one walk up the tree gives Q at
every level. Only edges of the smaller side are looked at: O(E log N).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.clustering.condensed import checked_distances, clip_count, row_start
from motionary.pipeline.clustering.cut import LevelScores, best_level, merge_heights


def modularity_cut(Z: NDArray[np.float64], distances_condensed: ArrayLike) -> LevelScores:
    """Choose the number of clusters by modularity.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.
    distances_condensed : array (N(N-1)/2,)
        The primary distance, of the same clips in the same order.

    Returns
    -------
    LevelScores
        The choice, and the modularity of every kappa from N-1 down to 2. Chosen among the levels that some
        threshold yields; ties to fewer clusters. Fewer than three clips, or all merges tied, give one
        cluster; three clips give two.

    Raises
    ------
    ValueError
        Z and the distances are of different numbers of clips, or a distance is not finite or is negative.
    """
    clips = len(merge_heights(Z)) + 1
    distances = checked_distances("distances_condensed", distances_condensed)
    if clip_count(distances) != clips:
        raise ValueError(f"Z is of {clips} clips, the distances of {clip_count(distances)}")
    kappa = np.arange(clips - 1, 1, -1)
    if not kappa.size:
        return best_level(Z, kappa, np.empty(0))
    graph = nearest_neighbour_graph(distances)
    return best_level(Z, kappa, _modularity_of_levels(Z, graph)[1:-1])


def nearest_neighbour_graph(distances_condensed: NDArray[np.floating]) -> list[dict[int, float]]:
    """Build the weighted graph of nearest neighbours.

    Parameters
    ----------
    distances_condensed : array (N(N-1)/2,)
        Finite distances of N >= 2 clips, read once from end to end. Of equally near clips the one of lower
        index comes first.

    Returns
    -------
    list of dict
        For every clip its neighbours and the weights of the edges; each edge stands at both ends.
    """
    clips = clip_count(distances_condensed)
    count = min(int(np.ceil(np.log2(clips))), clips - 1)
    nearest = _nearest(distances_condensed, clips, count).tolist()
    hoods = [{clip, *others} for clip, others in enumerate(nearest)]
    graph: list[dict[int, float]] = [{} for _ in range(clips)]
    for clip, others in enumerate(nearest):
        for other in others:
            weight = len(hoods[clip] & hoods[other]) / len(hoods[clip] | hoods[other])
            graph[clip][other] = graph[other][clip] = weight
    return graph


def _nearest(distances: NDArray[np.floating], clips: int, count: int) -> NDArray[np.int64]:
    """Return the `count` nearest others (N, count) of every clip, the nearest first."""
    from motionary.pipeline.clustering.condensed_kernels import take_row

    nearest = np.full((clips, count), -1)
    near = np.full((clips, count), np.inf)
    for clip in range(clips - 1):
        start = row_start(clip, clips)
        take_row(clip, distances[start : start + clips - clip - 1].astype(np.float64), nearest, near)
    return nearest


def _modularity_of_levels(Z: NDArray[np.float64], graph: list[dict[int, float]]) -> NDArray[np.float64]:
    """Return the modularity (N,) of kappa = N .. 1."""
    clips = len(graph)
    strength = [sum(edges.values()) for edges in graph]
    total = sum(strength) / 2
    members = [[clip] for clip in range(clips)]
    cluster = list(range(clips))
    node_cluster = list(range(clips))
    curve = [-sum((s / (2 * total)) ** 2 for s in strength)]
    for left, right in Z[:, :2].astype(int).tolist():
        moved, kept = sorted((node_cluster[left], node_cluster[right]), key=lambda c: len(members[c]))
        between = sum(
            weight
            for clip in members[moved]
            for other, weight in graph[clip].items()
            if cluster[other] == kept
        )
        curve.append(curve[-1] + between / total - strength[moved] * strength[kept] / (2 * total**2))
        for clip in members[moved]:
            cluster[clip] = kept
        members[kept] += members[moved]
        strength[kept] += strength[moved]
        node_cluster.append(kept)
    return np.array(curve)
