"""DTW, B-DTW and the path: the least total, and among equal totals the fewest cells."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import bidirectional_dtw_distance, dtw_distance, dtw_path
from tests.distances import naive
from tests.distances.strategies import SEEDS, costs, zoned_costs

# Costs are rounded to a share of the greatest; those under 2^-960 more coarsely, down to nothing.
SHARE, COARSE = 1e-12, 2.0**-960

DISTANCES = (dtw_distance, bidirectional_dtw_distance)
MATRICES = st.one_of(costs(longest=12), zoned_costs())


def near(expected, cost, share=SHARE):
    return pytest.approx(expected, rel=0, abs=share * np.max(cost) + COARSE)


@settings(max_examples=100, deadline=None)
@given(costs(longest=5))
def test_agrees_with_every_path_looked_at(cost):
    total, cells = naive.dtw_by_enumeration(cost)
    assert naive.dtw_key(cost) == pytest.approx((total, cells), rel=1e-12)
    assert dtw_distance(cost) == near(total / cells, cost)
    assert len(dtw_path(cost)) == cells


@settings(max_examples=200, deadline=None)
@given(MATRICES)
def test_agrees_with_the_definition(cost):
    assert dtw_distance(cost) == near(naive.dtw(cost), cost)
    assert bidirectional_dtw_distance(cost) == near(naive.b_dtw(cost), cost)


@settings(max_examples=100, deadline=None)
@given(MATRICES)
def test_same_bits_transposed_and_turned_around(cost):
    assert dtw_distance(cost) == dtw_distance(cost.T) == dtw_distance(cost[::-1, ::-1])
    both = bidirectional_dtw_distance(cost)
    assert both == bidirectional_dtw_distance(cost.T) == bidirectional_dtw_distance(cost[:, ::-1])
    assert both == min(dtw_distance(cost), dtw_distance(cost[:, ::-1]))


@settings(max_examples=100, deadline=None)
@given(costs(longest=12), st.integers(-500, 500))
def test_the_unit_only_scales(cost, power):
    cost = cost / (cost.max() or 1.0)
    for distance in DISTANCES:
        assert distance(cost * 2.0**power) == distance(cost) * 2.0**power
    np.testing.assert_array_equal(dtw_path(cost * 2.0**power), dtw_path(cost))


@settings(max_examples=100, deadline=None)
@given(MATRICES)
def test_path_has_the_least_total_and_the_fewest_cells(cost):
    path = [tuple(cell) for cell in dtw_path(cost).tolist()]
    total, cells = naive.dtw_key(cost)
    assert naive.is_path(path, *cost.shape)
    assert len(path) == cells
    assert sum(cost[cell] for cell in path) == pytest.approx(total, rel=1e-11)
    assert path == naive.dtw_path(cost)


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.sampled_from([(1, 3000), (3000, 1), (2, 5000), (700, 3), (5, 300)]), st.booleans())
def test_very_long_against_very_short(seed, shape, whole):
    rng = np.random.default_rng(seed)
    cost = rng.integers(0, 3, size=shape).astype(np.float64) if whole else rng.random(shape)
    total, cells = naive.dtw_key(cost)
    assert dtw_distance(cost) == near(total / cells, cost, share=2e-10)
    assert bidirectional_dtw_distance(cost) == near(naive.b_dtw(cost), cost, share=2e-10)
    path = [tuple(cell) for cell in dtw_path(cost).tolist()]
    assert naive.is_path(path, *shape)
    assert len(path) == cells


def test_shortest_of_equal_totals_counts():
    # From corner to corner: 1+0+1+1 over the edge, or 1+1+1 and one cell fewer through the middle.
    cost = np.array([[1.0, 0.0, 9.0], [9.0, 1.0, 1.0], [9.0, 9.0, 1.0]])
    assert dtw_distance(cost) == 1.0
    np.testing.assert_array_equal(dtw_path(cost), [[0, 0], [1, 1], [2, 2]])
    np.testing.assert_array_equal(dtw_path(np.zeros((2, 3))), [[0, 0], [0, 1], [1, 2]])
    np.testing.assert_array_equal(dtw_path(np.zeros((3, 2))), [[0, 0], [1, 0], [2, 1]])
    assert dtw_distance([[1.0, 0.0], [3.0, 0.0]]) == pytest.approx(1 / 2)


def test_path_tie_rule_prefers_the_diagonal_then_the_first_clip():
    # Two paths of total 2 and four cells each end by a step in the first clip, or in the second.
    cost = np.array([[0.0, 9.0, 9.0], [9.0, 0.0, 1.0], [9.0, 1.0, 9.0], [9.0, 9.0, 1.0]])
    np.testing.assert_array_equal(dtw_path(cost), [[0, 0], [1, 1], [2, 1], [3, 2]])
    np.testing.assert_array_equal(dtw_path([[0, 9], [0, 9], [0, 0]]), [[0, 0], [1, 0], [2, 1]])


@pytest.mark.parametrize("value", [0.0, 1.0, 0.1, 5e-324, 1e-300, 1e-270, 3e300])
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (4, 6), (70, 200)])
def test_constant_costs(shape, value):
    cost = np.full(shape, value)
    for distance in DISTANCES:
        assert distance(cost) == near(value, cost)
    assert len(dtw_path(cost)) == max(shape)


@pytest.mark.parametrize("largest", [1e-5, 1.0, 1e5])
def test_small_costs_beside_a_large_one_keep_their_share(largest):
    # 60 frames: a path that avoids the one large cost is right to within 2^-46 of it.
    cost = np.random.default_rng(2).random((60, 60)) * 1e-6
    cost[-1, 0] = largest
    assert dtw_distance(cost) == pytest.approx(naive.dtw(cost), rel=0, abs=2.0**-46 * cost.max())


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


@pytest.mark.parametrize(("over", "rounded"), [((0, 1, 1), 1), ((0, 0, 1), 0), ((0, 1), 1)])
def test_a_mean_is_rounded_to_the_nearest_quantum_and_halves_up(over, rounded):
    """Costs just under 1 are kept as multiples of 2^-52."""
    quanta = 2**52 - 4
    cost = [[(quanta + one) * 2.0**-52 for one in over]]
    assert dtw_distance(cost) == (quanta + rounded) * 2.0**-52
