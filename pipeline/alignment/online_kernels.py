"""The compiled kernels of online alignment: see `motionary.pipeline.alignment.online`.

Rows are prerecorded frames from the last one shown on, columns are live frames. The prerecorded rotations lie
joint by joint and component by component, time last, so that a column is filled by whole vectors of rows.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from motionary.pipeline.motion import FloatArray

_kernel = njit(cache=True, nogil=True, error_model="numpy")
_inner_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
_TOLERANCE = 1e-3  # files print quaternions to a few digits

_DEGREE = 20
_SERIES = np.polynomial.Chebyshev.interpolate(
    lambda z: 4 / np.pi * np.arcsin(np.sqrt(z)) / np.sqrt(z), _DEGREE, domain=[0.0, 0.5]
)
# By powers of 4 z - 1, the highest first; arcsin itself would keep the loop over rows from being vectorised.
_POWERS = np.polynomial.chebyshev.cheb2poly(_SERIES.coef)[::-1].copy()


@_kernel
def normalise(quaternions: FloatArray, out: FloatArray) -> int:
    """Fill `out` (n, 4) by quaternions of length 1; return which is not nearly of that length, or -1."""
    for row in range(len(quaternions)):
        x, y, z, w = quaternions[row, 0], quaternions[row, 1], quaternions[row, 2], quaternions[row, 3]
        length = np.sqrt(x * x + y * y + z * z + w * w)
        if not abs(length - 1.0) <= _TOLERANCE:  # nor is what is not a number
            return row
        for k in range(4):
            out[row, k] = quaternions[row, k] / length
    return -1


@_kernel
def extrapolate(shown: FloatArray, elapsed: int) -> None:
    """Fill `shown` (frames, J, 4) from its third frame on, by the turn from the first to the second.

    `elapsed` is the number of frames between those two; every joint goes on at that rate.
    """
    for joint in range(shown.shape[1]):
        before, now = shown[0, joint], shown[1, joint]
        # before^-1 now, of its two quaternions the one of the shorter turn.
        x = before[3] * now[0] - before[0] * now[3] - before[1] * now[2] + before[2] * now[1]
        y = before[3] * now[1] - before[1] * now[3] - before[2] * now[0] + before[0] * now[2]
        z = before[3] * now[2] - before[2] * now[3] - before[0] * now[1] + before[1] * now[0]
        w = before[3] * now[3] + before[0] * now[0] + before[1] * now[1] + before[2] * now[2]
        if _is_other_sign(x, y, z, w):
            x, y, z, w = -x, -y, -z, -w
        # From angle to angle, so that its length is 1: forecasts of forecasts would magnify what is amiss.
        sine = np.sqrt(x * x + y * y + z * z)
        angle = np.arctan2(sine, w) / elapsed
        scale = np.sin(angle) / sine if sine > 0.0 else 0.0
        x, y, z, w = x * scale, y * scale, z * scale, np.cos(angle)
        for frame in range(2, len(shown)):
            last, after = shown[frame - 1, joint], shown[frame, joint]
            after[0] = last[3] * x + last[0] * w + last[1] * z - last[2] * y
            after[1] = last[3] * y + last[1] * w + last[2] * x - last[0] * z
            after[2] = last[3] * z + last[2] * w + last[0] * y - last[1] * x
            after[3] = last[3] * w - last[0] * x - last[1] * y - last[2] * z


@_kernel
def _is_other_sign(x: float, y: float, z: float, w: float) -> bool:
    """Tell q from -q, half a turn's too."""
    if w != 0.0:
        return w < 0.0
    if x != 0.0:
        return x < 0.0
    return y < 0.0 if y != 0.0 else z < 0.0


@_kernel
def match_frame(
    planes: FloatArray, start: int, live: FloatArray, costs: FloatArray, least: int, most: int
) -> int:
    """Return the advance, of `least` to `most`, to the frame nearest to the live one [FP Algorithm 1]."""
    fill_costs(planes, start, most + 1, live, costs)
    return _cheapest(costs[0], least, most)


