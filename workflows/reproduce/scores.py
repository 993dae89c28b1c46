"""What one dendrogram of one set of clips is worth, by every measure of the study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.pipeline.clustering import cut_tree, modularity_cut, strip_of, widest_strip
from motionary.pipeline.evaluation import (
    adjusted_rand_index,
    best_reward_punish,
    normalised_mutual_information,
    reward_punish,
)
from motionary.pipeline.retrieval import mean_average_precision, nearest_neighbour_accuracy
from motionary.workflows.reproduce.combinations import StudiedDistance
from motionary.workflows.reproduce.silhouette import silhouette_cut

MEASURES: Mapping[str, str] = {
    "reward_punish": "reward-punish value over its best, at the true number of classes",
    "ari": "adjusted Rand index, at the true number of classes",
    "nmi": "normalised mutual information, at the true number of classes",
    "mean_average_precision": "of the distance: each clip ranks all others",
    "nearest_neighbour": "of the distance: share of clips whose nearest other is of their class",
    "ari_strip": "adjusted Rand index at the widest threshold strip",
    "ari_modularity": "adjusted Rand index at the cut of greatest modularity",
    "ari_silhouette": "adjusted Rand index at the cut of greatest silhouette",
    "true_strip": "width of the threshold strip of the true number of classes, over the highest merge",
}
"""Every measure, with what it is. All lie in 0 .. 1 or below 0 for worse than chance; more is better."""


def score_set(
    distance: StudiedDistance, classes: NDArray[np.object_], subjects: NDArray[np.object_] | None
) -> dict[str, dict[str, float]]:
    """Score a distance of one set of clips, by each linkage that is defined on it.

    Parameters
    ----------
    distance : StudiedDistance
        Of the set's n clips alone.
    classes : array (n,)
        Class of every clip.
    subjects : array (n,), optional
        Who moves; then a nearest neighbour is of another subject.

    Returns
    -------
    dict of str to dict of str to float
        For every linkage the value of every one of `MEASURES`; nan where a set has only one subject.
    """
    retrieval = _retrieval_scores(distance.key, classes, subjects)
    return {
        linkage: retrieval | clustering_scores(distance.dendrogram(linkage), distance.key, classes)
        for linkage in distance.linkage_names
    }


def clustering_scores(
    Z: NDArray[np.float64], key: NDArray[np.float64], classes: NDArray[np.object_]
) -> dict[str, float]:
    """Score a dendrogram at the true number of classes, and at cuts found without the classes.

    Parameters
    ----------
    Z : array (n-1, 4)
        SciPy linkage matrix.
    key : array (n(n-1)/2,)
        The distance as one number, condensed; modularity and silhouette read it.
    classes : array (n,)
        Class of every clip.
    """
    kappa = len(set(classes.tolist()))
    clusters = cut_tree(Z, n_clusters=kappa)
    widest = widest_strip(Z)
    found = {
        "strip": widest.kappa if widest else 1,
        "modularity": modularity_cut(Z, key).n_clusters,
        "silhouette": silhouette_cut(Z, key).n_clusters,
    }
    at = {
        count: adjusted_rand_index(cut_tree(Z, n_clusters=count), classes)
        for count in {kappa, *found.values()}
    }
    return {
        "reward_punish": reward_punish(clusters, classes) / best_reward_punish(classes),
        "ari": at[kappa],
        "nmi": normalised_mutual_information(clusters, classes),
        **{f"ari_{rule}": at[count] for rule, count in found.items()},
        "true_strip": strip_of(Z, kappa).width / Z[-1, 2] if kappa > 1 and Z[-1, 2] > 0 else 0.0,
    }


def _retrieval_scores(
    key: NDArray[np.float64], classes: NDArray[np.object_], subjects: NDArray[np.object_] | None
) -> dict[str, float]:
    square = squareform(key)
    alone = subjects is not None and len(set(subjects.tolist())) < 2
    return {
        "mean_average_precision": mean_average_precision(square, classes),
        "nearest_neighbour": np.nan if alone else nearest_neighbour_accuracy(square, classes, subjects),
    }
