"""S-DTW of whole matrices: zones, segments, their weights and the cover together."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import bidirectional_dtw_distance, segment_dtw_distance
from tests.distances import naive
from tests.distances.strategies import SEEDS, costs, zoned_costs

THRESHOLDS = st.sampled_from([0.0, 0.2, 0.35, 0.45, 0.55, 0.75, 0.85, 0.95, 1.0])
SHARE, COARSE = 1e-12, 2.0**-960


def near(expected, cost):
    return pytest.approx(expected, rel=0, abs=SHARE * np.max(cost) + COARSE)


@settings(max_examples=150, deadline=None)
@given(costs(longest=10), THRESHOLDS)
def test_agrees_with_the_definition(cost, threshold):
    assert segment_dtw_distance(cost, threshold) == near(naive.segment_dtw(cost, threshold), cost)


@settings(max_examples=120, deadline=None)
@given(zoned_costs(longest=40), st.sampled_from([0.2, 0.35, 0.55, 0.85, 0.95]))
def test_agrees_with_the_definition_where_there_are_many_zones(cost, threshold):
    assert segment_dtw_distance(cost, threshold) == near(naive.segment_dtw(cost, threshold), cost)


@settings(max_examples=150, deadline=None)
@given(st.one_of(costs(longest=12), zoned_costs()), THRESHOLDS)
def test_same_bits_with_the_motions_exchanged_or_reversed(cost, threshold):
    distance = segment_dtw_distance(cost, threshold)
    for other in (cost.T, cost[:, ::-1], cost[::-1], cost[::-1, ::-1].T):
        assert segment_dtw_distance(other, threshold) == distance


@settings(max_examples=100, deadline=None)
@given(st.one_of(costs(longest=12), zoned_costs()))
def test_is_b_dtw_at_one(cost):
    assert segment_dtw_distance(cost, 1.0) == bidirectional_dtw_distance(cost)


@settings(max_examples=20, deadline=None)
@given(
    SEEDS, st.sampled_from([(1, 3000), (3000, 1), (2, 1500), (700, 3)]), st.sampled_from([0.1, 0.35, 0.65])
)
def test_very_long_against_very_short(seed, shape, threshold):
    """In a strip of at most three rows zones are many and short; each end of a strip is reached."""
    cost = np.random.default_rng(seed).random(shape) ** 0.5
    expected = naive.cover_by_assignment(naive.segment_edges(cost, threshold))
    assert segment_dtw_distance(cost, threshold) == pytest.approx(expected, rel=1e-8)


def test_zones_that_share_a_frame_share_a_segment():
    # Rows 0-1 and 1-2 overlap in row 1: one row segment, so each of the two column segments costs one zone.
    cost = np.full((3, 5), 9.0)
    cost[0:2, 0] = 1.0
    cost[1:3, 4] = 2.0
    assert segment_dtw_distance(cost, 0.3) == pytest.approx(3.0)
    # Adjacent but disjoint intervals are two segments; the sum is the same, the number of nodes is not.
    assert naive.segments([(0, 1), (1, 2)]) == [0, 0]
    assert len(set(naive.segments([(0, 1), (2, 3)]))) == 2


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize(("overlap", "expected"), [(1, 25 - 1 + 2), (0, 2 * 25 + 1)])
def test_steps_that_overlap_in_turn_are_one_segment(overlap, expected, transposed):
    # Step k, at cost 2, holds rows 2 + 2k .. 3 + 2k, and one more where they overlap; above it in its column
    # stands a cell of cost 1. One zone touches a flight in one segment, else every step is needed.
    steps = 25
    cost = np.full((2 * steps + 3, 2 * steps), 9.0)
    cost[0, ::2] = 1.0
    for k in range(steps):
        cost[2 + 2 * k : 4 + 2 * k + overlap, 2 * k] = 2.0
    edges = naive.segment_edges(cost, 0.3)
    assert len(edges) == 2 * steps
    assert len({row for row, _, _ in edges}) == (2 if overlap else 1 + steps)
    assert segment_dtw_distance(cost.T if transposed else cost, 0.3) == pytest.approx(expected)


@pytest.mark.parametrize("shape", [(60, 90), (90, 60)])
def test_hundreds_of_zones_of_any_cost(shape):
    cost = np.random.default_rng(0).random(shape)
    edges = naive.segment_edges(cost, 0.15)
    assert len(edges) > 200
    expected = naive.cover_by_integer_programme(edges)
    assert segment_dtw_distance(cost, 0.15) == pytest.approx(expected, rel=1e-9)
