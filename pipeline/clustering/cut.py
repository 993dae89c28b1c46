"""Cutting a dendrogram: at a threshold mu, at kappa clusters, and the threshold strips between [DC 5, 6].

A linkage matrix is read from the top down in row order: kappa clusters are what its first N - kappa merges
leave. The paper stops when the least distance is larger than mu, so a merge at exactly mu stays. The
*threshold strip* of kappa is the range mu_low <= mu < mu_high that yields kappa clusters; the mu-kappa curve
(figure 9) is made of them. Where merges are tied no mu yields the kappas inside the tie: such a kappa has no
strip, and its clusters depend on the order of the rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.cluster.hierarchy import is_valid_linkage


@dataclass(frozen=True)
class Strip:
    """The thresholds mu_low <= mu < mu_high that yield `kappa` clusters.

    `mu_high` is infinite for one cluster. A kappa inside a tie has mu_low == mu_high, an empty range.
    """

    kappa: int
    mu_low: float
    mu_high: float

    @property
    def width(self) -> float:
        """Return mu_high - mu_low, in the unit of the linkage's heights."""
        return self.mu_high - self.mu_low

    @property
    def mu(self) -> float:
        """Return a representative threshold: the middle of the strip, or mu_low where it has none."""
        middle = self.mu_low + self.width / 2
        return middle if middle < self.mu_high else self.mu_low


@dataclass(frozen=True, eq=False)
class LevelScores:
    """What a rule thinks of the levels of a dendrogram, and the level it chooses.

    Parameters
    ----------
    n_clusters : int
        The kappa of the greatest score among those that have a threshold strip; ties to fewer clusters. 1
        where there is none.
    kappa : array (levels,)
        Numbers of clusters, descending.
    score : array (levels,)
        The rule's value of each.
    """

    n_clusters: int
    kappa: NDArray[np.int64]
    score: NDArray[np.float64]


def cut_tree(
    Z: NDArray[np.float64], threshold: float | None = None, n_clusters: int | None = None
) -> NDArray[np.int64]:
    """Cut a dendrogram into clusters.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.
    threshold : float, optional
        mu, in the unit of the heights: merges of at most this height stay.
    n_clusters : int, optional
        kappa, 1 .. N: the first N - kappa rows stay, also among tied heights.

    Returns
    -------
    array (N,)
        Cluster of every clip, 0 .. kappa-1, by decreasing size and then by lowest member.

    Raises
    ------
    ValueError
        Not exactly one of `threshold` and `n_clusters` is given, or it is out of range; Z is no linkage
        matrix.
    """
    heights = merge_heights(Z)
    clips = len(heights) + 1
    if (threshold is None) == (n_clusters is None):
        raise ValueError(f"threshold is {threshold} and n_clusters {n_clusters}; give exactly one of them")
    if threshold is not None:
        if np.isnan(threshold):
            raise ValueError("threshold is nan; it must be a number")
        merges = int(np.searchsorted(heights, threshold, side="right"))
    else:
        merges = clips - _checked_kappa(n_clusters, clips)
    return clusters_after(Z[:merges], clips)


def threshold_strips(Z: NDArray[np.float64]) -> pa.Table:
    """List the range of thresholds that yields each number of clusters: the mu-kappa curve [DC figure 9].

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.

    Returns
    -------
    pyarrow.Table
        `kappa` descending from N to 1, `mu_low`, `mu_high` (mu_low <= mu < mu_high; the last is infinite). A
        kappa that no threshold yields, because merges are tied, has no row.
    """
    low, high = _strip_ends(merge_heights(Z))
    kappa = np.arange(len(low), 0, -1)
    real = low < high
    return pa.table({"kappa": kappa[real], "mu_low": low[real], "mu_high": high[real]})


def strip_of(Z: NDArray[np.float64], kappa: int) -> Strip:
    """Return the threshold strip of `kappa` clusters, 1 .. N; empty (mu_low == mu_high) inside a tie."""
    low, high = _strip_ends(merge_heights(Z))
    row = len(low) - _checked_kappa(kappa, len(low))
    return Strip(int(kappa), float(low[row]), float(high[row]))


def widest_strip(Z: NDArray[np.float64]) -> Strip | None:
    """Find the longest range of thresholds with one number of clusters: the paper's good cut [DC 6].

    Only 2 <= kappa <= N-1 take part, since the strip of one cluster has no end and that of N says nothing of
    clusters; ties go to fewer clusters.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.

    Returns
    -------
    Strip or None
        None where no threshold yields such a kappa: fewer than three clips, or all merges tied.
    """
    low, high = _strip_ends(merge_heights(Z))
    width = (high - low)[1:-1]
    if not (width > 0).any():
        return None
    row = len(width) - int(np.argmax(width[::-1]))
    return strip_of(Z, len(low) - row)


def best_level(Z: NDArray[np.float64], kappa: NDArray[np.int64], score: NDArray[np.float64]) -> LevelScores:
    """Choose the level of greatest score among those that a threshold yields; ties to fewer clusters.

    Scores that differ by less than 1e-12 are tied, so that the choice does not hang on the order of a sum.
    """
    low, high = _strip_ends(merge_heights(Z))
    possible = (low < high)[len(low) - kappa]
    if not possible.any():
        return LevelScores(1, kappa, score)
    best = possible & (score >= score[possible].max() - 1e-12)
    return LevelScores(int(kappa[best].min()), kappa, score)


def merge_heights(Z: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the heights (N-1,) of a linkage matrix after checking it.

    Raises
    ------
    ValueError
        Z is not a SciPy linkage matrix, or a merge is lower than the one before it.
    """
    if np.ndim(Z) != 2 or np.shape(Z)[1] != 4:
        raise ValueError(f"Z has shape {np.shape(Z)}; a linkage matrix of N clips has (N-1, 4)")
    if len(Z):
        is_valid_linkage(Z, throw=True, name="Z")
    heights = np.asarray(Z[:, 2])
    falls = np.flatnonzero(heights[1:] < heights[:-1])
    if falls.size:
        row = int(falls[0]) + 1
        raise ValueError(
            f"merge {row - 1} has height {heights[row - 1]} and merge {row} {heights[row]}; "
            "heights must not fall"
        )
    return heights


def _strip_ends(heights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ends of the strips of kappa = N .. 1: kappa clusters last from one merge to the next."""
    return np.concatenate([[0.0], heights]), np.concatenate([heights, [np.inf]])


def _checked_kappa(n_clusters: int | None, clips: int) -> int:
    if n_clusters is None or int(n_clusters) != n_clusters or not 1 <= n_clusters <= clips:
        raise ValueError(
            f"n_clusters is {n_clusters} for {clips} clips; it must be a whole number from 1 to {clips}"
        )
    return int(n_clusters)


def clusters_after(merges: NDArray[np.float64], clips: int) -> NDArray[np.int64]:
    """Return the clusters (N,), `numbered`, that the first rows (M, 4) of a linkage matrix leave."""
    top = np.arange(clips + len(merges))
    for row in range(len(merges) - 1, -1, -1):
        top[merges[row, :2].astype(np.int64)] = top[clips + row]
    return numbered(top[:clips])


def numbered(groups: NDArray[np.int64]) -> NDArray[np.int64]:
    """Give groups (N,) the numbers 0, 1, .. by decreasing size, then by lowest member."""
    _, lowest, group, size = np.unique(groups, return_index=True, return_inverse=True, return_counts=True)
    rank = np.empty(len(size), np.int64)
    rank[np.lexsort((lowest, -size))] = np.arange(len(size))
    return rank[group]
