"""DTW-Curve: S-DTW at several thresholds, and the distances made of it [DC 4.3, 5].

    weighted = sum over lambda of 0.1 W(lambda) S-DTW(lambda)                      (eq. 7, as a sum)
    W(x) = exp(-(x - .7)^2 / (2 sigma^2)) / (sigma sqrt(2 pi)),  sigma = .3        (eq. 8)
         = 0 up to .3, and at 1
    fuzzy = [min, max] of the curve over all thresholds                            (eq. 10)

The paper splits (.3, 1] into seven intervals of width .1 and draws one lambda in each; we take the midpoints,
so that a distance is the same from run to run (`random_thresholds` draws), and add lambda = 1, where S-DTW is
B-DTW and W is zero.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import checked_costs, filled_up
from motionary.pipeline.distances.fixed_point import refuse_too_long
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.segment_dtw import make_workspace, prepare, segment_quanta
from motionary.pipeline.distances.zones import checked_thresholds, limit_of

# Midpoints of the paper's intervals above .3, and 1.
THRESHOLDS = (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0)
# Mean and deviation of W, and the width of an interval of lambda (eq. 8).
MEAN, DEVIATION, WIDTH = 0.7, 0.3, 0.1


def random_thresholds(seed: int) -> tuple[float, ...]:
    """Draw one lambda in each of the paper's seven intervals (.3, .4] .. (.9, 1], and add 1.

    Parameters
    ----------
    seed : int
        Of the draw; the same seed gives the same thresholds.

    Returns
    -------
    tuple of 8 float
        Ascending.
    """
    # The generator draws from [0, 1); an interval is open below and closed above.
    drawn = (np.arange(4, 11) - np.random.default_rng(seed).random(7)) / 10
    return (*drawn.tolist(), 1.0)


def dtw_curve(cost: ArrayLike, thresholds: ArrayLike = THRESHOLDS) -> NDArray[np.float64]:
    """S-DTW at each threshold (the DTW-Curve of [DC] 4.3).

    Parameters
    ----------
    cost : array (m, n)
        Finite costs, not negative.
    thresholds : sequence of float
        lambda, each 0 to 1, in any order.

    Returns
    -------
    array (len(thresholds),)
        In the unit of the costs; the same bits for the transposed matrix.

    Raises
    ------
    ValueError
        `cost` is not a matrix of finite costs or too long, or a threshold is outside 0 .. 1.
    """
    costs = checked_costs(cost)
    m, n = costs.shape
    refuse_too_long(m, n)
    lambdas = checked_thresholds(thresholds)
    curve = np.empty(len(lambdas))
    fill_curve(filled_up(costs), m, n, costs.min(), costs.max(), lambdas, curve, make_workspace(m, n))
    return curve


def weighted_distance(curve: ArrayLike, thresholds: ArrayLike = THRESHOLDS) -> float:
    """Sum of the curve, each value weighed by 0.1 W(lambda) (eq. 7-8).

    Parameters
    ----------
    curve : array (T,)
        S-DTW at each threshold.
    thresholds : sequence of float (T,)
        Their lambda; those up to .3, and 1, have weight zero.

    Returns
    -------
    float
        In the unit of the costs.

    Raises
    ------
    ValueError
        The lengths differ, or a threshold is outside 0 .. 1.
    """
    values, lambdas = np.asarray(curve, dtype=np.float64), checked_thresholds(thresholds)
    if values.shape != lambdas.shape:
        raise ValueError(
            f"curve has shape {values.shape} and thresholds {lambdas.shape}; give one value a threshold"
        )
    return float(weighted_sums(values, lambdas))


def fuzzy_distance(curve: ArrayLike) -> tuple[float, float]:
    """Return the least and the greatest value of the curve (eq. 10).

    Parameters
    ----------
    curve : array (T,)
        S-DTW at each threshold.

    Returns
    -------
    low, high : float
        In the unit of the costs.

    Raises
    ------
    ValueError
        The curve is empty or not one-dimensional.
    """
    values = np.asarray(curve, dtype=np.float64)
    if values.ndim != 1 or values.size == 0:
        raise ValueError(f"curve has shape {values.shape}; it is one value a threshold, at least one")
    return float(values.min()), float(values.max())


def weighted_sums(curves: NDArray[np.float64], thresholds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted distance of every curve (..., T); one term after the other, so that no shape changes a bit."""
    total = np.zeros(curves.shape[:-1])
    for index, threshold in enumerate(thresholds):
        total += WIDTH * _weight(threshold) * curves[..., index]
    return total


def _weight(threshold: float) -> float:
    if not 0.3 < threshold < 1:
        return 0.0
    return math.exp(-((threshold - MEAN) ** 2) / (2 * DEVIATION**2)) / (DEVIATION * math.sqrt(2 * math.pi))


@kernel
def fill_curve(costs, m, n, low, high, thresholds, curve, work):  # type: ignore[no-untyped-def]
    """Fill `curve` (T,) from costs (rows, width), of which (m, n) count; return their DTW and their B-DTW."""
    ahead, back, quantum, length_bits = prepare(costs, m, n, high, work)
    dtw, b_dtw = ahead * quantum, min(ahead, back) * quantum
    for t in range(len(thresholds)):
        if thresholds[t] == 1.0:
            curve[t] = b_dtw
        else:
            limit = limit_of(low, high, thresholds[t])
            curve[t] = segment_quanta(costs, m, n, limit, length_bits, work) * quantum
    return dtw, b_dtw
