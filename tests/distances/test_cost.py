"""Cost matrices: within a few roundings of the exact distance, and a cell from its two frames alone."""

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import cost_matrix, dtw_distance
from tests.distances import naive
from tests.distances.strategies import SEEDS, frame_pairs


def roundings_allowed(d):
    """Error of a cell in units of its dtype's epsilon: d + 2 roundings of the square, and one of its root.

    A difference is rounded once and squared (3 halves of epsilon), d - 1 additions follow (a half each), and
    the root halves the error of what it is taken of.
    """
    return (d + 4) / 4


def worst_error(costs, a, b):
    """Greatest relative error of a cell in units of epsilon; equal frames must be at exactly 0."""
    worst = Decimal(0)
    for (i, j), cost in np.ndenumerate(costs):
        exact = naive.distance(a[i], b[j])
        assert cost == 0 or exact > 0
        if exact > 0:
            worst = max(worst, abs(Decimal(float(cost)) / exact - 1))
    return float(worst) / np.finfo(costs.dtype).eps


@settings(max_examples=80, deadline=None)
@given(frame_pairs(longest=8))
def test_every_cell_is_within_its_roundings(pair):
    a, b = pair
    costs = cost_matrix(a, b)
    assert costs.dtype == a.dtype
    assert worst_error(costs, a, b) <= roundings_allowed(a.shape[1])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("d", [1, 54, 59, 130])
def test_near_frames_far_from_the_origin_keep_their_digits(d, dtype):
    # The expansion |f|^2 + |g|^2 - 2 f.g has none left here.
    rng = np.random.default_rng(d)
    a = (1e3 + rng.normal(size=(20, d))).astype(dtype)
    b = np.nextafter(a, dtype(np.inf) * rng.choice([-1, 1], size=a.shape).astype(dtype))
    b[:, : d // 2] = a[:, : d // 2]
    assert worst_error(cost_matrix(a, b), a, b) <= roundings_allowed(d)
    np.testing.assert_array_equal(np.diag(cost_matrix(a, a)), 0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("d", [1, 3, 59, 130])
def test_features_near_the_limits_of_their_dtype(d, dtype):
    largest = np.nextafter(np.sqrt(np.finfo(dtype).max / dtype(5 * d)), dtype(0))
    signs = np.random.default_rng(d).choice([-1, 1], size=(6, d)).astype(dtype)
    # The least whose square is a normal number, with room for the roundings.
    for size in (largest, np.sqrt(np.finfo(dtype).tiny) * dtype(2)):
        a, b = size * signs, size * signs[::-1]
        costs = cost_matrix(a, b)
        assert np.isfinite(costs).all()
        assert worst_error(costs, a, b) <= roundings_allowed(d)
    np.testing.assert_array_equal(np.diag(cost_matrix(dtype(1e-44) * signs, dtype(1e-44) * signs)), 0)


@settings(max_examples=60, deadline=None)
@given(frame_pairs(longest=90), st.data())
def test_a_cell_depends_on_its_two_frames_alone(pair, data):
    a, b = pair
    whole = cost_matrix(a, b)
    np.testing.assert_array_equal(cost_matrix(b, a), whole.T)
    rows = data.draw(st.lists(st.integers(0, len(a) - 1), min_size=1, max_size=40))
    columns = data.draw(st.lists(st.integers(0, len(b) - 1), min_size=1, max_size=40))
    np.testing.assert_array_equal(cost_matrix(a[rows], b[columns]), whole[np.ix_(rows, columns)])
    row, column = data.draw(st.sampled_from(rows)), data.draw(st.sampled_from(columns))
    np.testing.assert_array_equal(cost_matrix(a[row : row + 3], b[column:]), whole[row : row + 3, column:])
    assert cost_matrix(a[[row]], b[[column]]) == whole[row, column] == cost_matrix(b[[column]], a[[row]])


@settings(max_examples=20, deadline=None)
@given(SEEDS, st.integers(1, 130), st.sampled_from([(1, 700), (700, 1), (130, 257), (65, 64)]))
def test_shape_does_not_change_a_cell(seed, d, shape):
    rng = np.random.default_rng(seed)
    a, b = (rng.normal(size=(frames, d)).astype(np.float32) for frames in shape)
    whole = cost_matrix(a, b)
    i, j = (int(rng.integers(frames)) for frames in shape)
    np.testing.assert_array_equal(cost_matrix(a[[i]], b)[0], whole[i])
    np.testing.assert_array_equal(cost_matrix(b[[j]], a)[0], whole[:, j])


@settings(max_examples=30, deadline=None)
@given(frame_pairs(longest=12, dtypes=(np.float32,)))
def test_float32_is_float64_within_its_roundings(pair):
    a, b = pair
    tolerance = (roundings_allowed(a.shape[1]) + 1) * np.finfo(np.float32).eps
    np.testing.assert_allclose(cost_matrix(a, b), cost_matrix(a.astype(np.float64), b), rtol=tolerance)


def test_one_float64_clip_makes_it_float64():
    a, b = np.ones((3, 5), np.float32), np.zeros((4, 5))
    assert cost_matrix(a, b).dtype == np.float64
    assert cost_matrix([[0, 0]], [[3, 4]]) == [[5.0]]


def test_layout_in_memory_does_not_matter():
    rng = np.random.default_rng(1)
    a, b = (rng.normal(size=(frames, 59)).astype(np.float32) for frames in (12, 9))
    np.testing.assert_array_equal(cost_matrix(np.asfortranarray(a), b[::-1])[:, ::-1], cost_matrix(a, b))


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        (np.zeros((0, 3)), np.zeros((2, 3)), r"a has shape \(0, 3\)"),
        (np.zeros((2, 3)), np.zeros(3), r"b has shape \(3,\)"),
        (np.zeros((2, 3)), np.zeros((2, 0)), r"b has shape \(2, 0\)"),
        (np.zeros((2, 3)), np.zeros((2, 4)), "b has 4 dimensions and a has 3"),
        (np.zeros((2, 3)), [[0, 0, 0], [0, np.nan, 0]], "b holds nan at frame 1, dimension 1"),
        ([[np.inf]], [[0]], "a holds inf at frame 0, dimension 0"),
        (np.float32([[1e19]]), np.float32([[0]]), "larger than"),
    ],
)
def test_refuses_what_cannot_be_compared(a, b, message):
    with pytest.raises(ValueError, match=message):
        cost_matrix(a, b)


def test_a_cost_that_could_be_rounded_to_infinity_is_refused():
    assert dtw_distance([[2.0**1023]]) == 2.0**1023
    with pytest.raises(ValueError, match=r"holds 1\.79.*e\+308 at row 0, column 1; .* at most 2\^1023"):
        dtw_distance([[1.0, np.finfo(float).max]])
