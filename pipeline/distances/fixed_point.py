"""Exact totals: costs as integers, each packed with a count of one into a single 64-bit word.

A warping path is judged by (total cost, number of cells), in that order. Floating-point totals depend on the
order of addition, so that equal ones may come out different; here a cost c becomes the integer

    q = round(c / quantum),    quantum = a power of two, about max(D) / 2^value_bits
    word = q * 2^length_bits + 1

Sums of words are exact, compare as (total, length), and mean the same in whatever order they are formed.
`length_bits` holds the longest path, m + n - 1 cells; `value_bits` = min(52, 62 - 2 length_bits), so that no
total exceeds 62 bits: 48 bits of cost for clips of 60 frames, 30 for clips of 20,000. Every cost is within
half a quantum of its own value, and the mean along any path within one, whatever the unit. Totals closer
than that count as equal, and the shorter of such paths is taken.

The rival is one quantum for all matrices: it overflows on costs in millimetres or loses those in kilometres.
"""

from __future__ import annotations

import math

import numpy as np

from motionary.pipeline.distances.kernel import kernel

# Above every total; with one total added it is still a 64-bit integer, but not twice itself.
UNREACHED = 1 << 62
# A 64-bit float holds integers, and integers and a half, exactly below this power of two.
MOST_VALUE_BITS = 52
# The floats from 2^52 to 2^53 are the integers; as a 64-bit integer, 2^52 reads so.
INTEGERS, INTEGER_BITS = 2.0**52, 0x433 << 52
# Longest path for which a cost keeps 24 bits, the precision of the float32 it was computed in.
MOST_LENGTH_BITS = 19


def refuse_too_long(rows: int, columns: int) -> None:
    """Raise ValueError where a path through (rows, columns) could have more cells than can be summed."""
    if rows + columns - 1 >= 1 << MOST_LENGTH_BITS:
        raise ValueError(
            f"{rows} and {columns} frames: up to {rows + columns - 1} cells on a path, and at most "
            f"{(1 << MOST_LENGTH_BITS) - 1} can be summed exactly; resample or cut the clips"
        )


@kernel
def _length_bits(frames_a, frames_b):  # type: ignore[no-untyped-def]
    """Bits that hold the number of cells of the longest path, m + n - 1."""
    bits = 1
    while (frames_a + frames_b - 1) >> bits:
        bits += 1
    return bits


@kernel
def _quantum(largest, length_bits):  # type: ignore[no-untyped-def]
    """Power of two that brings the largest cost just under 2^value_bits."""
    if largest == 0:
        return 1.0
    value_bits = min(MOST_VALUE_BITS, 62 - 2 * length_bits)
    # Well above 2^-1022, so that one over it stays finite; smaller costs are rounded more coarsely.
    return math.ldexp(1.0, max(math.frexp(largest)[1] - value_bits, -960))


@kernel
def pack(costs, m, n, greatest, words):  # type: ignore[no-untyped-def]
    """Fill `words` (cells,) int64 from `costs` (cells,) of clips of m and n frames, none above `greatest`.

    Returns the quantum and the bits of a path's length.
    """
    length_bits = _length_bits(m, n)
    quantum = _quantum(greatest, length_bits)
    per_quantum = 1.0 / quantum
    for cell in range(len(words)):
        # Adding 2^52 rounds to the nearest integer, which then stands in the low bits: few processors convert
        # several floats to 64-bit integers at once, all add them.
        rounded = np.float64(costs[cell] * per_quantum + INTEGERS).view(np.int64)
        words[cell] = ((rounded - INTEGER_BITS) << length_bits) + 1
    return quantum, length_bits


@kernel
def mean_quanta(total, length_bits):  # type: ignore[no-untyped-def]
    """Total cost over number of cells of a path's word, in quanta, rounded to the nearest, halves up."""
    length = total & ((1 << length_bits) - 1)
    return ((total >> length_bits) + (length >> 1)) // length
