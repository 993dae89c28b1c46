"""How well clusters and distances agree with known classes.

Throughout, `clusters` and `classes` hold one hashable value a clip, and a clip whose class is missing (None,
or a missing value of pandas) is left out.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

Values = Sequence[Hashable | None] | NDArray[Any]


@dataclass(frozen=True)
class Purity:
    """The share of clips that belong to the commonest class of their cluster.

    Parameters
    ----------
    overall : float
        Over all clips with a class.
    by_cluster : dict
        For every cluster that holds a clip with a class.
    """

    overall: float
    by_cluster: dict[Hashable, float]


def reward_punish(clusters: Values, classes: Values) -> int:
    """Score clusters by the Reward-Punish Value [DC 6, eq. 12-13].

    The sum over ordered pairs of different clips in one cluster, +1 if their classes are equal and -1 if not.
    Equation 12 is printed with i <= j, which counts unordered pairs and clips with themselves; the best value
    that the paper gives for its 80 motions, 1176, needs ordered pairs i != j.

    Parameters
    ----------
    clusters, classes : sequence (N,)
        Cluster and class of every clip.

    Returns
    -------
    int
        At most `best_reward_punish(classes)`.

    Raises
    ------
    ValueError
        Lengths differ, or a clip has no cluster.
    """
    count = _contingency(clusters, classes)
    equal, together = (count.clips**2).sum(), (count.cluster_sizes**2).sum()
    return int(2 * equal - together - count.clips.sum())


def best_reward_punish(classes: Values) -> int:
    """Return the greatest Reward-Punish Value that any clusters can have: that of the classes themselves.

    Parameters
    ----------
    classes : sequence (N,)
        Class of every clip.

    Returns
    -------
    int
        Sum of n (n - 1) over classes of n clips.
    """
    codes = _codes(classes)
    size = np.bincount(codes[codes >= 0])
    return int((size * (size - 1)).sum())


def adjusted_rand_index(clusters: Values, classes: Values) -> float:
    """Return the Rand index adjusted for chance (Hubert and Arabie 1985): 1 for equal partitions, 0 expected.

    Parameters
    ----------
    clusters, classes : sequence (N,)
        Cluster and class of every clip.

    Returns
    -------
    float
        -.5 to 1.

    Raises
    ------
    ValueError
        Lengths differ, a clip has no cluster, or no clip has a class.
    """
    from sklearn.metrics import adjusted_rand_score

    cluster_codes, class_codes = _classed(clusters, classes)
    _some(class_codes)
    return float(adjusted_rand_score(class_codes, cluster_codes))


def purity(clusters: Values, classes: Values) -> Purity:
    """Measure how far each cluster is of one class.

    Parameters
    ----------
    clusters, classes : sequence (N,)
        Cluster and class of every clip.

    Returns
    -------
    Purity
        Overall and by cluster, 0 to 1.

    Raises
    ------
    ValueError
        Lengths differ, a clip has no cluster, or no clip has a class.
    """
    count = _contingency(clusters, classes)
    _some(count.clips)
    commonest = np.zeros_like(count.cluster_sizes)
    np.maximum.at(commonest, count.cluster_of_cell, count.clips)
    held = np.flatnonzero(count.cluster_sizes)
    names = pd.unique(_objects(clusters))
    return Purity(
        float(commonest.sum() / count.clips.sum()),
        {names[code]: float(commonest[code] / count.cluster_sizes[code]) for code in held},
    )


def nearest_neighbour_accuracy(
    square_distances: ArrayLike, classes: Values, groups: Values | None = None
) -> float:
    """Return how often a clip's nearest other clip is of its class.

    Parameters
    ----------
    square_distances : array (N, N)
        Distance of every two clips; the diagonal is not read.
    classes : sequence (N,)
        Class of every clip. Clips without one neither ask nor answer.
    groups : sequence (N,), optional
        Where each clip comes from, its data set for example. Then only clips of other groups are neighbours.

    Returns
    -------
    float
        0 to 1, over the clips that have a neighbour at all. Of equally near neighbours the first counts.

    Raises
    ------
    ValueError
        Shapes disagree, a clip has no group, a distance is not a number, or no clip has a neighbour.
    """
    distances = np.asarray(square_distances, dtype=np.float64)
    codes = _codes(classes)
    if distances.shape != (len(codes), len(codes)):
        raise ValueError(
            f"square_distances has shape {distances.shape}; {len(codes)} classes need that many a side"
        )
    group_codes = np.arange(len(codes)) if groups is None else _complete_codes("group", groups, len(codes))
    classed = codes >= 0
    allowed = classed[:, None] & classed[None, :] & (group_codes[:, None] != group_codes[None, :])
    if np.isnan(distances[allowed]).any():
        raise ValueError("square_distances holds a value that is not a number")
    asking = np.flatnonzero(allowed.any(axis=1))
    if not asking.size:
        raise ValueError(
            "no clip with a class has a neighbour with a class (in another group, where groups are given)"
        )
    nearest = np.where(allowed, distances, np.inf)[asking].argmin(axis=1)
    return float((codes[nearest] == codes[asking]).mean())


@dataclass(frozen=True)
class _Contingency:
    """Clips with a class, counted by cluster and class; only cells that hold some."""

    cluster_of_cell: NDArray[np.int64]
    clips: NDArray[np.int64]
    cluster_sizes: NDArray[np.int64]


def _contingency(clusters: Values, classes: Values) -> _Contingency:
    cluster_codes, class_codes = _classed(clusters, classes)
    cells, clips = np.unique(np.stack([cluster_codes, class_codes]), axis=1, return_counts=True)
    return _Contingency(cells[0], clips, np.bincount(cluster_codes))


def _classed(clusters: Values, classes: Values) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the codes of clusters and of classes, for the clips that have a class."""
    class_codes = _codes(classes)
    cluster_codes = _complete_codes("cluster", clusters, len(class_codes))
    classed = class_codes >= 0
    return cluster_codes[classed], class_codes[classed]


def _complete_codes(what: str, values: Values, clips: int) -> NDArray[np.int64]:
    codes = _codes(values)
    if len(codes) != clips:
        raise ValueError(
            f"{len(codes)} clips have a {what} and {clips} a class; both sequences must be of the same clips"
        )
    if (codes < 0).any():
        raise ValueError(f"clip {int(np.argmax(codes < 0))} has no {what}")
    return codes


def _codes(values: Values) -> NDArray[np.int64]:
    """Return a number for each value, in order of appearance; -1 where missing."""
    return pd.factorize(_objects(values))[0]


def _objects(values: Values) -> NDArray[np.object_]:
    listed = values.tolist() if isinstance(values, np.ndarray | pd.Series) else list(values)
    return np.fromiter(listed, dtype=object, count=len(listed))


def _some(clips: NDArray[np.int64]) -> None:
    if not clips.size:
        raise ValueError("no clip has a class to compare with")