@_kernel
def plot_path(
    planes: FloatArray, start: int, rows: int, live: FloatArray, costs: FloatArray, least: int, most: int
) -> int:
    """Return the lowest row that the path from the far corner meets in the second column [FP Algorithm 2].

    Paths may enter that column in rows `least` to `most` alone.
    """
    fill_costs(planes, start, rows, live, costs)
    for row in range(1, rows):
        costs[0, row] += costs[0, row - 1]
    costs[1, 0] = costs[1, 0] + costs[0, 0] if least == 0 else np.inf
    for row in range(1, rows):
        before = min(costs[0, row - 1], costs[0, row]) if row <= most else np.inf
        costs[1, row] += min(before, costs[1, row - 1])
    for column in range(2, len(live)):
        costs[column, 0] += costs[column - 1, 0]
        for row in range(1, rows):
            before = min(costs[column - 1, row - 1], costs[column - 1, row])
            costs[column, row] += min(before, costs[column, row - 1])
    # The path stays or advances beside the corner, never from it aslant: the paper sets that cell to 10,000.
    costs[0, 0] = np.inf
    row, column, met = rows - 1, len(live) - 1, 0
    while column > 0 and row > 0:
        met = row
        slanted, level, upright = costs[column - 1, row - 1], costs[column - 1, row], costs[column, row - 1]
        if column == 1 and row > most:
            slanted, level = np.inf, np.inf
        cheapest = min(slanted, level, upright)
        # Of steps that cost the same the one that ends nearest to the diagonal from the corner.
        if column > row and level == cheapest:
            column -= 1
        elif column < row and upright == cheapest:
            row -= 1
        elif slanted == cheapest:
            row, column = row - 1, column - 1
        elif level == cheapest:
            column -= 1
        else:
            row -= 1
    return met if column == 0 else 0


@_kernel
def accumulate_back(
    planes: FloatArray, start: int, rows: int, live: FloatArray, costs: FloatArray, least: int, most: int
) -> int:
    """Return the row of least cost in the first column, accumulated from the far corner [FP Algorithm 3]."""
    fill_costs(planes, start, rows, live, costs)
    last = rows - 1
    for row in range(last - 1, -1, -1):
        costs[len(live) - 1, row] += costs[len(live) - 1, row + 1]
    for column in range(len(live) - 2, -1, -1):
        costs[column, last] += costs[column + 1, last]
        for row in range(last - 1, -1, -1):
            after = min(costs[column + 1, row + 1], costs[column + 1, row])
            costs[column, row] += min(after, costs[column, row + 1])
    return _cheapest(costs[0], least, most)


@_kernel
def _cheapest(costs: FloatArray, least: int, most: int) -> int:
    """Return the cheapest of rows `least` to `most`; of equal ones that nearest to 1, then the lower."""
    best = least
    for row in range(least + 1, most + 1):
        if costs[row] < costs[best] or (costs[row] == costs[best] and abs(row - 1) < abs(best - 1)):
            best = row
    return best


@_inner_kernel
def fill_costs(planes: FloatArray, start: int, rows: int, live: FloatArray, costs: FloatArray) -> None:
    """Fill `costs` (columns, rows) by eq. 1: planes (J, 4, m) of frames from `start`, live (columns, J, 4).

    2/pi arccos |p.q| is 4/pi arcsin(c / 2) of the shorter chord c = |p - q| or |p + q|, which loses no digits
    near 0 and is exactly 0 of equal rotations.
    """
    for column in range(len(live)):
        cost = costs[column]
        for row in range(rows):
            cost[row] = 0.0
        for joint in range(len(planes)):
            frame = live[column, joint]
            x, y, z, w = frame[0], frame[1], frame[2], frame[3]
            for row in range(rows):
                a, b = planes[joint, 0, start + row], planes[joint, 1, start + row]
                c, d = planes[joint, 2, start + row], planes[joint, 3, start + row]
                sign = 1.0 if a * x + b * y + c * z + d * w >= 0.0 else -1.0
                a, b, c, d = a - sign * x, b - sign * y, c - sign * z, d - sign * w
                square = 0.25 * (a * a + b * b + c * c + d * d)
                place = 4.0 * square - 1.0
                value = 0.0
                for power in range(_DEGREE + 1):
                    value = value * place + _POWERS[power]
                cost[row] += value * np.sqrt(square)
