import math

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.stats import norm

from motionary.pipeline.distances import (
    THRESHOLDS,
    dtw_curve,
    fuzzy_distance,
    random_thresholds,
    segment_dtw_distance,
    weighted_distance,
)
from tests.distances import naive
from tests.distances.strategies import costs


def test_thresholds_are_the_midpoints_and_one():
    assert THRESHOLDS == (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0)


@settings(max_examples=100, deadline=None)
@given(costs(longest=10))
def test_agrees_with_the_definition(cost):
    np.testing.assert_allclose(dtw_curve(cost), naive.curve(cost), rtol=1e-8, atol=1e-12 * cost.max())


@settings(max_examples=60, deadline=None)
@given(costs(longest=14))
def test_a_point_does_not_depend_on_the_other_points(cost):
    curve = dtw_curve(cost)
    np.testing.assert_array_equal(curve, [segment_dtw_distance(cost, t) for t in THRESHOLDS])
    np.testing.assert_array_equal(curve[::-1], dtw_curve(cost, THRESHOLDS[::-1]))


@settings(max_examples=60, deadline=None)
@given(costs(longest=14))
def test_same_bits_transposed_or_reversed(cost):
    curve = dtw_curve(cost)
    np.testing.assert_array_equal(curve, dtw_curve(cost.T))
    np.testing.assert_array_equal(curve, dtw_curve(cost[:, ::-1]))


def test_doubling_the_unit_doubles_the_curve():
    cost = np.random.default_rng(5).random((20, 30))
    np.testing.assert_array_equal(dtw_curve(1024 * cost), 1024 * dtw_curve(cost))
    np.testing.assert_allclose(dtw_curve(1e9 * cost), 1e9 * dtw_curve(cost), rtol=1e-9)


def test_identical_clips_are_at_distance_zero():
    frames = np.random.default_rng(1).random((12, 3))
    cost = naive.euclidean(frames, frames)
    assert dtw_curve(cost)[-1] == 0
    assert fuzzy_distance(dtw_curve(np.zeros((4, 6)))) == (0.0, 0.0)


def test_a_region_can_appear_inside_one_that_reaches_all_four_sides():
    # A cross of cost 1 is the only zone, the whole matrix, until a cell in a corner becomes one too: either
    # touches the one row segment and the one column segment, and the cell is the cheaper.
    cost = np.full((9, 9), 10.0)
    cost[4], cost[:, 4], cost[1, 1] = 1.0, 1.0, 5.0
    assert naive.zones(cost, 0.3) == [(0, 8, 0, 8)]
    assert naive.zones(cost, 0.5) == [(0, 8, 0, 8), (1, 1, 1, 1)]
    np.testing.assert_allclose(dtw_curve(cost, [0.3, 0.5, 1.0]), [76 / 9, 5, 76 / 9])


def test_weights_are_the_gaussian():
    peak = 0.1 / (0.3 * math.sqrt(2 * math.pi))
    assert weighted_distance([2.0], [0.7]) == pytest.approx(2 * peak)
    assert weighted_distance([1.0], [0.4]) == pytest.approx(peak * math.exp(-0.5))
    assert weighted_distance([1.0, 1.0, 1.0], [0.2, 0.3, 1.0]) == 0
    curve = np.random.default_rng(0).random(8)
    assert weighted_distance(curve) == pytest.approx(naive.weighted(curve))
    # The sum stands for the integral of W over (.3, 1).
    assert weighted_distance(np.ones(8)) == pytest.approx(
        norm.cdf(1, 0.7, 0.3) - norm.cdf(0.3, 0.7, 0.3), abs=3e-3
    )


def test_fuzzy_is_the_range_of_all_eight():
    assert fuzzy_distance([3.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 4.0]) == (1.0, 4.0)


def test_random_thresholds_lie_one_in_each_interval():
    assert random_thresholds(7) == random_thresholds(7) != random_thresholds(8)
    for seed in range(50):
        drawn = random_thresholds(seed)
        assert len(drawn) == 8
        assert drawn[-1] == 1.0
        assert all(0.3 + k / 10 < t <= 0.4 + k / 10 + 1e-15 for k, t in enumerate(drawn[:7]))


def test_refuses_what_does_not_fit():
    with pytest.raises(ValueError, match="threshold is 1.5"):
        dtw_curve([[0.0]], [0.5, 1.5])
    with pytest.raises(ValueError, match=r"thresholds have shape \(0,\)"):
        dtw_curve([[0.0]], [])
    with pytest.raises(ValueError, match=r"curve has shape \(2,\) and thresholds \(8,\)"):
        weighted_distance([1.0, 2.0])
    with pytest.raises(ValueError, match=r"curve has shape \(0,\)"):
        fuzzy_distance([])
    with pytest.raises(ValueError, match="nan at row 0"):
        dtw_curve([[np.nan]])
