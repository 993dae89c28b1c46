"""Names of clusters, and of the clips in them.

A clip's *own* label is a person's override, else the label supplied with it. A cluster is called by its
members' most frequent own label, and members without an own label take that name if they lie near enough to
the cluster's reference; otherwise they stay unassigned, never forced.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

LabelSource = Literal["override", "supplied", "propagated", "unassigned"]

OWN_LABEL_SOURCES: tuple[LabelSource, ...] = ("override", "supplied")
"""Of labels that are a clip's own."""


@dataclass(frozen=True, eq=False)
class Names:
    """What N clips and their clusters are called.

    Parameters
    ----------
    label : tuple of str or None
        Name of every clip; None where unassigned.
    label_source : tuple of str
        "override", "supplied", "propagated" or "unassigned", for every clip.
    confidence : array (N,)
        1 for own labels; n / (labelled + 1) for propagated ones, n of the cluster's labelled clips having
        that label; 0 for unassigned clips.
    cluster_name : dict
        Name of every cluster; None where no member has a label.
    """

    label: tuple[str | None, ...]
    label_source: tuple[LabelSource, ...]
    confidence: NDArray[np.float64]
    cluster_name: dict[Hashable, str | None]


def name_clusters(
    cluster_of: Sequence[Hashable] | NDArray[np.integer],
    labels: Sequence[str | None],
    overrides: Sequence[str | None],
    distance_to_reference: ArrayLike,
    reach: float = 1.5,
) -> Names:
    """Name clusters by their labelled members, and the other members by their cluster.

    Parameters
    ----------
    cluster_of : sequence (N,)
        Cluster of every clip.
    labels, overrides : sequence (N,) of str or None
        The label supplied with a clip, and the one a person gave it, which wins.
    distance_to_reference : array (N,)
        Distance of every clip to the reference of its own cluster.
    reach : float
        A clip without an own label further from the reference than `reach` times the furthest labelled member
        of its cluster stays unassigned.

    Returns
    -------
    Names
        For every clip its name, where that comes from and how sure it is; for every cluster its name. Of
        equally frequent labels the alphabetically first names the cluster.

    Raises
    ------
    ValueError
        Lengths differ, a label is neither None nor a string with something in it, or a distance is not finite
        or is negative.
    """
    clusters = np.asarray(cluster_of).tolist()
    distances = np.asarray(distance_to_reference, dtype=np.float64)
    _check(clusters, labels, overrides, distances)
    own = [given if given is not None else label for label, given in zip(labels, overrides, strict=True)]
    counts: dict[Hashable, Counter[str]] = {cluster: Counter() for cluster in clusters}
    furthest: dict[Hashable, float] = dict.fromkeys(clusters, 0.0)
    for cluster, label, distance in zip(clusters, own, distances, strict=True):
        if label is not None:
            counts[cluster][label] += 1
            furthest[cluster] = max(furthest[cluster], distance)
    cluster_name = {cluster: _most_frequent(count) for cluster, count in counts.items()}

    names: list[tuple[str | None, LabelSource, float]] = []
    for clip, cluster in enumerate(clusters):
        name = cluster_name[cluster]
        if own[clip] is not None:
            names.append((own[clip], "supplied" if overrides[clip] is None else "override", 1.0))
        elif name is None or distances[clip] > reach * furthest[cluster]:
            names.append((None, "unassigned", 0.0))
        else:
            names.append((name, "propagated", counts[cluster][name] / (counts[cluster].total() + 1)))
    return Names(
        tuple(name for name, _, _ in names),
        tuple(source for _, source, _ in names),
        np.array([confidence for _, _, confidence in names]),
        cluster_name,
    )


def _most_frequent(count: Counter[str]) -> str | None:
    return min(count, key=lambda label: (-count[label], label)) if count else None


def _check(
    clusters: list[Hashable],
    labels: Sequence[str | None],
    overrides: Sequence[str | None],
    distances: NDArray[np.float64],
) -> None:
    lengths = (len(clusters), len(labels), len(overrides), len(distances))
    if len(set(lengths)) != 1:
        raise ValueError(
            f"{lengths[0]} clusters, {lengths[1]} labels, {lengths[2]} overrides and {lengths[3]} distances; "
            "there must be one of each for every clip"
        )
    for what, values in (("label", labels), ("override", overrides)):
        for clip, value in enumerate(values):
            if value is not None and not (isinstance(value, str) and value):
                raise ValueError(f"the {what} of clip {clip} is {value!r}; it must be a name or None")
    wrong = np.flatnonzero(~(np.isfinite(distances) & (distances >= 0)))
    if wrong.size:
        raise ValueError(
            f"the distance of clip {wrong[0]} to its reference is {distances[wrong[0]]}; "
            "distances must be finite and not negative"
        )
