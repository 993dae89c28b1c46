"""Complete linkage of clips of which only the pairs up to mu are known, cut at mu [DC 5, eq. 9].

Two clusters are as far apart as their furthest clips, so one pair above mu keeps them apart for good: what is
not known may be taken for infinite, and no merge of at most mu is another for it. The nearest-neighbour chain
of `linkage_kernels.py` therefore runs over the known pairs alone, in sparse rows:

    d(I+J, K) = max(d(I, K), d(J, K)) where both are known, else unknown                          eq. 9

A merged row is part of the kept cluster's own row, so everything happens in place: 16 bytes a pair of float32
for the rows, where the dense matrix takes N^2 / 2 values.

Ties are decided as the dense kernel decides them (the lowest index wins, save that the chain's last link
comes first) when it is given the same distances and one value above mu for all unknown pairs: same rows, same
bits. Against a dense matrix that holds the distances above mu, the rows are the same where no distances up to
mu are tied. Where they are, either is one of several right dendrograms: the dense chain may have come to a
tie by way of distances above mu, which nobody knows here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array

from motionary.pipeline.clustering.cut import clusters_after
from motionary.pipeline.clustering.linkage import relabelled


@dataclass(frozen=True, eq=False)
class SparseLinkage:
    """The merges up to mu, and the clusters that they leave.

    Parameters
    ----------
    merges : array (M, 4)
        The first M rows of a SciPy linkage matrix of N clips: nodes, height, number of clips.
    clusters : array (N,)
        Cluster of every clip, numbered as `cut_tree` does: by decreasing size and then by lowest member.
    """

    merges: NDArray[np.float64]
    clusters: NDArray[np.int64]


def complete_linkage_under(
    clips: int, first: ArrayLike, second: ArrayLike, distances: ArrayLike
) -> SparseLinkage:
    """Merge the clusters whose furthest clips are nearest, as long as all distances between them are known.

    Parameters
    ----------
    clips : int
        N.
    first, second : array (pairs,) of int
        Places of the clips of every pair that is known, each pair once, in either order.
    distances : array (pairs,)
        Finite, not negative; in float32 they take half the memory.

    Returns
    -------
    SparseLinkage
        `complete_linkage` up to mu, and `cut_tree` at mu, where all pairs of at most mu are known.

    Raises
    ------
    ValueError
        The lengths differ; a pair names a clip that is not there, a clip twice, or stands there twice; a
        distance is not finite or is negative.
    """
    from motionary.pipeline.clustering.sparse_linkage_kernels import sparse_chain

    rows = _rows(clips, first, second, distances)
    starts, counts = rows.indptr[:-1], np.diff(rows.indptr)
    merged, heights = sparse_chain(starts, counts, rows.indices, rows.data)
    order = np.argsort(heights, kind="stable")
    merges = relabelled(merged[order], heights[order].astype(np.float64), clips)
    return SparseLinkage(merges, clusters_after(merges, clips))


def _rows(clips: int, first: ArrayLike, second: ArrayLike, distances: ArrayLike) -> csr_array:
    """Check the pairs, and lay them out as rows with ascending columns, each pair in both of its rows."""
    i, j, values = np.asarray(first), np.asarray(second), np.asarray(distances)
    if not i.shape == j.shape == values.shape == (len(values),):
        raise ValueError(
            f"first, second and distances have shapes {i.shape}, {j.shape}, {values.shape}; give one a pair"
        )
    if values.dtype != np.float32:
        values = values.astype(np.float64)
    wrong = ~((i >= 0) & (j >= 0) & (i < clips) & (j < clips) & (i != j))
    if wrong.any():
        pair = int(np.argmax(wrong))
        raise ValueError(
            f"pair {pair} is of clips {i[pair]} and {j[pair]}; there must be two, numbered 0 to {clips - 1}"
        )
    wrong = ~(np.isfinite(values) & (values >= 0))
    if wrong.any():
        pair = int(np.argmax(wrong))
        raise ValueError(
            f"the distance of clips {i[pair]} and {j[pair]} is {values[pair]}; "
            "distances must be finite and not negative"
        )
    places = np.concatenate([i, j]), np.concatenate([j, i])
    rows = coo_array((np.concatenate([values, values]), places), shape=(clips, clips)).tocsr()
    if rows.nnz != 2 * len(values):
        repeated = len(values) - rows.nnz // 2
        raise ValueError(f"{repeated} of {len(values)} pairs are given again; give each once")
    rows.sort_indices()
    return rows
