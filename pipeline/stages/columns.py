"""Arrays in and out of Arrow columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.clustering.condensed import pair_at, places_of
from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.parts import Parts


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
    if not len(array):
        return np.empty((0, 0))
    return array.flatten().to_numpy(zero_copy_only=False).reshape(len(array), -1)


def per_clip(table: pa.Table, column: str = "clip_id") -> dict[str, pa.Table]:
    """Split a table, whose rows stand clip by clip, into one table a clip (without copying)."""
    ids = table[column].combine_chunks().dictionary_encode()
    codes = ids.indices.to_numpy(zero_copy_only=False)
    bounds = np.append(np.flatnonzero(np.diff(codes, prepend=-1)), len(codes))
    names = ids.dictionary.to_pylist()
    return {names[codes[start]]: table.slice(start, end - start) for start, end in pairwise(bounds)}


def matrices_by_clip(table: pa.Table) -> dict[str, NDArray]:
    """Return the features of every clip as an array (rows, d); the rows stand clip by clip."""
    values, begin, found = matrix(table["feature"]), 0, {}
    for clip_id, rows in per_clip(table).items():
        found[clip_id] = values[begin : (begin := begin + len(rows))]
    return found


def copied(rows: pa.Table) -> pa.Table:
    """Copy the rows of a clip out of a part: a slice, as `per_clip` gives it, would keep the whole part."""
    return rows.take(np.arange(len(rows)))


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


def places_by_clip(clip_ids: pa.Array | pa.ChunkedArray) -> dict[str, int]:
    """Return where every clip stands among the clips."""
    return {clip_id: place for place, clip_id in enumerate(clip_ids.to_pylist())}


def pair_places(pairs: pa.Table, places: Mapping[str, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find which clips pairs are of.

    Parameters
    ----------
    pairs : pyarrow.Table
        With clip_a and clip_b; a part of the pairs or all of them. As dictionaries they take the least time.
    places : mapping of str to int
        Where every clip stands, see `places_by_clip`.

    Returns
    -------
    a, b : array (pairs,)
        The places of clip_a and of clip_b; either may be the smaller.

    Raises
    ------
    ValueError
        A pair is of a clip that has no place.
    """
    return _places_in(pairs["clip_a"], places), _places_in(pairs["clip_b"], places)


def _places_in(column: pa.ChunkedArray, places: Mapping[str, int]) -> NDArray[np.int64]:
    """Find the place of every value of a column; each chunk looks its few different values up."""
    found = [np.empty(0, dtype=np.int64)]
    for chunk in column.chunks:
        codes = chunk.dictionary_encode()
        names = codes.dictionary.to_pylist()
        known = np.array([places.get(name, -1) for name in names], dtype=np.int64)
        found.append(known[codes.indices.to_numpy(zero_copy_only=False)])
        if (found[-1] < 0).any():
            unknown = chunk[int(np.argmin(found[-1]))].as_py()
            raise ValueError(f"{unknown} has pairs and is not among the {len(places)} clips")
    return np.concatenate(found)


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
    a, b = pair_places(pairs, places_by_clip(clip_ids))
    return places_of(np.minimum(a, b), np.maximum(a, b), count)


def condensed(pairs: pa.Table, column: str, places: NDArray[np.int64]) -> NDArray[np.float64]:
    """Lay one distance of a table of pairs out in SciPy's condensed order, see `condensed_places`."""
    distances = np.empty(len(places))
    distances[places] = pairs[column].to_numpy()
    return distances


def mapped_distances(
    pairs: Parts, columns: Sequence[str], clip_ids: pa.Array | pa.ChunkedArray
) -> list[NDArray[np.float32]]:
    """Lay distances out in SciPy's condensed order, in temporary files; the parts are read once.

    Parameters
    ----------
    pairs : Parts
        With clip_a, clip_b and distances: every pair of the clips once, in any order.
    columns : sequence of str
        The distances.
    clip_ids : array (N,)
        The clips, in the order that the condensed arrays are to follow.

    Returns
    -------
    list of array (N (N - 1) / 2,)
        One a column: 2 N^2 bytes each, see `motionary.pipeline.clustering.mapped`. The process's own memory
        is N^2 / 16 bytes and a part.

    Raises
    ------
    ValueError
        A pair is missing or stands twice, or is of a clip that is not among them; the message names it.
    """
    from motionary.pipeline.clustering.condensed_kernels import first_repeated

    count = len(clip_ids)
    size = count * (count - 1) // 2
    distances = [mapped_array((size,), np.float32) for _ in columns]
    seen = np.zeros(size // 8 + 1, np.uint8)
    place_of, rows = places_by_clip(clip_ids), 0
    for part in pairs.read(["clip_a", "clip_b", *columns]):
        a, b = pair_places(part, place_of)
        _refuse((a == b).argmax() if (a == b).any() else -1, part, "is of one clip")
        where = places_of(np.minimum(a, b), np.maximum(a, b), count)
        _refuse(first_repeated(seen, where), part, "stands twice")
        for array, column in zip(distances, columns, strict=True):
            array[where] = part[column].to_numpy()
        rows += len(part)
    if rows < size:
        first, second = pair_at(_first_unset(seen), count)
        raise ValueError(
            f"{count} clips have {size} pairs; there are {rows}, and that of {clip_ids[first]} and "
            f"{clip_ids[second]} is missing"
        )
    return distances


def _refuse(row: int, pairs: pa.Table, fault: str) -> None:
    if row >= 0:
        raise ValueError(f"the pair of {pairs['clip_a'][row]} and {pairs['clip_b'][row]} {fault}")


def _first_unset(bits: NDArray[np.uint8]) -> int:
    byte = int(np.argmax(bits != 0xFF))
    return 8 * byte + int(np.argmin(np.unpackbits(bits[byte : byte + 1], bitorder="little")))
