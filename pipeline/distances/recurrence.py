"""The recurrence of dynamic time warping, over a rectangle of packed costs, from any of its corners.

    T(i, j) = D(i, j) + min(T(i-1, j-1), T(i-1, j), T(i, j-1))

with i and j counted from the corner. Every cell waits for the one beside it, three cycles long, in which the
processor could do the work of another; so two recurrences always run side by side: forward and backward, or
the two halves of one that meet in the middle (totals are exact, so a path is the sum of its parts).

Cells are flat places in the array of words. A corner is where to start, and by how much a step along a row
and along a column moves. Places are unsigned, steps back are two's complement: Numba then does not ask of
every place whether it counts from the end.
"""

from __future__ import annotations

import numpy as np

from motionary.pipeline.distances.fixed_point import UNREACHED
from motionary.pipeline.distances.kernel import kernel

ZERO, ONE = np.uint64(0), np.uint64(1)


@kernel
def both_ways(words, width, top, bottom, left, right, ahead, back, pitch):  # type: ignore[no-untyped-def]
    """Least totals of a rectangle (inclusive), its columns taken forward and backward.

    To take columns backward is to take rows backward and the path from its end, so both recurrences start
    at the left: `ahead` at the top and `back` at the bottom. Row r of T goes to `ahead` and to `back` from
    place r * pitch; with pitch 0 only the last one stays.
    """
    down, rows, columns = np.uint64(width), np.uint64(bottom - top + 1), np.uint64(right - left + 1)
    first, last = np.uint64(top * width + left), np.uint64(bottom * width + left)
    return _side_by_side(
        words, first, down, last, ZERO - down, ONE, rows, columns, ahead, back, np.uint64(pitch)
    )


@kernel
def forward(words, width, top, bottom, left, right, ahead, back):  # type: ignore[no-untyped-def]
    """Least total of a rectangle (inclusive), from its top left to its bottom right."""
    down, start, end = np.uint64(width), np.uint64(top * width + left), np.uint64(bottom * width + right)
    return _from_both_ends(words, start, end, down, bottom - top + 1, right - left + 1, ahead, back)


@kernel
def backward(words, width, top, bottom, left, right, ahead, back):  # type: ignore[no-untyped-def]
    """Least total of a rectangle (inclusive), from its bottom left to its top right."""
    up, start, end = ZERO - np.uint64(width), np.uint64(bottom * width + left), np.uint64(top * width + right)
    return _from_both_ends(words, start, end, up, bottom - top + 1, right - left + 1, ahead, back)


@kernel
def _from_both_ends(words, start, end, row_step, rows, columns, ahead, back):  # type: ignore[no-untyped-def]
    """Least total from `start` to `end`: the two halves of the rows, each from its end, and where they meet.

    `ahead` and `back` hold one row of T each.
    """
    half, last = (rows + 1) // 2, columns - 1
    _side_by_side(
        words, start, row_step, end, ZERO - row_step, ZERO - ONE,
        np.uint64(half), np.uint64(columns), ahead, back, ZERO,
    )  # fmt: skip
    least = UNREACHED
    if rows % 2:
        # Both halves hold the middle row, whose cell counts once.
        middle = start + np.uint64(half - 1) * row_step
        for j in range(columns):
            least = min(least, ahead[j] + back[last - j] - words[middle + np.uint64(j)])
    else:
        for j in range(last):
            least = min(least, ahead[j] + min(back[last - j], back[last - j - 1]))
        least = min(least, ahead[last] + back[0])
    return least


@kernel
def _side_by_side(words, start_a, row_a, start_b, row_b, column_b, rows, columns, a, b, pitch):  # type: ignore[no-untyped-def]
    """Run two recurrences over `rows` rows and `columns` columns; return T at the last cell of each.

    The first takes its columns forward, the second as `column_b` says: every value less in the inner loop is
    one less that the processor's sixteen registers must hold. Row r of T goes to `a` and `b` from place
    r * pitch, where the row below it reads it; with pitch 0 each row overwrites the one above it.
    """
    total_a = total_b = np.int64(0)
    here_b = start_b
    for j in range(columns):
        total_a += words[start_a + j]
        total_b += words[here_b]
        a[j], b[j] = total_a, total_b
        here_b += column_b
    above = ZERO
    for _ in range(ONE, rows):
        start_a += row_a
        start_b += row_b
        here_b, row = start_b, above + pitch
        total_a = total_b = diagonal_a = diagonal_b = np.int64(UNREACHED)
        for j in range(columns):
            above_a, above_b = a[above + j], b[above + j]
            # The cell beside comes last: it is the one that everything waits for.
            total_a = min(diagonal_a, above_a, total_a) + words[start_a + j]
            total_b = min(diagonal_b, above_b, total_b) + words[here_b]
            a[row + j], b[row + j] = total_a, total_b
            diagonal_a, diagonal_b = above_a, above_b
            here_b += column_b
        above = row
    return total_a, total_b
