"""The compiled nearest-neighbour chain over sparse rows, and their making: see `sparse_linkage.py`."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def fill_rows(ends, columns, values, first, second, distances):  # type: ignore[no-untyped-def]
    """Append every pair to the rows of both clips; `ends`, where each row ends so far, moves on."""
    for pair in range(len(first)):
        i, j = first[pair], second[pair]
        for row, column in ((i, j), (j, i)):
            columns[ends[row]], values[ends[row]] = column, distances[pair]
            ends[row] += 1


@njit(nogil=True, cache=True)
def sparse_chain(starts, counts, columns, values):  # type: ignore[no-untyped-def]
    """Merge until no two clusters that are left know each other; the rows are used up.

    Row r holds `counts[r]` entries from place `starts[r]`, columns ascending; an infinite value is an entry
    that is gone. A cluster lives in the slot of its last clip. Returns the slots of every merge (merges, 2)
    and its height.
    """
    clips = len(starts)
    merged = np.empty((max(clips - 1, 0), 2), np.int64)
    heights = np.empty(max(clips - 1, 0), values.dtype)
    chain = np.empty(clips, np.int64)
    merges = links = first = 0
    while True:
        if links == 0:
            # Rows only ever lose entries, so a slot that knows nobody is passed for good.
            while first < clips and _nearest(starts, counts, columns, values, first, -1)[0] < 0:
                first += 1
            if first == clips:
                return merged[:merges], heights[:merges]
            chain[0] = first
            links = 1
        while True:
            tip = chain[links - 1]
            last = chain[links - 2] if links > 1 else -1
            nearest, least = _nearest(starts, counts, columns, values, tip, last)
            if nearest == last:
                break
            chain[links] = nearest
            links += 1
        # The first link may have lost all that it knew.
        links = max(links - 2, 0)
        if nearest < 0:
            continue
        gone, kept = min(tip, nearest), max(tip, nearest)
        merged[merges, 0], merged[merges, 1], heights[merges] = gone, kept, least
        merges += 1
        _merge(starts, counts, columns, values, gone, kept)


@njit(nogil=True, cache=True)
def _nearest(starts, counts, columns, values, row, last):  # type: ignore[no-untyped-def]
    """Return the nearest neighbour of a row and its distance; `last` wins ties, else the lowest. -1: none."""
    _close_up(starts, counts, columns, values, row)
    nearest, least = np.int64(-1), values.dtype.type(np.inf)
    to_last = least
    for place in range(starts[row], starts[row] + counts[row]):
        if values[place] < least:
            nearest, least = np.int64(columns[place]), values[place]
        if columns[place] == last:
            to_last = values[place]
    if last >= 0 and to_last <= least:
        return np.int64(last), least
    return nearest, least


@njit(nogil=True, cache=True)
def _close_up(starts, counts, columns, values, row):  # type: ignore[no-untyped-def]
    """Drop the entries of a row that are gone."""
    kept = starts[row]
    for place in range(starts[row], starts[row] + counts[row]):
        if values[place] < np.inf:
            columns[kept], values[kept] = columns[place], values[place]
            kept += 1
    counts[row] = kept - starts[row]


@njit(nogil=True, cache=True)
def _merge(starts, counts, columns, values, gone, kept):  # type: ignore[no-untyped-def]
    """Leave in the row of `kept` what both know, at the greater distance; mend the rows that mirror it."""
    _close_up(starts, counts, columns, values, gone)
    _close_up(starts, counts, columns, values, kept)
    a, b = starts[gone], starts[kept]
    end_a, end_b = a + counts[gone], b + counts[kept]
    while a < end_a or b < end_b:
        column_a = columns[a] if a < end_a else len(starts)
        column_b = columns[b] if b < end_b else len(starts)
        if column_b <= column_a:
            distance = max(values[a], values[b]) if column_a == column_b else np.inf
            values[b] = distance
            if column_b != gone:
                values[_place(starts, counts, columns, column_b, kept)] = distance
            b += 1
        if column_a <= column_b:
            if column_a != kept:
                values[_place(starts, counts, columns, column_a, gone)] = np.inf
            a += 1
    counts[gone] = 0


@njit(nogil=True, cache=True)
def _place(starts, counts, columns, row, column):  # type: ignore[no-untyped-def]
    """Find where a row holds a column that it does hold."""
    low, high = starts[row], starts[row] + counts[row]
    while low < high:
        middle = (low + high) // 2
        if columns[middle] < column:
            low = middle + 1
        else:
            high = middle
    return low
