"""What one core can do at best: a matrix product, and the recurrence with its costs at hand.

Our kernels' times are given as shares of these two, measured in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
from numba import njit

PRODUCT_SIDE = 2048
REPEATS = 9
LANES = (16, 32, 64, 128)
FRAMES = 64


@dataclass(frozen=True)
class Limits:
    """Best rates of one core.

    Parameters
    ----------
    product_flops : float
        Floating-point operations a second of a float32 product of square matrices (side `PRODUCT_SIDE`).
    stacked_product_flops : float
        The same where the inner dimension is the features'.
    recurrence_cells : float
        Cells a second of T(i, j) = D(i, j) + min of three neighbours, float32, many matrices side by side,
        everything in the first-level cache.
    lanes : int
        Matrices side by side at which that was fastest.
    """

    product_flops: float
    stacked_product_flops: float
    recurrence_cells: float
    lanes: int

    def product_seconds(self, cells: int, dimensions: int) -> float:
        """Time of the multiplications and additions that the cells' inner products take."""
        return 2.0 * cells * dimensions / self.product_flops

    def recurrence_seconds(self, cells: int, directions: int) -> float:
        """Time of the recurrence over the cells."""
        return directions * cells / self.recurrence_cells


def measure_limits(dimensions: int, repeats: int = REPEATS) -> Limits:
    """Measure both limits on this core, now."""
    rates = {lanes: _recurrence_rate(lanes, repeats) for lanes in LANES}
    lanes = max(rates, key=lambda one: rates[one])
    return Limits(
        _product_rate(PRODUCT_SIDE, repeats), _product_rate(dimensions, repeats), rates[lanes], lanes
    )


def _product_rate(inner: int, repeats: int) -> float:
    rng = np.random.default_rng(0)
    a = rng.random((PRODUCT_SIDE, inner), dtype=np.float32)
    b = rng.random((inner, PRODUCT_SIDE), dtype=np.float32)
    out = np.empty((PRODUCT_SIDE, PRODUCT_SIDE), dtype=np.float32)
    return 2.0 * PRODUCT_SIDE**2 * inner / _median_seconds(lambda: np.matmul(a, b, out=out), repeats)


def _recurrence_rate(lanes: int, repeats: int) -> float:
    costs = np.random.default_rng(0).random((FRAMES, lanes), dtype=np.float32)
    row = np.full_like(costs, np.inf)
    left, diagonal = np.empty_like(costs[0]), np.empty_like(costs[0])
    passes = 20
    seconds = _median_seconds(lambda: recurrence(costs, passes * FRAMES, row, left, diagonal), repeats)
    return passes * FRAMES * FRAMES * lanes / seconds


def _median_seconds(job: Callable[[], object], repeats: int) -> float:
    job()
    samples = []
    for _ in range(repeats):
        began = time.perf_counter()
        job()
        samples.append(time.perf_counter() - began)
    return median(samples)


@njit(nogil=True)
def recurrence(costs, rows, row, left, diagonal):  # type: ignore[no-untyped-def]
    """Accumulate `rows` rows of the same costs (width, lanes) into `row` (width, lanes), infinite at first.

    The inner loop runs over the lanes, whose matrices share nothing, so that it becomes vector instructions.
    """
    width, lanes = costs.shape
    for i in range(rows):
        for lane in range(lanes):
            left[lane] = np.inf
            diagonal[lane] = np.inf if i else 0.0
        for j in range(width):
            for lane in range(lanes):
                above = row[j, lane]
                least = left[lane] if left[lane] < diagonal[lane] else diagonal[lane]
                least = above if above < least else least
                diagonal[lane] = above
                left[lane] = least + costs[j, lane]
                row[j, lane] = left[lane]
