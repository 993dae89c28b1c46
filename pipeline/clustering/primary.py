"""The primary linkage, whichever it is, on channels of distances: one, or fuzzy linkage's low and high.

Heights of complete, average and fuzzy linkage are distances of clips, so a part of a library is cut where all
of it would be. Those of Ward's grow with the clips: of clusters s times as large by sqrt(s), so mu on N clips
is mu sqrt(share) on a share of them.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.pipeline.clustering.linkage import LINKAGES, fuzzy_linkage
from motionary.pipeline.config import ClusterConfig


def linkage_of(channels: NDArray[np.floating], config: ClusterConfig) -> NDArray[np.float64]:
    """Link clips by the primary method.

    Parameters
    ----------
    channels : array (channels, m(m-1)/2)
        Condensed.
    config : ClusterConfig
        `primary` and `fuzzy_tau` are read.

    Returns
    -------
    array (m-1, 4)
        SciPy linkage matrix.
    """
    if config.primary == "fuzzy":
        low, high = channels
        return fuzzy_linkage(low, high, tau=config.fuzzy_tau)
    return LINKAGES[config.primary](channels[0])


def merge_key(channels: NDArray[np.floating], config: ClusterConfig) -> NDArray[np.floating]:
    """Return what clips are ranked by: the distance, or low + tau (high - low) of a fuzzy one."""
    if config.primary != "fuzzy":
        return channels[0]
    low, high = channels
    return low + config.fuzzy_tau * (high - low)


def condensed_channels(square: NDArray[np.floating]) -> NDArray[np.floating]:
    """Turn distances (channels, m, m) into condensed ones (channels, m(m-1)/2)."""
    return np.stack([squareform(channel, checks=False) for channel in square])


def threshold_on_part(config: ClusterConfig, threshold: float, share: float) -> float:
    """Turn a threshold on all clips into the one on a share of them that parts them alike."""
    return threshold * sqrt(share) if config.primary == "ward" else threshold


def threshold_on_all(config: ClusterConfig, clusters: int, threshold: float, share: float) -> float:
    """Return mu on all clips, above which clusters that were found on a share of them are undone.

    Parameters
    ----------
    config : ClusterConfig
        Its own threshold is that on all.
    clusters : int
        Those of the share.
    threshold : float
        Where its dendrogram was cut.
    share : float
        Its clips, by all.

    Returns
    -------
    float
        Infinite where nothing is undone: as many clusters as were asked for are there, and where nothing was
        told apart there is no strip that could be stretched.
    """
    if config.threshold is not None:
        return config.threshold
    if config.n_clusters is not None or clusters <= 1:
        return inf
    return threshold / sqrt(share) if config.primary == "ward" else threshold  # undoes `threshold_on_part`
