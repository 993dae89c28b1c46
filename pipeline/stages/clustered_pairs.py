"""Distances inside clusters, of pairs that are read part after part.

Pairs between clusters are passed over, and need not be there. Every pair inside one must be, once. What is
held is a number or two a clip; what comes out depends neither on the order of the pairs nor on their parts.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import pair_places, places_by_clip

_GRAIN = 2.0**-30  # of distances that are summed; sums up to 2^23 leg lengths are then exact in any order

_Places = NDArray[np.int64]


class Inside(Protocol):
    """Distances inside clusters, however they are come by."""

    @property
    def clip_ids(self) -> pa.ChunkedArray:
        """The N clips."""

    @property
    def clusters(self) -> NDArray[np.integer]:
        """The cluster of each."""

    def distances_to(self, reference: _Places, column: str) -> NDArray[np.float64]:
        """Return the distance of every clip to the one at this place, which represents its cluster."""

    def sums(self, column: str, clusters: Collection[int]) -> NDArray[np.float64]:
        """Return how far every clip of some clusters is from the others of its cluster."""


def rounded(distances: NDArray[np.floating]) -> NDArray[np.float64]:
    """Round distances such that their sum does not depend on the order."""
    return np.rint(distances.astype(np.float64) / _GRAIN) * _GRAIN


@dataclass(frozen=True, eq=False)
class ClusteredPairs:
    """The pairs of clips that are of one cluster.

    Parameters
    ----------
    pairs : Parts
        With clip_a, clip_b and distances.
    clip_ids : pyarrow.ChunkedArray
        The N clips.
    clusters : array (N,)
        The cluster of each.
    """

    pairs: Parts
    clip_ids: pa.ChunkedArray
    clusters: NDArray[np.integer]

    def distances_to(self, reference: _Places, column: str) -> NDArray[np.float64]:
        """Return the distance of every clip to the one that represents it.

        Parameters
        ----------
        reference : array (N,)
            For every clip the place of the one that represents its cluster.
        column : str
            Which distance.

        Returns
        -------
        array (N,)
            0 of a clip to itself.

        Raises
        ------
        ValueError
            A pair of two clips of one cluster is missing or stands twice; it is named.
        """
        distances = np.zeros(len(reference))
        seen = np.zeros(len(reference), dtype=np.int64)
        for a, b, values in self._read(column):
            for one, other in ((a, b), (b, a)):
                to_reference = reference[one] == other
                distances[one[to_reference]] = values[to_reference]
                seen += np.bincount(one, minlength=len(seen))
        _, cluster, sizes = np.unique(self.clusters, return_inverse=True, return_counts=True)
        wrong = np.flatnonzero(seen != sizes[cluster] - 1)
        if wrong.size:
            raise ValueError(self._what_is_wrong_with(int(wrong[0]), column))
        return distances

    def sums(self, column: str, clusters: Collection[int]) -> NDArray[np.float64]:
        """Return the sum of every clip's distances to the others of its cluster, to 1e-9 a pair.

        Parameters
        ----------
        column : str
            Which distance.
        clusters : collection of int
            The clusters whose clips are asked for; the sums of others mean nothing.
        """
        sums = np.zeros(len(self.clusters))
        for a, b, values in self._read(column):
            for one in (a, b):
                sums += np.bincount(one, weights=rounded(values), minlength=len(sums))
        return sums

    def _read(self, column: str) -> Iterator[tuple[_Places, _Places, NDArray[np.float64]]]:
        places = places_by_clip(self.clip_ids)
        for part in self.pairs.read(["clip_a", "clip_b", column]):
            a, b = pair_places(part, places)
            inside = self.clusters[a] == self.clusters[b]
            yield a[inside], b[inside], part[column].to_numpy()[inside].astype(np.float64)

    def _what_is_wrong_with(self, clip: int, column: str) -> str:
        """Read the pairs once more to find which of a clip's is not there once."""
        times = np.zeros(len(self.clusters), dtype=np.int64)
        times[clip] = 1
        for a, b, _ in self._read(column):
            for one, other in ((a, b), (b, a)):
                times += np.bincount(other[one == clip], minlength=len(times))
        wrong = int(np.flatnonzero((self.clusters == self.clusters[clip]) & (times != 1))[0])
        return (
            f"{self.clip_ids[clip].as_py()} and {self.clip_ids[wrong].as_py()} are of cluster "
            f"{self.clusters[clip]} and stand {times[wrong]} times among the pairs, not once"
        )
