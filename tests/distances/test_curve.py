"""The DTW-Curve, its weighted sum and its range."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from motionary.pipeline.distances import (
    THRESHOLDS,
    bidirectional_dtw_distance,
    dtw_curve,
    fuzzy_distance,
    random_thresholds,
    segment_dtw_distance,
    weighted_distance,
)
from tests.distances import naive
from tests.distances.strategies import costs, zoned_costs

MATRICES = st.one_of(costs(longest=14), zoned_costs(longest=30))
LAMBDAS = st.one_of(st.sampled_from([0.0, 0.3, 0.7, 1.0, *THRESHOLDS]), st.floats(0, 1))


def test_thresholds_are_the_midpoints_and_one():
    assert THRESHOLDS == (0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0)


@settings(max_examples=100, deadline=None)
@given(st.one_of(costs(longest=10), zoned_costs(longest=16)))
def test_agrees_with_the_definition(cost):
    tolerance = 1e-12 * cost.max() + 2.0**-960  # costs below this are rounded to nothing
    np.testing.assert_allclose(dtw_curve(cost), naive.curve(cost), rtol=0, atol=tolerance)


@settings(max_examples=100, deadline=None)
@given(MATRICES, st.lists(LAMBDAS, min_size=1, max_size=8))
def test_a_point_does_not_depend_on_the_other_points(cost, lambdas):
    single = [segment_dtw_distance(cost, threshold) for threshold in lambdas]
    np.testing.assert_array_equal(dtw_curve(cost, lambdas), single)


@settings(max_examples=80, deadline=None)
@given(MATRICES)
def test_same_bits_with_the_motions_exchanged_or_reversed(cost):
    curve = dtw_curve(cost)
    for other in (cost.T, cost[:, ::-1], cost[::-1], np.asfortranarray(cost)):
        np.testing.assert_array_equal(dtw_curve(other), curve)
    assert curve[-1] == bidirectional_dtw_distance(cost)


@settings(max_examples=60, deadline=None)
@given(st.one_of(costs(longest=12), zoned_costs()), st.integers(-500, 500))
def test_the_unit_only_scales(cost, power):
    cost = cost / (cost.max() or 1.0)
    np.testing.assert_array_equal(dtw_curve(cost * 2.0**power), dtw_curve(cost) * 2.0**power)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (4, 6)])
@pytest.mark.parametrize("value", [0.0, 2.5])
def test_constant_costs_are_one_zone(shape, value):
    np.testing.assert_array_equal(dtw_curve(np.full(shape, value)), np.full(8, value))
    assert fuzzy_distance(dtw_curve(np.full(shape, value))) == (value, value)


def test_identical_clips_are_at_distance_zero():
    frames = np.random.default_rng(1).random((12, 3))
    assert dtw_curve(naive.euclidean(frames, frames))[-1] == 0


def test_a_region_can_appear_inside_one_that_reaches_all_four_sides():
    # A cross of cost 1 is the only zone, the whole matrix, until a cell in a corner becomes one too: either
    # touches the one row segment and the one column segment, and the cell is the cheaper.
    cost = np.full((9, 9), 10.0)
    cost[4], cost[:, 4], cost[1, 1] = 1.0, 1.0, 5.0
    assert naive.zones(cost, 0.3) == [(0, 8, 0, 8)]
    assert naive.zones(cost, 0.5) == [(0, 8, 0, 8), (1, 1, 1, 1)]
    np.testing.assert_allclose(dtw_curve(cost, [0.3, 0.5, 1.0]), [76 / 9, 5, 76 / 9])


@pytest.mark.parametrize("distance", [64, 128, 192])
def test_a_zone_that_grows_from_one_threshold_to_the_next_is_weighed_again(distance):
    row = np.full((1, 300), 10.0)
    row[0, : 6 + distance] = 4.0
    row[0, :6] = 0.0
    for cost in (row, row.T, row[:, ::-1], row[:, ::-1].T):
        np.testing.assert_allclose(dtw_curve(cost, [0.3, 0.5]), [0.0, 4 * distance / (6 + distance)])


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(LAMBDAS, st.floats(0, 1e6)), min_size=1, max_size=10))
def test_weighted_and_fuzzy_follow_their_definitions(points):
    lambdas, curve = zip(*points, strict=True)
    assert weighted_distance(curve, lambdas) == pytest.approx(naive.weighted(curve, lambdas), rel=1e-13)
    assert fuzzy_distance(curve) == (min(curve), max(curve))


def test_weights_are_the_gaussian():
    peak = 0.1 / (0.3 * math.sqrt(2 * math.pi))
    assert weighted_distance([2.0], [0.7]) == pytest.approx(2 * peak)
    assert weighted_distance([1.0], [0.4]) == pytest.approx(peak * math.exp(-0.5))
    assert weighted_distance([1.0, 1.0, 1.0], [0.2, 0.3, 1.0]) == 0
    # The sum stands for the integral of W over (.3, 1).
    assert weighted_distance(np.ones(8)) == pytest.approx(
        norm.cdf(1, 0.7, 0.3) - norm.cdf(0.3, 0.7, 0.3), abs=3e-3
    )


def test_random_thresholds_lie_one_in_each_interval():
    assert random_thresholds(7) == random_thresholds(7) != random_thresholds(8)
    drawn = np.array([random_thresholds(seed) for seed in range(2000)])
    assert (drawn[:, 7] == 1.0).all()
    place = drawn[:, :7] - (0.3 + np.arange(7) / 10)  # in an interval open below and closed above
    assert (place > 0).all()
    assert (place <= 0.1 + 1e-15).all()
    np.testing.assert_allclose(place.mean(axis=0), 0.05, atol=0.003)
    assert (np.ptp(place, axis=0) > 0.099).all()


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
