"""Arrays in and out of Arrow columns."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.pipeline.clustering.condensed import places_of

POSE_COLUMNS = 57
"""Leading columns of `features` that are pose, 19 joints by 3; the two after them are travel."""


def vectors(rows: NDArray) -> pa.Array:
    """Turn an array (rows, d) into a list column, a vector a row."""
    count, width = rows.shape
    offsets = np.arange(count + 1, dtype=np.int32) * width
    return pa.ListArray.from_arrays(offsets, np.ascontiguousarray(rows).reshape(-1))


def matrix(column: pa.ChunkedArray) -> NDArray:
    """Turn a list column of equal lengths into an array (rows, d).

    Raises
    ------
    ValueError
        The rows have different lengths.
    """
    array = column.combine_chunks()
    return array.flatten().to_numpy(zero_copy_only=False).reshape(len(array), -1)


def per_clip(table: pa.Table) -> dict[str, pa.Table]:
    """Split a table, whose rows stand clip by clip, into one table a clip (without copying)."""
    ids = table["clip_id"].combine_chunks().dictionary_encode()
    codes = ids.indices.to_numpy(zero_copy_only=False)
    bounds = np.append(np.flatnonzero(np.diff(codes, prepend=-1)), len(codes))
    names = ids.dictionary.to_pylist()
    return {names[codes[start]]: table.slice(start, end - start) for start, end in pairwise(bounds)}


def condensed_places(pairs: pa.Table, clip_ids: pa.Array | pa.ChunkedArray) -> NDArray[np.int64]:
    """Find where each row of a table of pairs stands in SciPy's condensed order.

    Parameters
    ----------
    pairs : pyarrow.Table
        With clip_a and clip_b, every pair of the clips once, in any order.
    clip_ids : array (N,)
        The clips, in the order that the condensed array is to follow.

    Returns
    -------
    array (N (N - 1) / 2,)

    Raises
    ------
    ValueError
        A pair is missing.
    """
    count = len(clip_ids)
    size = count * (count - 1) // 2
    if len(pairs) != size:
        raise ValueError(f"{count} clips have {size} pairs; the table has {len(pairs)}")
    ids = clip_ids.combine_chunks() if isinstance(clip_ids, pa.ChunkedArray) else clip_ids
    a = pc.index_in(pairs["clip_a"], ids).to_numpy().astype(np.int64)
    b = pc.index_in(pairs["clip_b"], ids).to_numpy().astype(np.int64)
    return places_of(np.minimum(a, b), np.maximum(a, b), count)


def condensed(pairs: pa.Table, column: str, places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Lay one distance of a table of pairs out in SciPy's condensed order, see `condensed_places`."""
    distances = np.empty(len(places))
    distances[places] = pairs[column].to_numpy()
    return distances
