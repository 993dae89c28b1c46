"""Complete linkage of clips of which only the pairs up to mu are known, cut at mu [DC 5, eq. 9].

Two clusters are as far apart as their furthest clips, so one pair above mu keeps them apart for good: what is
not known may be taken for infinite, and no merge of at most mu is another for it. The nearest-neighbour chain
of `linkage_kernels.py` therefore runs over the known pairs alone, in sparse rows:

    d(I+J, K) = max(d(I, K), d(J, K)) where both are known, else unknown                          eq. 9

A merged row is part of the kept cluster's own row, so everything happens in place: 16 bytes a pair of float32
for the rows, where the dense matrix takes N^2 / 2 values. The pairs are read twice, part after part: once to
measure the rows, once to fill them. So nothing holds the pairs beside the rows, and these may be mapped.

Ties are decided as the dense kernel decides them (the lowest index wins, save that the chain's last link
comes first) when it is given the same distances and one value above mu for all unknown pairs: same rows, same
bits. Against a dense matrix that holds the distances above mu, the rows are the same where no distances up to
mu are tied. Where they are, either is one of several right dendrograms: the dense chain may have come to a
tie by way of distances above mu, which nobody knows here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.clustering.cut import clusters_after
from motionary.pipeline.clustering.linkage import relabelled
from motionary.pipeline.clustering.mapped import NewArray

KnownPairs = tuple[ArrayLike, ArrayLike, ArrayLike]
"""The clips `first` and `second` of some pairs, by their places, and the pairs' distances."""


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
    clips: int, read: Callable[[], Iterable[KnownPairs]], new_array: NewArray = np.empty
) -> SparseLinkage:
    """Merge the clusters whose furthest clips are nearest, as long as all distances between them are known.

    Parameters
    ----------
    clips : int
        N.
    read : callable
        Begins to read the pairs that are known, part after part; called twice. Of every part: the places of
        both clips of every pair, in either order and each pair once in all parts; and the distances, finite
        and not negative. In float32 they take half the memory.
    new_array : callable
        Makes the rows: `numpy.empty`, or `mapped_array` where they may not fit into memory.

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

    merged, heights = sparse_chain(*_rows(clips, lambda: _checked(clips, read()), new_array))
    order = np.argsort(heights, kind="stable")
    merges = relabelled(merged[order], heights[order].astype(np.float64), clips)
    return SparseLinkage(merges, clusters_after(merges, clips))


def _rows(
    clips: int, read: Callable[[], Iterator[tuple[NDArray[Any], ...]]], new_array: NewArray
) -> tuple[NDArray[Any], ...]:
    """Lay the pairs out as rows with ascending columns, each pair in both of its rows.

    Returns
    -------
    starts, counts : array (N,) of int64
        Where the row of every clip begins and how long it is.
    columns, values : array (2 pairs,)
        Who is known, and how far away.
    """
    from motionary.pipeline.clustering.sparse_linkage_kernels import fill_rows

    counts, dtype = np.zeros(clips, np.int64), np.dtype(np.float32)
    for first, second, distances in read():
        counts += np.bincount(first, minlength=clips) + np.bincount(second, minlength=clips)
        dtype = np.result_type(dtype, distances)
    starts = np.cumsum(counts) - counts
    columns, values = new_array((int(counts.sum()),), np.int32), new_array((int(counts.sum()),), dtype)
    ends = starts.copy()
    for first, second, distances in read():
        fill_rows(ends, columns, values, first, second, distances)
    for row, (start, end) in enumerate(zip(starts, ends, strict=True)):
        order = np.argsort(columns[start:end])
        columns[start:end], values[start:end] = columns[start:end][order], values[start:end][order]
        again = np.flatnonzero(np.diff(columns[start:end]) == 0)
        if len(again):
            column = columns[start + again[0]]
            raise ValueError(f"the pair of clips {row} and {column} is given again; give each once")
    return starts, counts, columns, values


def _checked(clips: int, parts: Iterable[KnownPairs]) -> Iterator[tuple[NDArray[Any], ...]]:
    for part in parts:
        i, j, values = map(np.asarray, part)
        if not i.shape == j.shape == values.shape == (len(values),):
            raise ValueError(
                f"first, second and distances have shapes {i.shape}, {j.shape}, {values.shape}; "
                "give one a pair"
            )
        if values.dtype != np.float32:
            values = values.astype(np.float64)
        wrong = ~((i >= 0) & (j >= 0) & (i < clips) & (j < clips) & (i != j))
        if wrong.any():
            pair = int(np.argmax(wrong))
            raise ValueError(
                f"pair {pair} is of clips {i[pair]} and {j[pair]}; "
                f"there must be two, numbered 0 to {clips - 1}"
            )
        wrong = ~(np.isfinite(values) & (values >= 0))
        if wrong.any():
            pair = int(np.argmax(wrong))
            raise ValueError(
                f"the distance of clips {i[pair]} and {j[pair]} is {values[pair]}; "
                "distances must be finite and not negative"
            )
        yield i.astype(np.int64, copy=False), j.astype(np.int64, copy=False), values
