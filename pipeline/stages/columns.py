"""Arrays in and out of Arrow columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.pipeline.clustering.condensed import places_of


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


def per_clip(table: pa.Table, column: str = "clip_id") -> dict[str, pa.Table]:
    """Split a table, whose rows stand clip by clip, into one table a clip (without copying)."""
    ids = table[column].combine_chunks().dictionary_encode()
    codes = ids.indices.to_numpy(zero_copy_only=False)
    bounds = np.append(np.flatnonzero(np.diff(codes, prepend=-1)), len(codes))
    names = ids.dictionary.to_pylist()
    return {names[codes[start]]: table.slice(start, end - start) for start, end in pairwise(bounds)}


def renamed(table: pa.Table, clip_id: str, column: str = "clip_id") -> pa.Table:
    """Give every row of a table this clip."""
    place = table.schema.get_field_index(column)
    return table.set_column(place, table.schema.field(place), pa.repeat(clip_id, len(table)))


def carried_rows(
    carried: Sequence[tuple[Mapping[str, pa.Table], Mapping[str, str]]], table: str, column: str = "clip_id"
) -> dict[str, pa.Table]:
    """Find what earlier results hold of clips, under the names that the clips have now.

    Parameters
    ----------
    carried : sequence of (tables, names)
        Of each result its tables, and of each clip what it is called there.
    table : str
        Which of the tables; its rows stand clip by clip.
    column : str
        Holds the clip.

    Returns
    -------
    dict of str to pyarrow.Table
        A table a clip; a clip that has no rows there is left out.
    """
    found: dict[str, pa.Table] = {}
    for tables, names in carried:
        rows = per_clip(tables[table], column)
        found |= {here: renamed(rows[there], here, column) for here, there in names.items() if there in rows}
    return found


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
    a, b = (_places_in(ids, pairs[side]) for side in ("clip_a", "clip_b"))
    return places_of(np.minimum(a, b), np.maximum(a, b), count)


def _places_in(ids: pa.Array, column: pa.ChunkedArray) -> NDArray[np.int64]:
    """Find the place of every value of a column; each chunk looks its few different values up."""
    places = [np.empty(0, dtype=np.int64)]
    for chunk in column.chunks:
        codes = chunk.dictionary_encode()
        known = pc.index_in(codes.dictionary, ids).to_numpy(zero_copy_only=False).astype(np.int64)
        places.append(known[codes.indices.to_numpy(zero_copy_only=False)])
    return np.concatenate(places)


def condensed(pairs: pa.Table, column: str, places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Lay one distance of a table of pairs out in SciPy's condensed order, see `condensed_places`."""
    distances = np.empty(len(places))
    distances[places] = pairs[column].to_numpy()
    return distances
