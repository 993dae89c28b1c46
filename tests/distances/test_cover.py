"""S-DTW as the least edge cover: graphs drawn first, and then a cost matrix whose zones are their edges."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import segment_dtw_distance, similar_zones
from tests.distances import naive
from tests.distances.strategies import SEEDS

THRESHOLD = 0.5


@st.composite
def graphs(draw, most_nodes, most_weight=1000):
    """Edges (row, column, whole weight) in which every row and every column has one."""
    rows, columns = draw(st.integers(1, most_nodes)), draw(st.integers(1, most_nodes))
    rng = np.random.default_rng(draw(SEEDS))
    kept = rng.random((rows, columns)) < draw(st.sampled_from([0.0, 0.05, 0.2, 0.5, 1.0]))
    kept[np.arange(rows), rng.integers(columns, size=rows)] = True
    kept[rng.integers(rows, size=columns), np.arange(columns)] = True
    weights = rng.integers(0, draw(st.sampled_from([1, 3, most_weight])), size=kept.shape, endpoint=True)
    return [(int(u), int(v), int(weights[u, v])) for u, v in np.argwhere(kept)]


def cost_of(edges):
    """A matrix with one low cell an edge, none touching another: node k is the segment of frame 2 k."""
    rows, columns, weights = (np.array(column) for column in zip(*edges, strict=True))
    cost = np.full((2 * rows.max() + 1, 2 * columns.max() + 1), 3.0 * weights.max() + 3)
    cost[2 * rows, 2 * columns] = weights
    return cost


def edges_of_zones(cost):
    return [(top // 2, left // 2, int(cost[top, left])) for top, _, left, _ in similar_zones(cost, THRESHOLD)]


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=3))
def test_agrees_with_every_subset_of_edges(edges):
    cost = cost_of(edges)
    assert edges_of_zones(cost) == edges
    assert segment_dtw_distance(cost, THRESHOLD) == naive.cover_by_enumeration(edges)


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=14))
def test_agrees_with_an_integer_programme(edges):
    assert segment_dtw_distance(cost_of(edges), THRESHOLD) == naive.cover_by_integer_programme(edges)


@settings(max_examples=40, deadline=None)
@given(graphs(most_nodes=40, most_weight=2**30))
def test_hundreds_of_zones_agree_with_scipys_assignment(edges):
    cost = cost_of(edges)
    expected = naive.cover_by_assignment(edges)
    assert segment_dtw_distance(cost, THRESHOLD) == expected == segment_dtw_distance(cost.T, THRESHOLD)


@settings(max_examples=60, deadline=None)
@given(graphs(most_nodes=4))
def test_references_agree(edges):
    covers = {naive.cover_by_integer_programme(edges), naive.cover_by_assignment(edges)}
    if len(edges) <= 10:
        covers.add(naive.cover_by_enumeration(edges))
    assert len(covers) == 1


@pytest.mark.parametrize("rows", [1, 2, 30])
@pytest.mark.parametrize("columns", [1, 40])
def test_full_graphs_of_equal_weights_need_the_larger_side(rows, columns):
    edges = [(u, v, 7) for u in range(rows) for v in range(columns)]
    assert segment_dtw_distance(cost_of(edges), THRESHOLD) == 7 * max(rows, columns)


def test_worked_example():
    # The schematic of [DC] figure 2: three segments of M, four of N, five zones, one cell each, that weigh
    # M1-N2 .1, M2-N1 .2, M3-N3 .3, M2-N4 .5, M3-N4 .4. All but one are needed; N4 takes the lighter of two.
    cost = np.full((5, 7), 10.0)
    cost[0, 2], cost[2, 0], cost[4, 4], cost[2, 6], cost[4, 6] = 0.1, 0.2, 0.3, 0.5, 0.4
    assert len(naive.segment_edges(cost, 0.35)) == 5
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


def test_a_chain_of_better_choices_is_followed_to_its_end():
    # Taking the lightest zone of each segment in turn is wrong by one at every second node of the ring.
    nodes = 20
    edges = [(k, (k + side) % nodes, 2 + side) for k in range(nodes) for side in (0, 1)]
    assert segment_dtw_distance(cost_of(edges), THRESHOLD) == 2 * nodes
    edges[0] = (0, 0, 3 * nodes)  # now the whole ring has to turn
    assert segment_dtw_distance(cost_of(edges), THRESHOLD) == min(3 * nodes, 2 * (nodes - 1) + 3 + 3)
