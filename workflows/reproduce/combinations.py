"""The distances that are studied, and the linkages that are defined on each.

Complete, average and Ward linkage work on any single number: DTW, B-DTW, S-DTW at one threshold (at 1 it is
B-DTW), the weighted distance. Fuzzy linkage works on the fuzzy interval; where a single number is wanted of
it (rankings, nearest neighbours, modularity, silhouette) that is its merge key low + tau (high - low), as in
a run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.clustering import average_linkage, complete_linkage, fuzzy_linkage, ward_linkage
from motionary.pipeline.clustering.condensed import places_of
from motionary.pipeline.distances import THRESHOLDS, PairwiseDistances

Condensed = NDArray[np.float64]
Linkage = Callable[[Condensed], NDArray[np.float64]]

LINKAGES: Mapping[str, Linkage] = {
    "complete": complete_linkage,
    "average": average_linkage,
    "ward": ward_linkage,
}
TAUS = (0.0, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class StudiedDistance:
    """A distance of every two clips.

    Parameters
    ----------
    name : str
        What tables call it.
    key : array (N(N-1)/2,)
        The distance as a single number, condensed.
    interval : tuple of two arrays, optional
        Low and high, condensed, where the distance is fuzzy; only fuzzy linkage works on it.
    tau : float
        Of the fuzzy distance.
    linkages : mapping of str to callable
        What a single number is clustered by.
    rescale : callable, optional
        Applied to the distances of a set of clips, which it may look at as a whole.
    """

    name: str
    key: Condensed
    interval: tuple[Condensed, Condensed] | None = None
    tau: float = 0.5
    linkages: Mapping[str, Linkage] = field(default_factory=lambda: LINKAGES)
    rescale: Callable[[Condensed], Condensed] | None = None

    def among(self, pairs: NDArray[np.intp]) -> StudiedDistance:
        """Return the distance of some pairs of clips, those of one set."""
        key = self.key[pairs]
        interval = None if self.interval is None else (self.interval[0][pairs], self.interval[1][pairs])
        return replace(self, key=self.rescale(key) if self.rescale else key, interval=interval)

    @property
    def linkage_names(self) -> tuple[str, ...]:
        """Return the linkages that are defined on it."""
        return ("fuzzy",) if self.interval is not None else tuple(self.linkages)

    def dendrogram(self, linkage: str) -> NDArray[np.float64]:
        """Cluster by one of `linkage_names`; returns a SciPy linkage matrix."""
        if self.interval is not None:
            return fuzzy_linkage(*self.interval, tau=self.tau)
        return self.linkages[linkage](self.key)


def studied_distances(distances: PairwiseDistances) -> list[StudiedDistance]:
    """Name every distance of the paper [DC 3-5], single thresholds apart.

    Parameters
    ----------
    distances : PairwiseDistances
        All pairs at `THRESHOLDS`.

    Returns
    -------
    list of StudiedDistance
        dtw, b_dtw, s_dtw_0.35 .. s_dtw_0.95, weighted, fuzzy_0, fuzzy_0.5, fuzzy_1.
    """
    low, high = distances.fuzzy_low, distances.fuzzy_high
    single = [
        StudiedDistance(f"s_dtw_{threshold:g}", np.ascontiguousarray(distances.curve[:, index]))
        for index, threshold in enumerate(THRESHOLDS)
        if threshold < 1
    ]
    return [
        StudiedDistance("dtw", distances.dtw),
        StudiedDistance("b_dtw", distances.b_dtw),
        *single,
        StudiedDistance("weighted", distances.weighted),
        *(StudiedDistance(f"fuzzy_{tau:g}", low + tau * (high - low), (low, high), tau) for tau in TAUS),
    ]


def pairs_among(chosen: NDArray[np.intp], clips: int) -> NDArray[np.intp]:
    """Return where the pairs of some of `clips` clips stand in the condensed order of all.

    Parameters
    ----------
    chosen : array (n,) of int
        Places of the clips, ascending.
    clips : int
        How many there are in all.

    Returns
    -------
    array (n(n-1)/2,) of int
        In the condensed order of the chosen clips.
    """
    first, second = (chosen[side] for side in np.triu_indices(len(chosen), 1))
    return places_of(first, second, clips)
