"""Where a run cuts its dendrogram.

A threshold or a number of clusters from the configuration is obeyed. Else `cut="strip"` takes the widest
threshold strip, and `cut="auto"` takes the labels' choice where there are enough of them and modularity where
not. The widest strip is reported with every cut; on real clips it nearly always says two or three clusters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.clustering.cut import Strip, cut_tree, strip_of, widest_strip
from motionary.pipeline.clustering.labels import label_cut, labels_suffice
from motionary.pipeline.clustering.modularity import modularity_cut
from motionary.pipeline.config import ClusterConfig

CutRule = Literal["threshold", "count", "labels", "modularity", "strip"]


@dataclass(frozen=True, eq=False)
class Cut:
    """A cut dendrogram, and why it was cut there.

    Parameters
    ----------
    labels : array (N,)
        Cluster of every clip, as `cut_tree` numbers them.
    n_clusters : int
        kappa.
    threshold : float
        mu, in the unit of the heights: the one asked for, or the middle of `strip` (its lower end for one
        cluster). It yields the same clusters, save where a count was asked for that lies inside a tie.
    rule : {"threshold", "count", "labels", "modularity", "strip"}
        What decided.
    strip : Strip
        All thresholds that yield kappa.
    widest : Strip or None
        The dendrogram's widest strip, whatever decided.
    """

    labels: NDArray[np.int64]
    n_clusters: int
    threshold: float
    rule: CutRule
    strip: Strip
    widest: Strip | None


def choose_cut(
    Z: NDArray[np.float64],
    distances: ArrayLike,
    config: ClusterConfig,
    labels: Sequence[str | None] | None = None,
) -> Cut:
    """Cut a dendrogram as the configuration says.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.
    distances : array (N(N-1)/2,)
        The distance that Z was made from, condensed; for fuzzy linkage low + tau (high - low).
    config : ClusterConfig
        `threshold`, `n_clusters` and `cut` are read.
    labels : sequence of str or None, optional
        Label of every clip. None hides them: scores of an automatic cut are taken so.

    Returns
    -------
    Cut
        One cluster where the rule has nothing to choose from (fewer than three clips, or all merges tied).

    Raises
    ------
    ValueError
        More clusters are asked for than there are clips, or the numbers of clips differ.
    """
    if config.threshold is not None:
        clusters = cut_tree(Z, threshold=config.threshold)
        kappa = int(clusters.max()) + 1
        return Cut(clusters, kappa, config.threshold, "threshold", strip_of(Z, kappa), widest_strip(Z))
    rule, kappa = _rule_and_count(Z, distances, config, labels)
    strip = strip_of(Z, kappa)
    return Cut(cut_tree(Z, n_clusters=kappa), kappa, strip.mu, rule, strip, widest_strip(Z))


def _rule_and_count(
    Z: NDArray[np.float64],
    distances: ArrayLike,
    config: ClusterConfig,
    labels: Sequence[str | None] | None,
) -> tuple[CutRule, int]:
    if config.n_clusters is not None:
        return "count", config.n_clusters
    if config.cut == "strip":
        widest = widest_strip(Z)
        return "strip", widest.kappa if widest else 1
    if labels is not None and len(labels) != len(Z) + 1:
        raise ValueError(f"Z is of {len(Z) + 1} clips, and there are {len(labels)} labels")
    if labels is not None and labels_suffice(labels):
        return "labels", label_cut(Z, labels).n_clusters
    return "modularity", modularity_cut(Z, distances).n_clusters
