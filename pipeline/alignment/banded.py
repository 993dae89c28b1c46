"""Warping paths inside a window, whose costs alone are computed, and paths that pay for standing still.

    gamma(i, j) = d(i, j) + min(gamma(i-1, j-1), K gamma(i-1, j), K gamma(i, j-1)),    both ends fixed

At slope weight K = 1 this is DTW, in the exact totals of `motionary.pipeline.distances.dtw_path`. K > 1 makes
straight steps dear [ADTW, *Constrained DTW*; Keogh & Pazzani's slope weighting]. It multiplies all that has
been *accumulated*, not the cost of the cell: a long stay grows like K^length, beyond any float after some
hundred frames, so totals carry an exponent of their own and never overflow. It also means that a straight
step is the dearer the later it comes, and costs nothing while nothing has been accumulated: where the lengths
differ, the path does most of its standing still at the beginning. The rival, K times the cell's own cost
[Sakoe & Chiba 1978], knows no such difference. Among paths of equal total the shortest counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_clips, pack_clips
from motionary.pipeline.distances.fixed_point import refuse_too_long

MOST_SLOPE_WEIGHT = 2.0**256  # times a total below that it stays finite


def banded_path(
    a: ArrayLike, b: ArrayLike, first: ArrayLike, last: ArrayLike, slope_weight: float = 1.0
) -> NDArray[np.int64]:
    """Find the path of least total among those that keep to a window.

    Parameters
    ----------
    a : array (m, d)
        First clip, one frame a row.
    b : array (n, d)
        Second clip.
    first, last : array (m,) of int
        The columns that each row may visit, inclusive. Time and memory go with their number.
    slope_weight : float
        K, from 1 to 2^256.

    Returns
    -------
    array (L, 2) of int
        Frames of the first and of the second clip, from (0, 0) to (m - 1, n - 1). With all cells in the
        window and K = 1 the path of `motionary.pipeline.distances.dtw_path`.

    Raises
    ------
    ValueError
        The clips cannot be compared or are too long (m + n above 2^19), the window does not fit them or
        leaves no path, or K is out of its range.
    """
    from motionary.pipeline.alignment import banded_kernels as kernels

    if not 1 <= slope_weight <= MOST_SLOPE_WEIGHT:
        raise ValueError(
            f"slope_weight is {slope_weight}; it multiplies what straight steps cost, "
            f"from 1 to {MOST_SLOPE_WEIGHT:g}"
        )
    one, other = checked_clips([a, b], ["a", "b"])
    m, n = len(one), len(other)
    refuse_too_long(m, n)
    low, high = _checked_window(first, last, m, n)
    ends = np.cumsum(high - low + 1)
    starts, cells = ends - (high - low + 1), int(ends[-1])
    costs, steps = np.empty(cells), np.empty(cells, dtype=np.int8)
    kernels.fill_costs(pack_clips([one]).rows, pack_clips([other]).lanes, low, high, starts, costs)
    if slope_weight == 1:
        words = np.empty(cells, dtype=np.int64)
        kernels.accumulate_exactly(costs, n, low, high, starts, words, steps)
    else:
        kernels.accumulate_weighted(costs, n, low, high, starts, float(slope_weight), steps)
    path = np.empty((m + n - 1, 2), dtype=np.int64)
    begin = kernels.trace_back(n, low, starts, steps, path)
    if begin < 0:
        raise ValueError(
            f"the window leaves no path through {m} and {n} frames: from one row to the next "
            "its columns must overlap or touch; widen it"
        )
    return path[begin:]


def _checked_window(
    first: ArrayLike, last: ArrayLike, m: int, n: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    low, high = np.asarray(first), np.asarray(last)
    for name, columns in (("first", low), ("last", high)):
        if columns.shape != (m,) or columns.dtype.kind not in "iu":
            raise ValueError(
                f"{name} has shape {columns.shape} and type {columns.dtype}; "
                f"a window has one whole number for each of {m} frames"
            )
    wrong = np.flatnonzero((low < 0) | (low > high) | (high >= n))
    if wrong.size:
        row = int(wrong[0])
        raise ValueError(
            f"the window goes from column {low[row]} to {high[row]} in row {row}; "
            f"it needs a column or more within 0 to {n - 1}"
        )
    if low[0] != 0 or high[-1] != n - 1:
        raise ValueError(
            f"the window goes from column {low[0]} to {high[-1]}; "
            f"both ends are fixed, so it must go from 0 to {n - 1}"
        )
    return low.astype(np.int64), high.astype(np.int64)
