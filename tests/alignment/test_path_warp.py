import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import PathWarp, dtw, mean_correlation, uniform
from motionary.pipeline.alignment.path_warp import path_warp


def mean_times(path: np.ndarray) -> list[float]:
    """Average, one reference frame after the other, the moving frames that meet it."""
    frames = range(max(int(k) for _, k in path) + 1)
    meeting = [[int(i) for i, k in path if k == frame] for frame in frames]
    return [sum(one) / len(one) for one in meeting]


def least_total(moving: np.ndarray, reference: np.ndarray, weights: np.ndarray) -> float:
    """Find the least total of weighted distances along a path, from its definition."""
    cost = np.sqrt((weights * (moving[:, None] - reference[None]) ** 2).sum(axis=2))
    total = np.full((len(moving) + 1, len(reference) + 1), np.inf)
    total[0, 0] = 0
    for i, k in np.ndindex(cost.shape):
        total[i + 1, k + 1] = cost[i, k] + min(total[i, k], total[i, k + 1], total[i + 1, k])
    return total[-1, -1]


@st.composite
def paths(draw) -> np.ndarray:
    steps = draw(st.lists(st.sampled_from([(1, 1), (1, 0), (0, 1)]), max_size=40))
    return np.cumsum([(0, 0), *steps], axis=0)


@given(path=paths(), further=st.integers(0, 3))
@settings(max_examples=80, deadline=None)
def test_a_frame_shows_the_mean_of_what_it_meets(path: np.ndarray, further: int) -> None:
    warp = path_warp(path, path[-1, 0] + 1 + further)
    np.testing.assert_array_equal(warp.source_time, mean_times(path))
    assert (np.diff(warp.source_time) >= 0).all()
    assert warp.moving_frames == path[-1, 0] + 1 + further
    np.testing.assert_array_equal(warp.path, path)


def test_a_worked_example() -> None:
    # Frames 0 and 1 meet the first reference frame, frame 2 stands still for two, 3 and 4 meet the last.
    warp = path_warp([(0, 0), (1, 0), (2, 1), (2, 2), (3, 3), (4, 3)], 5)
    assert isinstance(warp, PathWarp)
    assert warp.source_time.tolist() == [0.5, 2, 2, 3.5]
    assert warp.path.dtype == np.int64


def test_a_path_may_leap_over_moving_frames() -> None:
    assert path_warp([(1, 0), (4, 1), (4, 2)], 9).source_time.tolist() == [1, 4, 4]


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        (np.empty((0, 2), int), "at least one cell"),
        ([0, 1], "whole numbers"),
        ([(0.0, 0.0)], "float64"),
        ([(0, 0), (2, 1), (1, 2)], r"from \(2, 1\) to \(1, 2\) after cell 1"),
        ([(0, 1), (1, 0)], r"from \(0, 1\) to \(1, 0\) after cell 0"),
        ([(0, 0), (5, 1)], "joins moving frames 0 to 5; a moving sequence of 5 frames has 0 to 4"),
        ([(-1, 0), (0, 1)], "joins moving frames -1"),
        ([(0, 0), (1, 2)], "no reference frame 1"),
        ([(0, 1), (1, 2)], "no reference frame 0"),
        ([(0, -1), (1, 0)], "begins at reference frame -1"),
    ],
)
def test_what_is_no_path_is_refused(path: object, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        path_warp(path, 5)


@given(
    shape=st.tuples(st.integers(1, 14), st.integers(1, 14), st.integers(1, 4)),
    seed=st.integers(0, 10_000),
    weighted=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_dtw_follows_a_path_of_least_total(shape: tuple[int, int, int], seed: int, weighted: bool) -> None:
    n, m, dofs = shape
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(n, dofs)), rng.normal(size=(m, dofs))
    weights = rng.uniform(0, 3, dofs) if weighted else np.ones(dofs)
    warp = dtw(moving, reference, weights if weighted else None)
    assert warp.path[0].tolist() == [0, 0]
    assert warp.path[-1].tolist() == [n - 1, m - 1]
    steps = np.diff(warp.path, axis=0)
    assert ((steps >= 0) & (steps <= 1)).all()
    assert (steps.sum(axis=1) > 0).all()
    differences = moving[warp.path[:, 0]] - reference[warp.path[:, 1]]
    along = np.sqrt((weights * differences**2).sum(axis=1)).sum()
    assert along == pytest.approx(least_total(moving, reference, weights), rel=1e-6, abs=1e-9)
    np.testing.assert_allclose(warp.source_time, mean_times(warp.path))


def test_weights_are_of_squared_differences() -> None:
    weights = np.array([0.05, 1.0, 9.0])
    for seed in range(5):
        moving, reference = np.random.default_rng(seed).normal(size=(2, 25, 3)).cumsum(axis=1)
        path = dtw(moving, reference, weights).path
        differences = moving[path[:, 0]] - reference[path[:, 1]]
        along = np.sqrt((weights * differences**2).sum(axis=1)).sum()
        assert along == pytest.approx(least_total(moving, reference, weights), rel=1e-6)


def test_dtw_finds_a_warp_again() -> None:
    time = np.linspace(0, 1, 80)
    curve = lambda t: np.stack([np.sin(7 * t), np.cos(5 * t), t**2], axis=1)  # noqa: E731
    reference, moving = curve(time), curve(time**1.4)
    truth = time ** (1 / 1.4) * 79
    errors = [np.abs(align(moving, reference).source_time - truth).mean() for align in (dtw, uniform)]
    assert errors[0] < 0.5 < errors[1] / 10
    assert mean_correlation(dtw(moving, reference).apply(moving), reference) > 0.999


def test_dtw_with_itself_changes_nothing() -> None:
    values = np.random.default_rng(0).normal(size=(21, 3)).astype(np.float32)
    np.testing.assert_array_equal(dtw(values, values).apply(values), values)


def test_a_dof_of_weight_0_is_not_looked_at() -> None:
    rng = np.random.default_rng(3)
    moving, reference = (rng.normal(size=(frames, 3)) * (1, 1, 9) for frames in (20, 15))
    kept = dtw(moving[:, :2], reference[:, :2])
    np.testing.assert_array_equal(dtw(moving, reference, np.array([1.0, 1, 0])).path, kept.path)
    assert not np.array_equal(dtw(moving, reference).path, kept.path)


def test_dtw_refuses_what_cannot_be_compared() -> None:
    with pytest.raises(ValueError, match="moving has 2 DOFs and reference 3"):
        dtw(np.zeros((4, 2)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="weights have shape"):
        dtw(np.zeros((4, 2)), np.zeros((4, 2)), np.ones(3))
    with pytest.raises(ValueError, match="reference holds nan at frame 1, DOF 0"):
        dtw(np.zeros((4, 1)), np.array([[0.0], [np.nan]]))
