import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from motionary.pipeline.distances import bidirectional_dtw_distance, dtw_curve, segment_dtw_distance
from motionary.pipeline.distances.edge_cover import least_cover
from motionary.pipeline.distances.fixed_point import UNREACHED
from tests.distances import naive
from tests.distances.strategies import costs


@st.composite
def graphs(draw, most_nodes, most_weight):
    """Lightest edges between rows and columns; every node has one."""
    rows, columns = draw(st.integers(1, most_nodes)), draw(st.integers(1, most_nodes))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    weights = rng.integers(0, draw(st.sampled_from([3, most_weight])), size=(rows, columns))
    kept = rng.random((rows, columns)) < draw(st.sampled_from([0.2, 0.5, 1.0]))
    kept[np.arange(rows), rng.integers(columns, size=rows)] = True
    kept[rng.integers(rows, size=columns), np.arange(columns)] = True
    return np.where(kept, weights, UNREACHED)


def edges_of(weights):
    return [(int(u), int(v), int(weights[u, v])) for u, v in np.argwhere(weights < UNREACHED)]


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=3, most_weight=1000))
def test_cover_agrees_with_every_subset_of_edges(weights):
    assert least_cover(weights.copy()) == naive.cover_by_enumeration(edges_of(weights))


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=9, most_weight=1000))
def test_cover_agrees_with_an_integer_programme(weights):
    assert least_cover(weights.copy()) == naive.cover_by_integer_programme(edges_of(weights))


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=40, most_weight=2**45))
def test_cover_agrees_with_scipys_assignment(weights):
    # Every node has a copy on the other side: it is matched across, or with its copy at its cheapest edge.
    rows, columns = weights.shape
    size = rows + columns
    large = 1e30
    costs = np.full((size, size), large)
    costs[:rows, :columns] = np.where(weights < UNREACHED, weights, large)
    costs[np.arange(rows), columns + np.arange(rows)] = weights.min(axis=1)
    costs[rows + np.arange(columns), np.arange(columns)] = weights.min(axis=0)
    costs[rows:, columns:] = 0
    chosen = linear_sum_assignment(costs)
    assert least_cover(weights.copy()) == pytest.approx(costs[chosen].sum(), rel=1e-12)


@settings(max_examples=200, deadline=None)
@given(costs(longest=10), st.sampled_from([0.0, 0.2, 0.35, 0.45, 0.55, 0.75, 0.95, 1.0]))
def test_agrees_with_the_definition(cost, threshold):
    expected = naive.segment_dtw(cost, threshold)
    assert segment_dtw_distance(cost, threshold) == pytest.approx(expected, rel=1e-8, abs=1e-12 * cost.max())


@settings(max_examples=60, deadline=None)
@given(costs(longest=12))
def test_is_b_dtw_at_one(cost):
    assert segment_dtw_distance(cost, 1.0) == bidirectional_dtw_distance(cost)


def test_worked_example():
    # The schematic of [DC] figure 2: three segments of M, four of N, five zones, one cell each, that weigh
    # M1-N2 .1, M2-N1 .2, M3-N3 .3, M2-N4 .5, M3-N4 .4. All but one are needed; N4 takes the lighter of two.
    cost = np.full((5, 7), 10.0)
    cost[0, 2], cost[2, 0], cost[4, 4], cost[2, 6], cost[4, 6] = 0.1, 0.2, 0.3, 0.5, 0.4
    edges = naive.segment_edges(cost, 0.35)
    assert len(edges) == 5
    assert segment_dtw_distance(cost, 0.35) == pytest.approx(0.1 + 0.2 + 0.3 + 0.4, rel=1e-12)
    cost[2, 6], cost[4, 6] = 0.4, 0.5
    assert segment_dtw_distance(cost, 0.35) == pytest.approx(0.1 + 0.2 + 0.3 + 0.4, rel=1e-12)
    cost[2, 6], cost[4, 6] = 0.7, 0.8
    assert segment_dtw_distance(cost, 0.35) == pytest.approx(0.1 + 0.2 + 0.3 + 0.7, rel=1e-12)


def test_one_zone_may_serve_both_its_segments():
    # Cheapest at each node alone would cost 3 + 3; the two zones on the diagonal cover all four segments.
    cost = np.full((3, 3), 9.0)
    cost[0, 0], cost[0, 2], cost[2, 0], cost[2, 2] = 2.0, 1.0, 1.0, 0.5
    assert segment_dtw_distance(cost, 0.3) == pytest.approx(2.0)
    cost[0, 0], cost[2, 2] = 0.5, 1.2
    assert segment_dtw_distance(cost, 0.3) == pytest.approx(0.5 + 1.2)


def test_zones_that_share_a_frame_share_a_segment():
    # Rows 0-1 and 1-2 overlap in row 1: one row segment, so each of the two column segments costs one zone.
    cost = np.full((3, 5), 9.0)
    cost[0:2, 0] = 1.0
    cost[1:3, 4] = 2.0
    assert segment_dtw_distance(cost, 0.3) == pytest.approx(3.0)
    # Adjacent but disjoint intervals are two segments; the sum is the same, the number of nodes is not.
    assert naive.segments([(0, 1), (1, 2)]) == [0, 0]
    assert len(set(naive.segments([(0, 1), (2, 3)]))) == 2


def test_many_zones_outgrow_what_is_remembered():
    cost = np.random.default_rng(0).random((60, 90))
    expected = naive.cover_by_integer_programme(naive.segment_edges(cost, 0.2))
    assert segment_dtw_distance(cost, 0.2) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("distance", [64, 128, 192])
def test_what_is_remembered_of_a_zone_is_not_taken_for_another(distance):
    # A zone and the one it grows into, that differ by a multiple of the places for remembering.
    row = np.full((1, 300), 10.0)
    row[0, : 6 + distance] = 4.0
    row[0, :6] = 0.0
    for cost in (row, row.T, row[:, ::-1], row[:, ::-1].T):
        np.testing.assert_allclose(dtw_curve(cost, [0.3, 0.5]), [0.0, 4 * distance / (6 + distance)])
