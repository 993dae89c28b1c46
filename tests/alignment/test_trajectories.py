import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import computed_trajectories, roughness


def test_trajectories_are_taken_frame_by_frame_and_dof_by_dof() -> None:
    clips = np.random.default_rng(0).normal(size=(5, 7, 3))
    found = computed_trajectories(clips)
    assert list(found) == ["mean", "median", "minimum", "maximum"]
    for frame, dof in np.ndindex(7, 3):
        values = sorted(clips[:, frame, dof].tolist())
        expected = sum(values) / 5, values[2], values[0], values[-1]
        assert [one[frame, dof] for one in found.values()] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("clips", "problem"),
    [
        (np.zeros((3, 4)), r"\(3, 4\); it needs \(clips, frames, dofs\)"),
        (np.zeros((0, 4, 2)), "at least one"),
        (np.array([[[0.0], [1.0]], [[2.0], [np.inf]]]), "clip 1 holds inf at frame 1, DOF 0"),
    ],
)
def test_what_is_no_set_of_clips_is_refused(clips: np.ndarray, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        computed_trajectories(clips)


def test_a_line_is_smooth_and_a_zigzag_the_roughest() -> None:
    time = np.arange(40.0)
    assert roughness(np.stack([time, 3 - 2 * time], axis=1)) == pytest.approx(0, abs=1e-12)
    zigzag = roughness((time % 2)[:, None])
    assert zigzag == pytest.approx(2 * np.sqrt(38 / 39))
    assert roughness(np.random.default_rng(0).normal(size=(40, 3))) < zigzag


@pytest.mark.parametrize("omega", [0.02, 0.1, 0.5])
def test_roughness_of_a_sinusoid_is_its_frequency(omega: float) -> None:
    frames = round(40 * np.pi / omega) + 1
    wave = np.sin(omega * np.arange(frames))[:, None]
    assert roughness(wave) == pytest.approx(2 * np.sin(omega / 2), rel=0.01)


@given(seed=st.integers(0, 1000), scale=st.floats(0.01, 100), offset=st.floats(-10, 10))
@settings(max_examples=40, deadline=None)
def test_scale_and_offset_do_not_matter(seed: int, scale: float, offset: float) -> None:
    values = np.random.default_rng(seed).normal(size=(20, 2))
    assert roughness(scale * values + offset) == pytest.approx(roughness(values), rel=1e-6)


def test_weights_and_dofs_that_stand_still() -> None:
    time = np.arange(30.0)
    values = np.stack([np.sin(time / 3), np.sin(time), np.full(30, 0.1)], axis=1)
    slow, fast = roughness(values[:, :1]), roughness(values[:, 1:2])
    assert roughness(values) == pytest.approx((slow + fast) / 2)
    assert roughness(values, np.array([3.0, 1.0, 9.0])) == pytest.approx((3 * slow + fast) / 4)
    assert roughness(values[:, 2:]) == 0
    assert roughness(values, np.array([0.0, 0.0, 1.0])) == 0


def test_smoothing_and_averaging_make_smooth_and_extremes_rough() -> None:
    """What Figure 10 shows: waves that are out of step, and the trajectories computed from them."""
    time = np.linspace(0, 2 * np.pi, 60)
    rng = np.random.default_rng(1)
    shifts, noise = rng.uniform(-0.7, 0.7, 9), rng.normal(scale=0.02, size=(9, 60))
    clips = (np.sin(time + shifts[:, None]) + noise)[:, :, None]
    rough = {kind: roughness(one) for kind, one in computed_trajectories(clips).items()}
    single = np.mean([roughness(one) for one in clips])
    assert rough["mean"] < single
    assert rough["mean"] < min(rough["minimum"], rough["maximum"])


@pytest.mark.parametrize("values", [np.zeros((2, 3)), np.zeros(9)])
def test_too_little_to_turn_is_refused(values: np.ndarray) -> None:
    with pytest.raises(ValueError, match="3 frames or more"):
        roughness(values)
