import numpy as np
import pytest
from hypothesis import given, settings

from motionary.pipeline.distances import bidirectional_dtw_distance, dtw_distance, dtw_path
from tests.distances import naive
from tests.distances.strategies import costs


@settings(max_examples=60, deadline=None)
@given(costs(longest=5))
def test_references_agree(cost):
    total, cells = naive.dtw_by_enumeration(cost)
    assert naive.dtw_key(cost) == pytest.approx((total, cells), rel=1e-12)


@settings(max_examples=200, deadline=None)
@given(costs(longest=9))
def test_agrees_with_the_definition(cost):
    assert dtw_distance(cost) == pytest.approx(naive.dtw(cost), rel=1e-9)
    assert bidirectional_dtw_distance(cost) == pytest.approx(naive.b_dtw(cost), rel=1e-9)


@settings(max_examples=100, deadline=None)
@given(costs(longest=9))
def test_same_bits_transposed_and_turned_around(cost):
    assert dtw_distance(cost) == dtw_distance(cost.T) == dtw_distance(cost[::-1, ::-1])
    backward = bidirectional_dtw_distance(cost)
    assert backward == bidirectional_dtw_distance(cost.T) == bidirectional_dtw_distance(cost[:, ::-1])
    assert backward == min(dtw_distance(cost), dtw_distance(cost[:, ::-1]))


@settings(max_examples=100, deadline=None)
@given(costs(longest=9))
def test_path_is_one_of_the_best(cost):
    path = dtw_path(cost)
    steps = {tuple(step) for step in np.diff(path, axis=0)}
    assert tuple(path[0]) == (0, 0)
    assert tuple(path[-1]) == (cost.shape[0] - 1, cost.shape[1] - 1)
    assert steps <= {(1, 1), (1, 0), (0, 1)}
    total, cells = naive.dtw_key(cost)
    assert len(path) == cells
    assert cost[tuple(path.T)].sum() == pytest.approx(total, rel=1e-9)


def test_shortest_of_equal_totals_counts():
    # From corner to corner: 0+1+0+0 over the edge, or 1+0 and one cell fewer through the middle.
    cost = np.array([[1.0, 0.0, 9.0], [9.0, 1.0, 0.0], [9.0, 9.0, 1.0]])
    assert dtw_distance(cost) == pytest.approx(2 / 4)
    np.testing.assert_array_equal(dtw_path(np.zeros((2, 3))), [[0, 0], [0, 1], [1, 2]])
    np.testing.assert_array_equal(dtw_path(np.zeros((3, 2))), [[0, 0], [1, 0], [2, 1]])
    assert dtw_distance([[1.0, 0.0], [3.0, 0.0]]) == pytest.approx(1 / 2)


def test_path_tie_rule_prefers_the_diagonal_then_the_first_clip():
    # Two paths of total 2 and four cells each end by a step in the first clip, or in the second.
    cost = np.array([[0.0, 9.0, 9.0], [9.0, 0.0, 1.0], [9.0, 1.0, 9.0], [9.0, 9.0, 1.0]])
    np.testing.assert_array_equal(dtw_path(cost), [[0, 0], [1, 1], [2, 1], [3, 2]])
    np.testing.assert_array_equal(dtw_path([[0, 9], [0, 9], [0, 0]]), [[0, 0], [1, 0], [2, 1]])


@pytest.mark.parametrize("value", [0.0, 1.0, 0.1, 5e-324, 1e-300, 3e300])
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (4, 6), (70, 200)])
def test_constant_costs(shape, value):
    tolerance = 1e-9 if value > 1e-290 else 1
    assert dtw_distance(np.full(shape, value)) == pytest.approx(value, rel=tolerance)


def test_long_clips_keep_their_precision():
    rng = np.random.default_rng(3)
    cost = rng.random((300, 250)) + 1e-3
    assert dtw_distance(cost) == pytest.approx(naive.dtw(cost), rel=1e-10)
    row = rng.random((1, 60_000))
    assert dtw_distance(row) == pytest.approx(row.mean(), rel=1e-8)


@pytest.mark.parametrize(
    ("cost", "message"),
    [
        (np.zeros((0, 2)), r"shape \(0, 2\)"),
        (np.zeros(3), r"shape \(3,\)"),
        ([[0, np.nan]], "nan at row 0, column 1"),
        ([[0], [np.inf]], "inf at row 1, column 0"),
        ([[-1.0]], "-1.0 at row 0, column 0"),
        (np.zeros((1, 2**19)), "at most 524287"),
    ],
)
@pytest.mark.parametrize("function", [dtw_distance, dtw_path, bidirectional_dtw_distance])
def test_refuses_what_is_no_cost_matrix(function, cost, message):
    with pytest.raises(ValueError, match=message):
        function(cost)
