"""Distances, linkage and cut as one scikit-learn estimator [DC 3-5].

Where scikit-learn's `X` is a table of samples by features, a motion is a sequence of vectors of its own
length. So `X` is a sequence of arrays (frames, d), such as `motionary.pipeline.features.motion_features`
makes; with `metric="precomputed"` it is distances.

A new motion gets the cluster of the fitted motion that is nearest to it, of equally near ones the first:
what `motionary assign` does before it asks whether the motion lies within the cluster's reach. The rivals
are the nearest reference, which a dendrogram does not name, and the least mean distance to a cluster's
motions, which needs every distance where the nearest is found without most of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import squareform
from sklearn.base import BaseEstimator, ClusterMixin
from sklearn.utils.validation import check_is_fitted, check_non_negative, validate_data

from motionary.pipeline.clustering.choice import choose_cut
from motionary.pipeline.clustering.linkage import LINKAGES, fuzzy_linkage
from motionary.pipeline.config import ClusterConfig, LinkageMethod, Metric
from motionary.pipeline.distances.dtw_pairs import pairwise_dtw
from motionary.pipeline.distances.nearest import nearest_clips, pack_library
from motionary.pipeline.distances.pairwise import pairwise_distances
from motionary.pipeline.distances.tiles import comparable_clips
from motionary.pipeline.motion import FloatArray

Motions = Sequence[ArrayLike] | NDArray[Any]

_METRICS = (*get_args(Metric), "precomputed")


class MotionClusterer(ClusterMixin, BaseEstimator):
    """Cluster motions by a distance that knows how their time is warped.

    Parameters
    ----------
    metric : {"weighted", "dtw", "b_dtw", "fuzzy", "precomputed"}
        The distance of two motions. Fuzzy distances are intervals, and go with fuzzy linkage alone.
    linkage : {"complete", "ward", "average", "fuzzy"}
    n_clusters : int, optional
        kappa.
    threshold : float, optional
        mu: merges above it are undone. With neither, the level of the dendrogram that has the greatest
        modularity on the graph of nearest neighbours.

    Attributes
    ----------
    labels_ : array (N,) of int
        Cluster of every motion, from 0, by decreasing size.
    n_clusters_ : int
    linkage_matrix_ : array (N-1, 4)
        The dendrogram, as SciPy draws it.
    cut_ : Cut
        Where it was cut and why.
    n_features_in_ : int
        d; under "precomputed" N.

    Examples
    --------
    >>> import numpy as np
    >>> from motionary.pipeline.clustering import MotionClusterer
    >>> rise, fall = np.linspace(0, 1, 20)[:, None], np.linspace(1, 0, 30)[:, None]
    >>> clusterer = MotionClusterer(metric="dtw", n_clusters=2).fit([rise, rise[::2], fall])
    >>> clusterer.labels_, clusterer.predict([fall[::3]])
    (array([0, 0, 1]), array([1]))
    """

    def __init__(
        self,
        metric: Metric | Literal["precomputed"] = "weighted",
        linkage: LinkageMethod = "complete",
        n_clusters: int | None = None,
        threshold: float | None = None,
    ) -> None:
        self.metric = metric
        self.linkage = linkage
        self.n_clusters = n_clusters
        self.threshold = threshold

    def fit(self, X: Motions, y: object = None) -> Self:
        """Cluster motions.

        Parameters
        ----------
        X : sequence of array (frames, d), or array (N, N)
            N motions; under "precomputed" their distances.
        y : object
            Not used.

        Raises
        ------
        ValueError
            A parameter is out of its range, or a motion or a distance cannot be used; the message names it.
        """
        self._check_parameters()
        config = ClusterConfig(threshold=self.threshold, n_clusters=self.n_clusters)
        if self.metric == "precomputed":
            low = high = self._condensed(X)
        else:
            clips = _clips(X)
            self.n_features_in_ = clips[0].shape[1]
            self._library = pack_library(clips)
            low, high = self._compared(clips)
        if self.linkage == "fuzzy":
            self.linkage_matrix_ = fuzzy_linkage(low, high, config.fuzzy_tau)
        else:
            self.linkage_matrix_ = LINKAGES[self.linkage](low)
        self.cut_ = choose_cut(self.linkage_matrix_, low + config.fuzzy_tau * (high - low), config)
        self.labels_, self.n_clusters_ = self.cut_.labels, self.cut_.n_clusters
        return self

    def predict(self, X: Motions) -> NDArray[np.int64]:
        """Give new motions the clusters of those they are nearest to.

        Parameters
        ----------
        X : sequence of array (frames, d), or array (M, N)
            M motions; under "precomputed" their distances to those fitted.

        Returns
        -------
        array (M,) of int

        Raises
        ------
        NotFittedError
            `fit` comes first.
        ValueError
            A motion cannot be compared with those fitted.
        """
        check_is_fitted(self)
        if self.metric == "precomputed":
            return self.labels_[self._checked_distances(X, reset=False).argmin(axis=1)]
        clips = _clips(X)
        if clips[0].shape[1] != self.n_features_in_:
            raise ValueError(
                f"X has {clips[0].shape[1]} features a frame, and the motions fitted have "
                f"{self.n_features_in_}; make both with the same settings"
            )
        nearest = [nearest_clips(clip, self._library, 1, self.metric).index[0] for clip in clips]
        return self.labels_[nearest]

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        precomputed = self.metric == "precomputed"
        tags.input_tags.pairwise = tags.input_tags.positive_only = precomputed
        tags.input_tags.two_d_array = precomputed
        tags.input_tags.three_d_array = not precomputed
        return tags

    def _check_parameters(self) -> None:
        for name, value, known in (
            ("metric", self.metric, _METRICS),
            ("linkage", self.linkage, get_args(LinkageMethod)),
        ):
            if value not in known:
                raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(map(repr, known))}")
        if (self.metric == "fuzzy") != (self.linkage == "fuzzy"):
            raise ValueError(
                f"metric is {self.metric!r} and linkage {self.linkage!r}; fuzzy distances are intervals, "
                "which fuzzy linkage alone takes, and no others: give both as 'fuzzy' or neither"
            )

    def _condensed(self, X: Motions) -> NDArray[np.float64]:
        """Check a square matrix of distances; one that is symmetric but for rounding is made so."""
        distances = self._checked_distances(X, reset=True)
        if distances.shape[0] != distances.shape[1]:
            raise ValueError(f"X has shape {distances.shape}; precomputed distances are square, (N, N)")
        wrong = ~np.isclose(distances, distances.T, rtol=1e-5, atol=1e-8)
        if wrong.any():
            i, j = np.argwhere(wrong)[0]
            raise ValueError(
                f"X[{i}, {j}] is {distances[i, j]} and X[{j}, {i}] {distances[j, i]}; a distance is the same "
                "in both directions"
            )
        if distances.diagonal().any():
            i = int(np.argmax(distances.diagonal()))
            raise ValueError(f"X[{i}, {i}] is {distances[i, i]}; the distance of a motion to itself is 0")
        return squareform((distances + distances.T) / 2, checks=False)

    def _checked_distances(self, X: Motions, reset: bool) -> NDArray[np.float64]:
        distances = validate_data(self, X, dtype=np.float64, reset=reset)
        check_non_negative(distances, "MotionClusterer")
        return distances

    def _compared(self, clips: Sequence[FloatArray]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Compare all pairs; both ends of the fuzzy distance, or the same distance twice."""
        if self.metric in ("dtw", "b_dtw"):
            distances = pairwise_dtw(clips, bidirectional=self.metric == "b_dtw")
            return distances, distances
        found = pairwise_distances(clips)
        return (
            (found.weighted, found.weighted)
            if self.metric == "weighted"
            else (found.fuzzy_low, found.fuzzy_high)
        )


def _clips(X: Motions) -> list[FloatArray]:
    """Check a sequence of motions.

    Raises
    ------
    ValueError
        It is a table, or empty, or names the motion that is wrong.
    """
    if isinstance(X, np.ndarray) and X.ndim == 2 and X.dtype != object:
        raise ValueError(
            f"X has shape {X.shape}, a table; give a sequence of motions, each an array (frames, d), "
            "or metric='precomputed' and their distances"
        )
    clips = [np.asarray(clip) for clip in X]
    if not clips:
        raise ValueError("X is empty; give at least one motion")
    return comparable_clips(clips, [f"X[{i}]" for i in range(len(clips))])
