"""Warped sequences and their targets: Kendall's tau pair by pair, rotations by hand, jerk of polynomials."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from motionary.pipeline.evaluation import jerk, joint_trajectories, kendall_tau_similarity, mean_distance

few_levels = arrays(np.float64, st.tuples(st.integers(2, 12), st.integers(1, 3)), elements=st.integers(-3, 3))


def tau_b(values, target):
    """Of one column, pair by pair of frames: concordant less discordant, over what is not tied."""
    agree, untied, untied_target = 0, 0, 0
    for one, other in combinations(range(len(values)), 2):
        turn, turn_target = np.sign(values[other] - values[one]), np.sign(target[other] - target[one])
        agree += turn * turn_target
        untied += turn != 0
        untied_target += turn_target != 0
    return agree / np.sqrt(untied * untied_target)


@settings(max_examples=60, deadline=None)
@given(st.data(), few_levels)
def test_similarity_is_the_mean_of_tau_over_the_columns_in_which_the_target_moves(data, target):
    values = data.draw(arrays(np.float64, target.shape, elements=st.integers(-3, 3)))
    taus = [
        tau_b(one, other) if np.ptp(one) else 0.0
        for one, other in zip(values.T, target.T, strict=True)
        if np.ptp(other)
    ]
    expected = np.mean(taus) if taus else 0.0
    assert kendall_tau_similarity(values, target) == pytest.approx(expected, abs=1e-12)


def test_only_ranks_count():
    rng = np.random.default_rng(0)
    target = rng.normal(size=(40, 3))
    assert kendall_tau_similarity(target, target) == pytest.approx(1)
    assert kendall_tau_similarity(np.exp(3 * target) - 7, target) == pytest.approx(1)
    assert kendall_tau_similarity(-target, target) == pytest.approx(-1)


def test_a_column_that_stands_still_in_the_target_is_left_out_and_in_the_values_worth_nothing():
    moving = np.arange(10.0)
    still = np.full(10, 0.3) + np.tile([0, 1e-17], 5)
    rounding = np.full(10, 0.3) + np.tile([0, 1e-16], 5)
    both = np.column_stack([moving, moving])
    assert kendall_tau_similarity(both, np.column_stack([moving, still])) == pytest.approx(1)
    assert kendall_tau_similarity(both, np.column_stack([moving, rounding])) == pytest.approx(1)
    assert kendall_tau_similarity(np.column_stack([moving, rounding]), both) == pytest.approx(0.5)
    assert kendall_tau_similarity(both, np.column_stack([still, still])) == 0


@pytest.mark.parametrize("frames", [1, 2])
def test_few_frames_have_a_similarity(frames):
    values = np.arange(2.0 * frames).reshape(frames, 2)
    assert kendall_tau_similarity(values, values) == pytest.approx(frames - 1)


def test_sequences_of_other_shapes_are_refused():
    with pytest.raises(ValueError, match="4 frames and target 5"):
        kendall_tau_similarity(np.zeros((4, 2)), np.zeros((5, 2)))
    with pytest.raises(ValueError, match="DOFs"):
        kendall_tau_similarity(np.zeros((4, 2)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="finite"):
        kendall_tau_similarity(np.full((4, 2), np.nan), np.zeros((4, 2)))


def test_mean_distance_is_that_of_the_frames():
    target = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])
    assert mean_distance(target + [[3, 4], [0, 0], [0, 1]], target) == pytest.approx((5 + 0 + 1) / 3)
    assert mean_distance(target, target) == 0
    with pytest.raises(ValueError, match="2 frames and target 3; warp one"):
        mean_distance(target[:2], target)
    with pytest.raises(ValueError, match="finite"):
        mean_distance(target * np.nan, target)


def test_a_quarter_turn_lays_the_joint_over():
    about_x = Rotation.from_rotvec([[0, 0, 0], [90, 0, 0], [180, 0, 0]], degrees=True).as_quat()
    found = joint_trajectories(about_x[:, None])
    np.testing.assert_allclose(found, [[0, 1, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)
    along_x = joint_trajectories(about_x[:, None], (2.0, 0, 0))
    np.testing.assert_allclose(along_x, np.tile([1.0, 0, 0], (3, 1)), atol=1e-12)


def test_every_joint_has_its_own_direction_and_three_columns():
    rng = np.random.default_rng(1)
    rotations = Rotation.random(15, random_state=rng).as_quat().reshape(5, 3, 4)
    directions = rng.normal(size=(3, 3))
    found = joint_trajectories(2 * rotations, directions)  # the double quaternion is the same rotation
    assert found.shape == (5, 9)
    for frame in range(5):
        for joint in range(3):
            along = directions[joint] / np.linalg.norm(directions[joint])
            expected = Rotation.from_quat(rotations[frame, joint]).as_matrix() @ along
            np.testing.assert_allclose(found[frame, 3 * joint : 3 * joint + 3], expected, atol=1e-12)


def test_both_quaternions_of_a_rotation_give_one_trajectory():
    rotations = Rotation.random(6, random_state=2).as_quat()[:, None]
    np.testing.assert_allclose(joint_trajectories(-rotations), joint_trajectories(rotations), atol=1e-12)


@pytest.mark.parametrize(
    ("rotations", "directions", "said"),
    [
        (np.zeros((3, 4)), (0, 1, 0), r"\(frames, joints, 4\)"),
        (np.zeros((0, 2, 4)), (0, 1, 0), "at least one"),
        (np.zeros((3, 2, 4)), (0, 1, 0), "rotations hold"),
        (np.ones((3, 2, 4)), np.ones((3, 3)), r"2 joints need \(3,\) or \(2, 3\)"),
        (np.ones((3, 2, 4)), (0, 0, 0), "directions hold"),
        (np.full((3, 2, 4), np.nan), (0, 1, 0), "rotations hold"),
    ],
)
def test_what_is_no_rotation_or_direction_is_refused(rotations, directions, said):
    with pytest.raises(ValueError, match=said):
        joint_trajectories(rotations, directions)


def test_jerk_of_a_cubic_is_its_third_derivative():
    time = np.arange(50) / 25
    cubic = np.column_stack([3 * time**3 - time, 4 * time**3 + time**2])
    assert jerk(cubic, rate=25) == pytest.approx(6 * 5)
    assert jerk(cubic) == pytest.approx(6 * 5 / 25**3)
    assert jerk(cubic.astype(np.float32), rate=25) == pytest.approx(6 * 5, rel=0.1)


def test_jerk_is_nothing_where_speed_changes_evenly():
    time = np.arange(20)[:, None]
    assert jerk(2 * time**2 - 3 * time + 1, rate=30) == 0


def test_too_few_frames_have_no_jerk():
    with pytest.raises(ValueError, match="3 frames; a third difference needs 4"):
        jerk(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="rate is 0"):
        jerk(np.zeros((4, 2)), rate=0)
    with pytest.raises(ValueError, match="finite"):
        jerk(np.full((4, 2), np.inf))
