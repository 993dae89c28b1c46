"""Dead reckoning: a joint goes on as it turned, whichever quaternions say so."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment.forecast import forecast

seeds = st.integers(0, 2**32 - 1)


def turning(seed: int, joints: int, greatest: float) -> tuple[Rotation, Rotation]:
    """Where joints are, and the turn that each makes in a frame, of at most so many radians."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(joints, 3))
    axes *= rng.uniform(0, greatest, (joints, 1)) / np.linalg.norm(axes, axis=1, keepdims=True)
    return Rotation.random(joints, rng=rng), Rotation.from_rotvec(axes)


def same(a: np.ndarray, b: np.ndarray, atol: float = 1e-12) -> None:
    np.testing.assert_allclose(np.abs(np.sum(a * b, axis=-1)), 1, atol=atol)
    sign = np.sign(np.sum(a * b, axis=-1, keepdims=True))
    np.testing.assert_allclose(a, sign * b, atol=np.sqrt(atol))


@settings(max_examples=40, deadline=None)
@given(seed=seeds, joints=st.integers(1, 5), frames=st.integers(0, 20), elapsed=st.integers(1, 4))
def test_a_steady_turn_goes_on(seed, joints, frames, elapsed):
    start, turn = turning(seed, joints, 3.1 / elapsed)
    shown = [(start * turn**k).as_quat() for k in range(elapsed + frames + 1)]
    found = forecast(shown[0], shown[elapsed], frames, elapsed)
    assert found.shape == (frames, joints, 4)
    for one, expected in zip(found, shown[elapsed + 1 :], strict=True):
        same(one, expected)


@settings(max_examples=40, deadline=None)
@given(seed=seeds, elapsed=st.integers(1, 3))
def test_signs_do_not_matter(seed, elapsed):
    rng = np.random.default_rng(seed)
    # Whole quarter turns are among them: where a turn is of half a turn, its two quaternions are as good.
    before, now = (Rotation.from_euler("xyz", rng.integers(0, 4, (3, 3)) * 90, degrees=True) for _ in "ab")
    expected = forecast(before.as_quat(), now.as_quat(), 5, elapsed)
    signs = rng.choice([-1.0, 1.0], (2, 3, 1))
    same(forecast(signs[0] * before.as_quat(), signs[1] * now.as_quat(), 5, elapsed), expected)


def test_what_stood_still_stays():
    pose = Rotation.random(4, rng=np.random.default_rng(0)).as_quat()
    np.testing.assert_allclose(forecast(pose, pose, 3), np.tile(pose, (3, 1, 1)), atol=1e-15)


def test_forecasts_of_forecasts_stay_unit_and_steady():
    start, turn = turning(3, 6, 0.2)
    before, now = start.as_quat(), (start * turn).as_quat()
    for _ in range(1000):
        before, now = now, forecast(before, now, 1)[0]
    np.testing.assert_allclose(np.linalg.norm(now, axis=1), 1, atol=1e-12)
    same(now, (start * turn**1001).as_quat(), atol=1e-9)


@pytest.mark.parametrize(
    ("previous", "latest", "frames", "elapsed", "what"),
    [
        (np.ones((2, 4)), np.ones((3, 4)), 1, 1, r"shapes \(2, 4\) and \(3, 4\)"),
        (np.ones((2, 3)), np.ones((2, 3)), 1, 1, r"must be \(joints, 4\)"),
        (np.ones((2, 4)), np.ones((2, 4)), -1, 1, "frames is -1"),
        (np.ones((2, 4)), np.ones((2, 4)), 1, 0, "elapsed is 0"),
    ],
)
def test_what_cannot_be_is_refused(previous, latest, frames, elapsed, what):
    with pytest.raises(ValueError, match=what):
        forecast(previous, latest, frames, elapsed)
