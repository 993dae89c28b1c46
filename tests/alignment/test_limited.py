from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.limited import limited_dtw
from motionary.pipeline.distances import cost_matrix
from motionary.pipeline.evaluation import longest_stay


def least_total(cost: np.ndarray, most: int) -> float:
    """Try every path, from its end, remembering how long it has been straight."""

    @cache
    def least(i: int, j: int, down: int, across: int) -> float:
        if (i, j) == (0, 0):
            return cost[0, 0]
        ways = [np.inf]
        if i and j:
            ways.append(least(i - 1, j - 1, 0, 0))
        if i and down < most:
            ways.append(least(i - 1, j, down + 1, 0))
        if j and across < most:
            ways.append(least(i, j - 1, 0, across + 1))
        return cost[i, j] + min(ways)

    return least(cost.shape[0] - 1, cost.shape[1] - 1, 0, 0)


@given(m=st.integers(1, 14), n=st.integers(1, 14), most=st.integers(1, 3), seed=st.integers(0, 10_000))
@settings(max_examples=80, deadline=None)
def test_the_path_is_the_least_of_those_allowed(m: int, n: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(m, 2)), rng.normal(size=(n, 2))
    cost = cost_matrix(moving, reference)
    expected = least_total(cost, most)
    if np.isinf(expected):
        with pytest.raises(
            ValueError, match=f"at most {most} steps in a row .* {m} moving and {n} reference"
        ):
            limited_dtw(moving, reference, most=most)
        return
    path = limited_dtw(moving, reference, most=most).path
    steps = np.diff(path, axis=0)
    assert ((steps >= 0) & (steps <= 1)).all()
    assert (path[0].tolist(), path[-1].tolist()) == ([0, 0], [m - 1, n - 1])
    assert cost[tuple(path.T)].sum() == pytest.approx(expected)
    # A stay of the other kind may follow, so runs are counted along each axis by themselves.
    for axis in (0, 1):
        still = "".join("s" if step[axis] == 0 else " " for step in steps)
        assert max(map(len, still.split(" "))) <= most


def test_without_a_need_to_stand_still_it_is_dtw() -> None:
    values = np.random.default_rng(0).normal(size=(50, 3)).cumsum(axis=0)
    np.testing.assert_array_equal(limited_dtw(values, values).path, dtw(values, values).path)
    assert longest_stay(limited_dtw(values[::2], values).path) <= 2


def test_weights_are_of_squared_differences() -> None:
    rng = np.random.default_rng(4)
    moving, reference = rng.normal(size=(31, 3)).cumsum(axis=0), rng.normal(size=(37, 3)).cumsum(axis=0)
    weights = np.array([4.0, 0.0, 0.25])
    found = limited_dtw(moving, reference, weights).path
    scaled = moving[:, [0, 2]] * [2, 0.5], reference[:, [0, 2]] * [2, 0.5]
    np.testing.assert_array_equal(found, limited_dtw(*scaled).path)
    assert not np.array_equal(found, limited_dtw(moving, reference).path)
    with pytest.raises(ValueError, match="weights have shape"):
        limited_dtw(moving, reference, np.ones(2))


@pytest.mark.parametrize("size", [1e-300, 1e-170, 1e140])
def test_the_unit_changes_nothing(size: float) -> None:
    rng = np.random.default_rng(3)
    moving, reference = rng.normal(size=(31, 3)).cumsum(axis=0), rng.normal(size=(37, 3)).cumsum(axis=0)
    found = limited_dtw(size * moving, size * reference).path
    np.testing.assert_array_equal(found, limited_dtw(moving, reference).path)


def test_what_would_fill_the_memory_is_refused() -> None:
    long = np.zeros((20_000, 1))
    with pytest.raises(
        ValueError,
        match="20000 moving and 20000 reference frames: 2000000000 ways .* resample or cut the clips",
    ):
        limited_dtw(long, long)
    with pytest.raises(ValueError, match="121 each, and at most 1073741824 .*, or allow fewer steps"):
        limited_dtw(long[:3000], long[:3000], most=60)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="most is 0"):
        limited_dtw(np.zeros((3, 1)), np.zeros((3, 1)), most=0)
    with pytest.raises(ValueError, match="moving holds inf"):
        limited_dtw(np.full((3, 1), np.inf), np.zeros((3, 1)))
