"""The level of a dendrogram with the greatest mean silhouette (Rousseeuw 1987).

    s = (b - a) / max(a, b);  a: mean distance to the others of a clip's cluster, b: to the nearest other
    cluster; 0 for a clip that is alone

A merge changes two columns of the mean distances of clips to clusters, so one walk up the tree gives every
level in O(N^2) each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.pipeline.clustering import LevelScores
from motionary.pipeline.clustering.cut import best_level


def silhouette_cut(Z: NDArray[np.float64], condensed: NDArray[np.float64]) -> LevelScores:
    """Choose the number of clusters by the silhouette.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.
    condensed : array (N(N-1)/2,)
        The distance, in SciPy's order.

    Returns
    -------
    LevelScores
        The choice, and the mean silhouette of every kappa from N-1 down to 2. Chosen among the levels that
        some threshold yields; ties to fewer clusters.
    """
    clips = len(Z) + 1
    kappa = np.arange(clips - 1, 1, -1)
    return best_level(Z, kappa, _silhouette_of_levels(Z, squareform(condensed))[: len(kappa)])


def _silhouette_of_levels(Z: NDArray[np.float64], to_cluster: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean silhouette of kappa = N-1 .. 1 (0 for one cluster)."""
    clips = len(to_cluster)
    # Column k: mean distance of each clip to the cluster kept at k. `others` is the same, but infinite for
    # the clip's own cluster and for columns given up.
    others = to_cluster + np.diag(np.full(clips, np.inf))
    size = np.ones(clips)
    own = np.arange(clips)
    column = np.arange(2 * clips - 1)
    means = np.zeros(clips - 1)
    for row, (left, right) in enumerate(Z[:, :2].astype(int).tolist()):
        kept, gone = column[left], column[right]
        column[clips + row] = kept
        total = size[kept] + size[gone]
        to_cluster[:, kept] = (size[kept] * to_cluster[:, kept] + size[gone] * to_cluster[:, gone]) / total
        size[kept] = total
        own[own == gone] = kept
        others[:, kept] = np.where(own == kept, np.inf, to_cluster[:, kept])
        others[:, gone] = np.inf
        if row < clips - 2:
            means[row] = _silhouettes(to_cluster[np.arange(clips), own], others.min(axis=1), size[own]).mean()
    return means


def _silhouettes(
    to_own: NDArray[np.float64], nearest: NDArray[np.float64], size: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Silhouette of every clip; `to_own` counts the clip itself, at distance 0."""
    inside = to_own * size / np.maximum(size - 1, 1)
    greatest = np.maximum(inside, nearest)
    safe = np.where(greatest > 0, greatest, 1.0)
    return np.where(size > 1, (nearest - inside) / safe, 0.0)
