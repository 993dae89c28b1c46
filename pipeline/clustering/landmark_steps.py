"""The steps of clustering by landmarks, on arrays alone: see `motionary.pipeline.clustering.landmarks`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.clustering.choice import Cut, choose_cut
from motionary.pipeline.clustering.primary import linkage_of, merge_key, threshold_on_part
from motionary.pipeline.config import ClusterConfig

Places = NDArray[np.intp]
Groups = NDArray[np.int64]

REPRESENTATIVES = 4
LEAST_LANDMARKS = 1000


class Standing(NamedTuple):
    """The R landmarks that stand for groups: their places among the landmarks, and each one's group."""

    places: Places
    group_of: Groups


def landmark_count(clips: int) -> int:
    """Return how many landmarks are taken of so many clips: 20 sqrt(N), a thousand at least."""
    return min(clips, max(LEAST_LANDMARKS, ceil(20 * sqrt(clips))))


def sample_clips(keys: Sequence[str], count: int) -> Places:
    """Choose landmarks by their contents, so that most stay when clips are added, removed or renamed.

    Parameters
    ----------
    keys : sequence of str (N,)
        A text for the contents of every clip.
    count : int
        n; of N or more all clips are taken.

    Returns
    -------
    array (min(n, N),)
        Places of the clips whose keys have the least SHA-256, ascending. A clip that is added replaces one
        at most.

    Raises
    ------
    ValueError
        There is no clip, or `count` is less than 1.
    """
    if count < 1 or not len(keys):
        raise ValueError(f"{count} landmarks of {len(keys)} clips; there must be at least one of each")
    hashes = [sha256(key.encode()).digest() for key in keys]
    order = sorted(range(len(keys)), key=lambda place: (hashes[place], place))
    return np.sort(np.array(order[:count], dtype=np.intp))


def cut_landmarks(
    channels: NDArray[np.floating],
    config: ClusterConfig,
    share: float,
    labels: Sequence[str | None] | None = None,
) -> Cut:
    """Cluster the landmarks exactly.

    Parameters
    ----------
    channels : array (channels, n(n-1)/2)
        Their distances, condensed: one, or fuzzy linkage's low and high.
    config : ClusterConfig
        A threshold in it is one on all clips.
    share : float
        n / N.
    labels : sequence of str or None, optional
        Of the landmarks.

    Returns
    -------
    Cut
        As `choose_cut` makes it.
    """
    if config.threshold is not None:
        config = replace(config, threshold=threshold_on_part(config, config.threshold, share))
    return choose_cut(linkage_of(channels, config), merge_key(channels, config), config, labels)


def standing_for(key: NDArray[np.floating], groups: Groups, count: int = REPRESENTATIVES) -> Standing:
    """Choose the landmarks that stand for every group: its medoid, then the furthest from those.

    Parameters
    ----------
    key : array (n, n)
        Distances of the landmarks as one number.
    groups : array (n,)
        Their groups, 0, 1, ..
    count : int
        Of a group at most so many; fewer where all others are copies of those chosen. Ties go to the lowest.

    Returns
    -------
    Standing
    """
    places, group_of = [], []
    for group in range(groups.max() + 1):
        members = np.flatnonzero(groups == group)
        square = key[np.ix_(members, members)]
        chosen = [int(np.argmin(square.sum(axis=1, dtype=np.float64)))]
        near = square[chosen[0]]
        while len(chosen) < count and near.max() > 0:
            chosen.append(int(np.argmax(near)))
            near = np.minimum(near, square[chosen[-1]])
        places.append(members[chosen])
        group_of.append(np.full(len(chosen), group))
    return Standing(np.concatenate(places), np.concatenate(group_of))


def nearest_group(distances: NDArray[np.floating], group_of: Groups) -> Groups:
    """Assign clips to the groups of the representatives that are nearest to them.

    Parameters
    ----------
    distances : array (clips, R)
        From every clip to every representative, as one number.
    group_of : array (R,)
        The group that each stands for.

    Returns
    -------
    array (clips,)
        Of equally near representatives the first counts.
    """
    return group_of[np.argmin(distances, axis=1)]
