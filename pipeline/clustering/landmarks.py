"""Clusters of a library too large for all its pairs, by landmarks: an approximation of what all pairs give.

    1. sample      n landmarks of the N clips, those of the least hashes of their contents
    2. cluster     every pair of landmarks; the primary linkage, cut as it would be cut on all clips
    3. represent   each cluster by its medoid and up to three others, each the furthest from those before
    4. assign      every other clip to the cluster of the representative that is nearest to it
    5. refine      every pair of clips inside a cluster; the same linkage, undone above the same threshold

What a refined cluster falls into are clusters of their own: so a class that the sample missed is found. A
cluster of more than n clips is refined by these steps again, on n landmarks of its own. That takes n^2 / 2
pairs, N times the representatives, and about n / 2 for every clip, more where clusters are refined again:
O(N^1.5) where n goes with the square root of N, as it does unless told otherwise.

Heights of complete, average and fuzzy linkage are distances of clips, so a part of a library is cut where all
of it would be. Those of Ward's grow with the clips: of clusters s times as large by sqrt(s). A threshold mu
on N clips is mu sqrt(share) on a share of them.

How far that is from what all pairs give is told by `motionary reproduce landmarks`. The most of it is the
cut: without labels, modularity finds fewer clusters among fewer clips. The rivals lost there and in trials
beside it: one representative instead of four, and the similarity index's reference instead of the medoid;
eight, all landmarks, or the linkage's own distance from a clip to a cluster, which cost more for nothing;
to assign all clips once more after refining, which takes them away from the exact clusters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isinf

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.clustering.choice import Cut
from motionary.pipeline.clustering.cut import cut_tree, numbered
from motionary.pipeline.clustering.landmark_steps import (
    REPRESENTATIVES,
    Groups,
    Places,
    Standing,
    cut_landmarks,
    landmark_count,
    nearest_group,
    sample_clips,
    standing_for,
)
from motionary.pipeline.clustering.primary import (
    condensed_channels,
    linkage_of,
    merge_key,
    threshold_on_all,
    threshold_on_part,
)
from motionary.pipeline.config import ClusterConfig

Distance = Callable[[Places, Places], NDArray[np.floating]]
"""Given the places of a and of b clips, an array (channels, a, b), see `primary.py`."""


@dataclass(frozen=True, eq=False)
class LandmarkClusters:
    """What the approximate route made of N clips.

    Parameters
    ----------
    sample : array (n,)
        Places of the landmarks, ascending.
    cut : Cut
        Of the landmarks' dendrogram; its threshold is in the landmarks' heights.
    threshold : float
        The same in the heights of all clips; infinite where nothing is undone, see `threshold_on_all`.
    representatives : array (R,)
        Places of the landmarks that stand for the clusters.
    assigned : array (N,)
        Group of every clip, before refinement: a landmark's cluster, or that of the nearest representative.
    labels : array (N,)
        Cluster of every clip, 0 .. kappa-1, by decreasing size and then by lowest member.
    """

    sample: Places
    cut: Cut
    threshold: float
    representatives: Places
    assigned: Groups
    labels: Groups


def cluster_by_landmarks(
    keys: Sequence[str],
    distance: Distance,
    config: ClusterConfig,
    labels: Sequence[str | None] | None = None,
    landmarks: int | None = None,
    representatives: int = REPRESENTATIVES,
) -> LandmarkClusters:
    """Cluster N clips without comparing all of them.

    Parameters
    ----------
    keys : sequence of str (N,)
        A text for the contents of every clip, such as its key. Clips of one key are told apart by place.
    distance : callable
        Asked for the distances of clips, given by their places.
    config : ClusterConfig
        Linkage and cut.
    labels : sequence of str or None, optional
        Label of every clip; those of the landmarks may choose the cut. None hides them.
    landmarks : int, optional
        n; by default `landmark_count`. Of N or more the result is the exact one.
    representatives : int
        Of a cluster, at most.

    Returns
    -------
    LandmarkClusters
        Where a number of clusters was asked for, nothing is refined, for that would make more.

    Raises
    ------
    ValueError
        There is no clip, a number is less than 1, or as for `choose_cut`.
    """
    clips = len(keys)
    sample = sample_clips(keys, landmark_count(clips) if landmarks is None else landmarks)
    share = len(sample) / clips
    own_labels = None if labels is None else [labels[place] for place in sample]
    square = distance(sample, sample)
    cut = cut_landmarks(condensed_channels(square), config, share, own_labels)
    threshold = threshold_on_all(config, cut.n_clusters, cut.threshold, share)
    standing = standing_for(merge_key(square, config), cut.labels, representatives)
    assigned = _spread(sample, cut.labels, standing, clips, distance, config)

    def refined(members: Places) -> Groups:
        contents = [keys[place] for place in members]
        return refine(contents, _among(distance, members), config, threshold, len(sample), representatives)

    final = len(sample) == clips or isinf(threshold)
    groups = numbered(assigned) if final else _parted(assigned, refined)
    return LandmarkClusters(sample, cut, threshold, sample[standing.places], assigned, groups)


def refine(
    keys: Sequence[str],
    distance: Distance,
    config: ClusterConfig,
    threshold: float,
    most: int,
    representatives: int = REPRESENTATIVES,
) -> Groups:
    """Part the clips of one cluster as far as its own dendrogram does, at the threshold of the whole library.

    Parameters
    ----------
    keys : sequence of str (m,)
        As for `sample_clips`, of the cluster's clips.
    distance : callable
        Of places in the cluster.
    config : ClusterConfig
        The linkage.
    threshold : float
        mu on all clips.
    most : int
        Clips whose pairs are all compared; a larger cluster is parted on so many landmarks, the others are
        assigned, and each part is refined in turn.
    representatives : int
        Of a part, at most.

    Returns
    -------
    array (m,)
        Groups, as `numbered` numbers them; all 0 where the cluster holds together.
    """
    clips = len(keys)
    sample = sample_clips(keys, most)
    square = distance(sample, sample)
    mu = threshold_on_part(config, threshold, len(sample) / clips)
    parts = cut_tree(linkage_of(condensed_channels(square), config), threshold=mu)
    if len(sample) == clips:
        return parts
    if not parts.any():
        return np.zeros(clips, np.int64)
    standing = standing_for(merge_key(square, config), parts, representatives)
    assigned = _spread(sample, parts, standing, clips, distance, config)

    def refined(members: Places) -> Groups:
        contents = [keys[place] for place in members]
        return refine(contents, _among(distance, members), config, threshold, most, representatives)

    return _parted(assigned, refined)


def _spread(
    sample: Places, groups: Groups, standing: Standing, clips: int, distance: Distance, config: ClusterConfig
) -> Groups:
    """Give all `clips` clips a group: a landmark its own, any other that of the nearest representative."""
    spread = np.empty(clips, np.int64)
    spread[sample] = groups
    others = np.setdiff1d(np.arange(clips), sample)
    if len(others):
        to_standing = merge_key(distance(others, sample[standing.places]), config)
        spread[others] = nearest_group(to_standing, standing.group_of)
    return spread


def _parted(groups: Groups, part: Callable[[Places], Groups]) -> Groups:
    """Part every group; `part` takes the places of its members and returns what they fall into, 0, 1, .."""
    parted = np.empty_like(groups)
    for group in range(groups.max() + 1):
        members = np.flatnonzero(groups == group)
        inside = part(members)
        _, lowest = np.unique(inside, return_index=True)
        parted[members] = members[lowest[inside]]
    return numbered(parted)


def _among(distance: Distance, members: Places) -> Distance:
    return lambda rows, columns: distance(members[rows], members[columns])
