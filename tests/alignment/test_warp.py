import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment import Warp, uniform
from motionary.pipeline.alignment.warp import at_a_clear_size
from motionary.pipeline.motion import Motion, Skeleton

FINITE = st.floats(-1e3, 1e3, allow_subnormal=False)


def turning(frames: int, fps: float, degrees_a_second: float = 30.0) -> Motion:
    """Walk along x at a metre a second while turning about the vertical at constant speed."""
    seconds = np.arange(frames) / fps
    turn = Rotation.from_rotvec(np.outer(degrees_a_second * seconds, [0, 1, 0]), degrees=True).as_quat()
    skeleton = Skeleton(("hips", "spine"), (-1, 0), np.array([[0.0, 0, 0], [0, 1, 0]]))
    root = np.stack([seconds, np.ones(frames), np.zeros(frames)], axis=1)
    return Motion("turning", skeleton, fps, root, np.stack([turn, turn], axis=1))


@given(
    times=st.lists(st.floats(0, 6), min_size=1, max_size=12).map(sorted),
    column=st.lists(FINITE, min_size=7, max_size=7),
)
@settings(max_examples=60, deadline=None)
def test_apply_interpolates_each_dof(times: list[float], column: list[float]) -> None:
    values = np.stack([np.array(column), np.arange(7.0)], axis=1)
    shown = Warp(np.array(times), 7).apply(values)
    np.testing.assert_allclose(shown[:, 0], np.interp(times, np.arange(7), column), atol=1e-9)
    np.testing.assert_allclose(shown[:, 1], times, atol=1e-12)


def test_apply_at_whole_times_gives_the_rows_themselves() -> None:
    values = np.random.default_rng(1).normal(size=(5, 3)).astype(np.float32)
    shown = Warp(np.array([0.0, 2.0, 2.0, 4.0]), 5).apply(values)
    assert shown.dtype == np.float32
    np.testing.assert_array_equal(shown, values[[0, 2, 2, 4]])


def test_apply_carries_further_axes_along() -> None:
    values = np.arange(24).reshape(4, 3, 2)
    np.testing.assert_array_equal(
        Warp(np.array([0.5, 3.0]), 4).apply(values), (values[[0, 3]] + [[[3]], [[0]]])
    )


@pytest.mark.parametrize(
    ("times", "problem"),
    [
        ([], "at least one"),
        ([[0.0, 1.0]], "one time a reference frame"),
        ([0.0, np.nan], "reference frame 1"),
        ([0.0, 2.0, 1.5], "falls from 2 to 1.5 after reference frame 1"),
        ([-0.5, 1.0], "from -0.5"),
        ([0.0, 4.5], "to 4.5"),
    ],
)
def test_a_warp_that_is_none_is_refused(times: list[float], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        Warp(np.array(times), 5)


def test_apply_refuses_another_length() -> None:
    with pytest.raises(ValueError, match=r"\(4, 2\).*5 moving frames"):
        Warp(np.array([0.0, 1.0]), 5).apply(np.zeros((4, 2)))


def test_a_warp_keeps_its_own_times() -> None:
    times = np.array([0.0, 1.0])
    warp = Warp(times, 3)
    times[0] = 2.0
    assert warp.source_time[0] == 0.0


def test_apply_motion_in_its_own_frames() -> None:
    motion = turning(9, fps=60)
    shown = Warp(np.array([0.0, 0.5, 3.25, 8.0]), 9).apply_motion(motion)
    assert shown.fps == 60
    np.testing.assert_allclose(shown.root_position[:, 0], np.array([0, 0.5, 3.25, 8]) / 60)
    turns = Rotation.from_quat(shown.rotations[:, 1]).as_euler("yxz", degrees=True)[:, 0]
    np.testing.assert_allclose(turns, 30 * np.array([0, 0.5, 3.25, 8]) / 60, atol=1e-9)


@pytest.mark.parametrize(
    ("fps", "whole"), [(120.0, 120), (100.0, 100), (1 / 0.0333333, 30), (1 / 0.016667, 60)]
)
def test_apply_motion_at_the_rate_of_the_warp(fps: float, whole: int) -> None:
    """A warp of 30 frames a second shows the seconds that it names, whatever the motion's own rate."""
    motion = turning(whole * 2 + 1, fps=fps)
    times = np.array([0.0, 10.25, 31.0, 60.0])
    shown = Warp(times, 61).apply_motion(motion, rate=30)
    assert shown.fps == 30
    np.testing.assert_allclose(shown.root_position[:, 0], times / 30 * whole / fps, atol=1e-9)


def test_apply_motion_whose_end_lies_between_samples() -> None:
    motion = turning(119, fps=120)  # the last sample at 30 a second is frame 116
    shown = uniform(np.zeros((30, 1)), np.zeros((59, 1))).apply_motion(motion, rate=30)
    np.testing.assert_allclose(shown.root_position[[0, -1], 0], [0, 29 / 30])


def test_apply_motion_refuses_a_warp_of_another_rate() -> None:
    with pytest.raises(ValueError, match=r"121 frames at 120 a second; this warp was made for 31"):
        Warp(np.array([0.0, 30.0]), 31).apply_motion(turning(121, fps=120))


@given(moving=st.integers(1, 60), reference=st.integers(1, 60))
@settings(max_examples=80, deadline=None)
def test_uniform_spreads_time_evenly(moving: int, reference: int) -> None:
    warp = uniform(np.zeros((moving, 2)), np.zeros((reference, 3)))
    assert warp.reference_frames == reference
    assert warp.moving_frames == moving
    assert warp.source_time[0] == 0
    assert warp.source_time[-1] == (moving - 1 if reference > 1 else 0)
    np.testing.assert_allclose(np.diff(warp.source_time, 2), 0, atol=1e-12)


def test_uniform_between_equal_lengths_changes_nothing() -> None:
    values = np.random.default_rng(0).normal(size=(17, 4))
    np.testing.assert_array_equal(uniform(values, values).apply(values), values)


@pytest.mark.parametrize(
    "bad", [np.zeros((0, 2)), np.zeros(5), np.zeros((3, 0)), np.array([[0.0], [np.inf]])]
)
def test_uniform_refuses_what_is_no_sequence(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match="reference"):
        uniform(np.zeros((3, 1)), bad)


@pytest.mark.parametrize("factor", [1e-323, 1e-300, 1e-104, 1e120])
def test_a_clear_size_is_a_power_of_two_away(factor: float) -> None:
    one, other = factor * np.array([[1.0, -3.0], [0.5, 0.0]]), factor * np.array([[0.25], [2.0]])
    (large, small), exponent = at_a_clear_size(one, other)
    assert 0.5 <= np.abs(large).max() < 1
    np.testing.assert_array_equal(np.ldexp(large, -exponent), one)
    np.testing.assert_array_equal(np.ldexp(small, -exponent), other)


@pytest.mark.parametrize("values", [np.zeros((3, 2)), np.full((3, 2), 1e-90), np.ones((3, 2), dtype=bool)])
def test_a_usual_size_is_left_alone(values: np.ndarray) -> None:
    (same,), exponent = at_a_clear_size(values)
    assert same is values
    assert exponent == 0
