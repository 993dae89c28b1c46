"""Compiled walks over condensed distances: nearest neighbours, and pairs that stand twice."""

from __future__ import annotations

from numba import njit


@njit(nogil=True, cache=True)
def take_row(clip, row, nearest, near):  # type: ignore[no-untyped-def]
    """Let a clip and all clips after it know their distances, `row`.

    `nearest` and `near` (N, count) hold who is nearest and how near, in order. Rows are to come in the order
    of the clips: of equally near ones the first to come, which is that of lower index, stays first.
    """
    for place in range(len(row)):
        other = clip + 1 + place
        _take(nearest[clip], near[clip], other, row[place])
        _take(nearest[other], near[other], clip, row[place])


@njit(nogil=True, cache=True)
def _take(nearest, near, other, distance):  # type: ignore[no-untyped-def]
    place = len(near)
    while place > 0 and distance < near[place - 1]:
        place -= 1
        if place + 1 < len(near):
            nearest[place + 1], near[place + 1] = nearest[place], near[place]
    if place < len(near):
        nearest[place], near[place] = other, distance


@njit(nogil=True, cache=True)
def first_repeated(seen, places):  # type: ignore[no-untyped-def]
    """Set the bits of `seen` at `places`; return the first row whose bit was set, or -1."""
    for row in range(len(places)):
        byte, bit = places[row] >> 3, 1 << (places[row] & 7)
        if seen[byte] & bit:
            return row
        seen[byte] |= bit
    return -1
