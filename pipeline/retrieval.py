"""How well distances agree with known classes, whatever the clustering: nearest neighbours and rankings.

`classes` holds one hashable value a clip; clips whose class is missing (None, or a missing value of pandas)
neither ask nor answer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.evaluation.clusters import Values, codes_of, codes_of_all


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
    codes = codes_of(classes)
    distances = _checked_square(square_distances, len(codes))
    group_codes = np.arange(len(codes)) if groups is None else codes_of_all("group", groups, len(codes))
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


def mean_average_precision(square_distances: ArrayLike, classes: Values) -> float:
    """Return how well each clip ranks the clips of its class before the others.

    A clip ranks all others by distance. Its average precision is the mean, over the others of its class, of
    the share of its class among those that are at most as far; equally far clips count together, as in
    scikit-learn's `average_precision_score`.

    Parameters
    ----------
    square_distances : array (N, N)
        Distance of every two clips; the diagonal is not read.
    classes : sequence (N,)
        Class of every clip. Clips without one neither ask nor answer.

    Returns
    -------
    float
        0 to 1, over the clips that have another of their class.

    Raises
    ------
    ValueError
        Shapes disagree, a distance is not a number, or no class has two clips.
    """
    codes = codes_of(classes)
    classed = codes >= 0
    distances = _checked_square(square_distances, len(codes))[np.ix_(classed, classed)]
    codes = codes[classed]
    if len(np.unique(codes)) == len(codes):
        raise ValueError("no class has two clips; nothing can be ranked")
    others = ~np.eye(len(codes), dtype=bool)
    if np.isnan(distances[others]).any():
        raise ValueError("square_distances holds a value that is not a number")
    # A row a clip: the others, nearest first.
    ranked = distances[others].reshape(len(codes), -1)
    same = (codes[:, None] == codes[None, :])[others].reshape(ranked.shape)
    order = np.argsort(ranked, axis=1, kind="stable")
    ranked, same = np.take_along_axis(ranked, order, 1), np.take_along_axis(same, order, 1)
    asking = same.any(axis=1)
    end, hits = _ends_of_ties(ranked[asking]), same[asking]
    precision = np.take_along_axis(hits.cumsum(axis=1), end, 1) / (end + 1)
    return float(((precision * hits).sum(axis=1) / hits.sum(axis=1)).mean())


def _ends_of_ties(ranked: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return, for each value of ascending rows, where the run of values equal to it ends."""
    last = ranked.shape[1] - 1
    place = np.full(ranked.shape, last)
    place[:, :-1] = np.where(ranked[:, 1:] > ranked[:, :-1], np.arange(last), last)
    return np.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1]


def _checked_square(square_distances: ArrayLike, clips: int) -> NDArray[np.float64]:
    distances = np.asarray(square_distances, dtype=np.float64)
    if distances.shape != (clips, clips):
        raise ValueError(
            f"square_distances has shape {distances.shape}; {clips} classes need that many a side"
        )
    return distances
