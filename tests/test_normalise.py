"""Root translation and heading removed: by hand, and under every placing of the same motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.normalise import headings, normalise, turn_about_vertical

LEFT = [n for n, joint in enumerate(CANONICAL_JOINTS) if joint.startswith("left")]
RIGHT = [n for n, joint in enumerate(CANONICAL_JOINTS) if joint.startswith("right")]


def standing(frames: int = 4) -> np.ndarray:
    """Place a figure that faces +Z, its left at +X."""
    joints = np.zeros((frames, len(CANONICAL_JOINTS), 3))
    joints[:, :, 1] = np.linspace(0.1, 1.7, len(CANONICAL_JOINTS))
    joints[:, LEFT, 0], joints[:, RIGHT, 0] = 0.2, -0.2
    return joints


def naive_turn(points: np.ndarray, angle: float) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]).T


def test_facing_z_has_heading_zero_and_facing_x_a_right_angle():
    np.testing.assert_allclose(headings(standing()), 0, atol=1e-12)
    np.testing.assert_allclose(headings(naive_turn(standing(), np.pi / 2)), np.pi / 2, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    angle=st.floats(-10, 10),
    east=st.floats(-100, 100),
    north=st.floats(-100, 100),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_pose_does_not_depend_on_where_and_which_way(angle, east, north, seed):
    joints = standing() + np.random.default_rng(seed).normal(scale=0.03, size=(4, 19, 3))
    there = naive_turn(joints, angle) + [east, 0, north]
    here, placed = normalise(joints), normalise(there)
    np.testing.assert_allclose(placed.pose, here.pose, atol=1e-9)
    np.testing.assert_allclose(placed.height, here.height, atol=1e-12)
    turned = placed.heading - here.heading - angle
    np.testing.assert_allclose(turned, 2 * np.pi * np.round(turned / (2 * np.pi)), atol=1e-9)


def test_what_was_removed_gives_the_motion_back():
    rng = np.random.default_rng(3)
    joints = naive_turn(standing(6), 0.7) + rng.normal(scale=0.05, size=(6, 19, 3)) + [3, 0, -2]
    normal = normalise(joints)
    back = turn_about_vertical(normal.pose, normal.heading)
    back[..., [0, 2]] += normal.path[:, None]
    np.testing.assert_allclose(back, joints, atol=1e-12)


def test_lying_frames_take_the_heading_between_their_neighbours():
    joints = np.concatenate([standing(1), standing(3), naive_turn(standing(1), 1.0)])
    # On one side the across vector points at the sky, whatever little is left of it on the ground.
    joints[1:4, LEFT], joints[1:4, RIGHT] = [0.0, 0.4, 0.001], [0.0, 0.0, 0.0]
    np.testing.assert_allclose(headings(joints), [0, 0.25, 0.5, 0.75, 1.0], atol=1e-12)


def test_a_turn_of_many_rounds_has_no_jumps():
    angle = np.linspace(0, 6 * np.pi, 60)
    turning = np.concatenate([naive_turn(standing(1), one) for one in angle])
    np.testing.assert_allclose(headings(turning), angle, atol=1e-9)


def test_a_figure_without_any_heading_has_zero():
    np.testing.assert_array_equal(headings(np.zeros((3, 19, 3))), 0)


def test_the_shape_is_checked():
    with pytest.raises(ValueError, match=r"shape \(4, 18, 3\)"):
        normalise(standing()[:, :18])
