"""Which zones the cheapest cover is made of [DC 3].

The kernels need its weight alone, and `least_cover` leaves behind a matching: the pairs of segments that save
something by sharing a zone. Every other segment takes its lightest zone. Of several zones between the same
two segments only the lightest counts, of equals the first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.distances.edge_cover import cover_room, least_cover
from motionary.pipeline.distances.fixed_point import UNREACHED


def segments_of(intervals: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Join the intervals that share a frame, transitively.

    Parameters
    ----------
    intervals : array (Z, 2) int
        First and last frame of every zone, in one of the clips.

    Returns
    -------
    segment : array (Z,) int
        The segment of every interval, numbered in time.
    segments : array (S, 2) int
        First and last frame of every segment.
    """
    order = np.argsort(intervals[:, 0], kind="stable")
    first, reached = intervals[order, 0], np.maximum.accumulate(intervals[order, 1])
    begins = np.concatenate([[True], first[1:] > reached[:-1]])
    segment = np.empty(len(intervals), dtype=np.int64)
    segment[order] = np.cumsum(begins) - 1
    starts = np.flatnonzero(begins)
    ends = np.append(starts[1:], len(first)) - 1
    return segment, np.column_stack([first[starts], reached[ends]])


def chosen_zones(
    row_segment: NDArray[np.int64], column_segment: NDArray[np.int64], weights: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], int]:
    """Choose zones that touch every segment of both clips, of least total weight.

    Parameters
    ----------
    row_segment, column_segment : array (Z,) int
        Which segments every zone joins.
    weights : array (Z,) int64
        B-DTW of the zones, in quanta.

    Returns
    -------
    chosen : array (Z,) bool
    total : int
        Their total weight, in quanta.
    """
    if row_segment.max() > column_segment.max():
        row_segment, column_segment = column_segment, row_segment
    lightest = np.full((row_segment.max() + 1, column_segment.max() + 1), UNREACHED)
    zone_of = np.full(lightest.shape, -1)
    for zone, (row, column) in enumerate(zip(row_segment, column_segment, strict=True)):
        if weights[zone] < lightest[row, column]:
            lightest[row, column], zone_of[row, column] = weights[zone], zone
    room = cover_room(lightest.shape[1])
    total = int(least_cover(lightest.copy(), room))
    row_least, column_least = lightest.argmin(axis=1), lightest.argmin(axis=0)
    rows, columns = np.arange(lightest.shape[0]), np.arange(lightest.shape[1])
    if len(rows) > 1:
        owner = room.owner[: len(columns)]
        apart = lightest[owner, row_least[owner]] + lightest[column_least, columns]
        shared = (owner >= 0) & (lightest[owner, columns] < apart)
        row_least[owner[shared]] = columns[shared]
        column_least[shared] = owner[shared]
    chosen = np.zeros(len(weights), dtype=bool)
    chosen[zone_of[rows, row_least]] = True
    chosen[zone_of[column_least, columns]] = True
    return chosen, total
