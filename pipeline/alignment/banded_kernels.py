"""The compiled kernels of paths inside a window: see `motionary.pipeline.alignment.banded`.

The cells of a window lie row by row, row i from `starts[i]` on, its first cell in column `first[i]`. Either
recurrence writes into `steps` where the best path to a cell comes from, and whether it can be reached at all;
`trace_back` follows that from the last cell.
"""

from __future__ import annotations

from math import frexp, ldexp

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.distances.cost import frame_distances
from motionary.pipeline.distances.fixed_point import UNREACHED, pack
from motionary.pipeline.distances.lanes import LANES, ROWS
from motionary.pipeline.motion import FloatArray

Integers = NDArray[np.int64]
Steps = NDArray[np.int8]

BOTH, DOWN, ACROSS, BEGIN, NOWHERE = range(5)
_NEVER = 1 << 60  # an exponent above all others
_TOP = 2.0**256  # totals keep below it,
_LOWERED = 2.0**-512  # and are multiplied by this as often as their exponent says

_kernel = njit(cache=True, nogil=True, error_model="numpy")


@_kernel
def fill_costs(
    rows: FloatArray,
    lanes: FloatArray,
    first: Integers,
    last: Integers,
    starts: Integers,
    costs: NDArray[np.float64],
) -> None:
    """Fill the costs of a window's cells, as `cost_matrix` has them, from clips laid out by `pack_clips`."""
    m = len(first)
    for top in range(0, m, ROWS):
        bottom = min(top + ROWS, m)
        begin, end = first[top:bottom].min() // LANES, last[top:bottom].max() // LANES + 1
        strip = np.empty((ROWS, (end - begin) * LANES), dtype=rows.dtype)
        frame_distances(rows[top : top + ROWS], lanes[begin:end], strip, np.empty((2, LANES), rows.dtype))
        for i in range(top, bottom):
            for j in range(first[i], last[i] + 1):
                costs[starts[i] + j - first[i]] = strip[i - top, j - begin * LANES]


@_kernel
def accumulate_exactly(
    costs: NDArray[np.float64],
    n: int,
    first: Integers,
    last: Integers,
    starts: Integers,
    words: Integers,
    steps: Steps,
) -> None:
    """Accumulate costs as packed integers: the least (total, length), as `dtw_path` has it."""
    m = len(first)
    pack(costs, m, n, costs.max(), words)
    for i in range(m):
        for j in range(first[i], last[i] + 1):
            cell = starts[i] + j - first[i]
            if i == 0 and j == 0:
                steps[cell] = BEGIN
                continue
            least, step = UNREACHED, NOWHERE
            if i > 0 and first[i - 1] < j <= last[i - 1] + 1:
                least, step = words[starts[i - 1] + j - 1 - first[i - 1]], BOTH
            if i > 0 and first[i - 1] <= j <= last[i - 1]:
                above = words[starts[i - 1] + j - first[i - 1]]
                if above < least:
                    least, step = above, DOWN
            if j > first[i] and words[cell - 1] < least:
                least, step = words[cell - 1], ACROSS
            if least < UNREACHED:
                words[cell] += least
                steps[cell] = step
            else:
                words[cell] = UNREACHED
                steps[cell] = NOWHERE


@_kernel
def accumulate_weighted(
    costs: NDArray[np.float64],
    n: int,
    first: Integers,
    last: Integers,
    starts: Integers,
    slope_weight: float,
    steps: Steps,
) -> None:
    """Accumulate costs, those behind a straight step times the slope weight, at any magnitude.

    A total is value * 2^(512 exponent), the value below 2^256 and, where the exponent is not 0, not below
    2^-256, so that totals compare as (exponent, value). Costs are scaled to 1 at most: to a total with an
    exponent they add nothing that it could hold. Of two rows the totals and lengths are kept by column.
    """
    values, exponents = np.zeros((2, n)), np.full((2, n), _NEVER)
    lengths = np.zeros((2, n), dtype=np.int64)
    scale = ldexp(1.0, -max(frexp(costs.max())[1], -1000))
    for i in range(len(first)):
        here, above = i % 2, 1 - i % 2
        exponents[here] = _NEVER
        for j in range(first[i], last[i] + 1):
            cell = starts[i] + j - first[i]
            value, exponent, length, step = 0.0, _NEVER, 0, NOWHERE
            if i == 0 and j == 0:
                exponent, step = 0, BEGIN
            if i > 0 and j > 0 and exponents[above, j - 1] < _NEVER:
                value, exponent = values[above, j - 1], exponents[above, j - 1]
                length, step = lengths[above, j - 1], BOTH
            for straight in (DOWN, ACROSS):
                row, column = (above, j) if straight == DOWN else (here, j - 1)
                if (i if straight == DOWN else j) == 0 or exponents[row, column] == _NEVER:
                    continue
                heavier, power = _brought_down(values[row, column] * slope_weight, exponents[row, column])
                lower = power < exponent or (power == exponent and heavier < value)
                equal = power == exponent and heavier == value
                if lower or (equal and lengths[row, column] < length):
                    value, exponent, length, step = heavier, power, lengths[row, column], straight
            steps[cell] = step
            if step != NOWHERE:
                if exponent == 0:
                    value, exponent = _brought_down(value + costs[cell] * scale, exponent)
                values[here, j], exponents[here, j], lengths[here, j] = value, exponent, length + 1


@_kernel
def trace_back(n: int, first: Integers, starts: Integers, steps: Steps, path: Integers) -> int:
    """Fill `path` from its end; return the row where it begins, -1 where the last cell is not reached."""
    i, j = len(first) - 1, n - 1
    place = len(path)
    while True:
        step = steps[starts[i] + j - first[i]]
        if step == NOWHERE:
            return -1
        place -= 1
        path[place, 0], path[place, 1] = i, j
        if step == BEGIN:
            return place
        if step != ACROSS:
            i -= 1
        if step != DOWN:
            j -= 1


@_kernel
def _brought_down(value: float, exponent: int) -> tuple[float, int]:
    """Return the same total with a value below the top."""
    while value >= _TOP:
        value, exponent = value * _LOWERED, exponent + 1
    return value, exponent
