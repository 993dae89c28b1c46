"""How well clusters agree with known classes; `pipeline/retrieval.py` asks the same of distances.

Throughout, `clusters` and `classes` hold one hashable value a clip, and a clip whose class is missing (None,
or a missing value of pandas) is left out.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

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
    codes = codes_of(classes)
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
    count = _contingency(clusters, classes)
    _some(count.clips)
    # Ordered pairs of different clips: together in both, in clusters alone, in classes alone, in neither.
    clips = int(count.clips.sum())
    both = int((count.clips**2).sum()) - clips
    cluster_alone = int((count.cluster_sizes**2).sum()) - clips - both
    class_alone = int((count.class_sizes**2).sum()) - clips - both
    neither = clips * (clips - 1) - both - cluster_alone - class_alone
    if cluster_alone == class_alone == 0:
        return 1.0
    in_classes, in_clusters = both + class_alone, both + cluster_alone
    scale = in_classes * (class_alone + neither) + in_clusters * (cluster_alone + neither)
    return 2 * (both * neither - cluster_alone * class_alone) / scale


def normalised_mutual_information(clusters: Values, classes: Values) -> float:
    """Return what clusters and classes tell of each other, over the mean of their entropies.

    Over the arithmetic mean; the rival conventions divide by the greater or the geometric mean.

    Parameters
    ----------
    clusters, classes : sequence (N,)
        Cluster and class of every clip.

    Returns
    -------
    float
        0 to 1. Not adjusted for chance: many small clusters score above 0.

    Raises
    ------
    ValueError
        Lengths differ, a clip has no cluster, or no clip has a class.
    """
    count = _contingency(clusters, classes)
    _some(count.clips)
    entropies = _entropy(count.cluster_sizes) + _entropy(count.class_sizes)
    if entropies == 0:
        return 1.0
    shared = entropies - _entropy(count.clips)
    return max(0.0, 2 * shared / entropies)


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


@dataclass(frozen=True)
class _Contingency:
    """Clips with a class, counted by cluster and class; only cells that hold some."""

    cluster_of_cell: NDArray[np.int64]
    clips: NDArray[np.int64]
    cluster_sizes: NDArray[np.int64]
    class_sizes: NDArray[np.int64]


def _contingency(clusters: Values, classes: Values) -> _Contingency:
    cluster_codes, class_codes = _classed(clusters, classes)
    width = class_codes.max(initial=0) + 1
    cells, clips = np.unique(cluster_codes * width + class_codes, return_counts=True)
    return _Contingency(cells // width, clips, np.bincount(cluster_codes), np.bincount(class_codes))


def _entropy(sizes: NDArray[np.int64]) -> float:
    """Entropy, in nats, of what a clip drawn at random belongs to."""
    share = sizes[sizes > 0] / sizes.sum()
    return float(-(share * np.log(share)).sum())


def _classed(clusters: Values, classes: Values) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the codes of clusters and of classes, for the clips that have a class."""
    class_codes = codes_of(classes)
    cluster_codes = codes_of_all("cluster", clusters, len(class_codes))
    classed = class_codes >= 0
    return cluster_codes[classed], class_codes[classed]


def codes_of_all(what: str, values: Values, clips: int) -> NDArray[np.int64]:
    """Return a number for each of the values of `clips` clips, none of which may be missing."""
    codes = codes_of(values)
    if len(codes) != clips:
        raise ValueError(
            f"{len(codes)} clips have a {what} and {clips} a class; both sequences must be of the same clips"
        )
    if (codes < 0).any():
        raise ValueError(f"clip {int(np.argmax(codes < 0))} has no {what}")
    return codes


def codes_of(values: Values) -> NDArray[np.int64]:
    """Return a number for each value, in order of appearance; -1 where missing."""
    return pd.factorize(_objects(values))[0]


def _objects(values: Values) -> NDArray[np.object_]:
    listed = values.tolist() if isinstance(values, np.ndarray | pd.Series) else list(values)
    return np.fromiter(listed, dtype=object, count=len(listed))


def _some(clips: NDArray[np.int64]) -> None:
    if not clips.size:
        raise ValueError("no clip has a class to compare with")
