"""Skeletons, forward kinematics and sampling, against rotations composed one by one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from motionary.pipeline.motion import Motion, Skeleton, slerp


def random_motion(rng: np.random.Generator, joints: int = 5, frames: int = 7, fps: float = 30.0) -> Motion:
    parents = (-1, *(int(rng.integers(joint)) for joint in range(1, joints)))
    skeleton = Skeleton(tuple(f"j{n}" for n in range(joints)), parents, rng.normal(size=(joints, 3)))
    rotations = Rotation.random(frames * joints, rng).as_quat().reshape(frames, joints, 4)
    return Motion("random", skeleton, fps, rng.normal(size=(frames, 3)), rotations)


def naive_positions(motion: Motion) -> np.ndarray:
    """Carry every joint's offset up through its ancestors, one rotation at a time."""
    skeleton, placed = motion.skeleton, np.empty((motion.frames, len(motion.skeleton.names), 3))
    for frame in range(motion.frames):
        for joint in range(len(skeleton.names)):
            point, at = np.zeros(3), joint
            while at != 0:
                point = skeleton.offsets[at] + Rotation.from_quat(motion.rotations[frame, at]).apply(point)
                at = skeleton.parents[at]
            if joint != 0:
                point = Rotation.from_quat(motion.rotations[frame, 0]).apply(point)
            placed[frame, joint] = motion.root_position[frame] + point
    return placed


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), joints=st.integers(1, 8), frames=st.integers(1, 5))
def test_forward_kinematics_is_the_composition_of_rotations(seed, joints, frames):
    motion = random_motion(np.random.default_rng(seed), joints, frames)
    np.testing.assert_allclose(motion.positions(), naive_positions(motion), atol=1e-12)


def test_a_right_angle_by_hand():
    skeleton = Skeleton(("root", "elbow", "hand"), (-1, 0, 1), [[9, 9, 9], [1, 0, 0], [2, 0, 0]])
    up = Rotation.from_euler("z", 90, degrees=True).as_quat()  # +X turns to +Y
    motion = Motion("bend", skeleton, 30, [[0, 5, 0]], [[[0, 0, 0, 1], up, [0, 0, 0, 1]]])
    np.testing.assert_allclose(motion.positions()[0], [[0, 5, 0], [1, 5, 0], [1, 7, 0]], atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0, 1))
def test_slerp_is_scipys(seed, share):
    pair = Rotation.random(2, np.random.default_rng(seed))
    expected = Slerp([0, 1], pair)(share)
    ours = Rotation.from_quat(slerp(*pair.as_quat(), np.float64(share)))
    assert (expected.inv() * ours).magnitude() < 1e-7


def test_sampling_at_whole_frames_gives_the_frames():
    motion = random_motion(np.random.default_rng(0))
    same = motion.sampled(np.arange(motion.frames))
    np.testing.assert_allclose(same.positions(), motion.positions(), atol=1e-12)
    np.testing.assert_allclose(
        motion.sampled([2.25]).root_position[0],
        0.75 * motion.root_position[2] + 0.25 * motion.root_position[3],
    )


@pytest.mark.parametrize("times", [[-0.5], [6.5]])
def test_sampling_outside_is_refused(times):
    with pytest.raises(ValueError, match="has frames 0 to 6"):
        random_motion(np.random.default_rng(0)).sampled(times)


@pytest.mark.parametrize(
    ("names", "parents", "message"),
    [
        (("a", "a"), (-1, 0), "stands twice"),
        (("a", "b"), (-1, 1), "parents stand before children"),
        (("a", "b"), (0, -1), "parents stand before children"),
        (("a", "b"), (-1,), "2 parents"),
    ],
)
def test_a_skeleton_is_a_tree(names, parents, message):
    with pytest.raises(ValueError, match=message):
        Skeleton(names, parents, np.zeros((len(names), 3)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fps": 0}, "positive"),
        ({"root_position": np.full((2, 3), np.nan)}, "not a number"),
        ({"rotations": np.zeros((2, 1, 4))}, "length zero"),
        ({"rotations": np.zeros((2, 2, 4))}, r"\(T, 1, 4\)"),
        ({"root_position": np.zeros((0, 3)), "rotations": np.zeros((0, 1, 4))}, "no frames"),
    ],
)
def test_a_motion_is_checked(change, message):
    good = {
        "name": "m", "skeleton": Skeleton(("a",), (-1,), np.zeros((1, 3))), "fps": 30,
        "root_position": np.zeros((2, 3)), "rotations": np.tile([0.0, 0, 0, 1], (2, 1, 1)),
    }  # fmt: skip
    with pytest.raises(ValueError, match=message):
        Motion(**(good | change))


def test_an_unknown_joint_is_named():
    with pytest.raises(KeyError, match="no joint 'z'; this skeleton has a"):
        Skeleton(("a",), (-1,), np.zeros((1, 3))).index("z")
