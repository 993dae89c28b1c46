import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import cost_matrix
from tests.distances import naive


def pair(seed, m, n, d, dtype=np.float32):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(m, d)).astype(dtype), rng.normal(size=(n, d)).astype(dtype)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float32, 3e-6), (np.float64, 1e-14)])
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 5, 59), (16, 17, 54), (33, 2, 4)])
def test_agrees_with_the_definition(shape, dtype, tolerance):
    a, b = pair(0, *shape, dtype)
    costs = cost_matrix(a, b)
    assert costs.dtype == dtype
    np.testing.assert_allclose(costs, naive.euclidean(a, b), rtol=tolerance)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 80), st.integers(1, 80), st.integers(1, 70), st.data())
def test_a_cell_depends_on_its_two_frames_alone(seed, m, n, d, data):
    a, b = pair(seed, m, n, d)
    whole = cost_matrix(a, b)
    rows = data.draw(st.lists(st.integers(0, m - 1), min_size=1, max_size=40))
    columns = data.draw(st.lists(st.integers(0, n - 1), min_size=1, max_size=40))
    np.testing.assert_array_equal(cost_matrix(a[rows], b[columns]), whole[np.ix_(rows, columns)])
    np.testing.assert_array_equal(cost_matrix(b, a), whole.T)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 70), st.floats(-1e4, 1e4))
def test_equal_frames_cost_nothing_and_close_ones_keep_their_distance(seed, m, d, offset):
    a = (pair(seed, m, m, d)[0] + np.float32(offset)).astype(np.float32)
    np.testing.assert_array_equal(np.diag(cost_matrix(a, a)), 0)
    moved = a.copy()
    moved[:, 0] = np.nextafter(a[:, 0], np.float32(np.inf))
    expected = moved[:, 0].astype(np.float64) - a[:, 0]
    np.testing.assert_allclose(np.diag(cost_matrix(a, moved)), expected, rtol=1e-6, atol=1e-22)


def test_one_float64_clip_makes_it_float64():
    a, b = pair(0, 3, 4, 5)
    assert cost_matrix(a, b.astype(np.float64)).dtype == np.float64
    assert cost_matrix([[0, 0]], [[3, 4]]) == [[5.0]]


def test_layout_in_memory_does_not_matter():
    a, b = pair(1, 12, 9, 59)
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
