"""Rotations of canonical joints: the right bones, whatever they are called, at any rate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    UnknownSkeletonError,
    canonical_indices,
    find_convention,
)
from motionary.pipeline.joint_rotations import FP_JOINTS, bone_directions, joint_rotations
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import CONVENTIONS, DEFAULT_BODY, template


@pytest.fixture(scope="module")
def walk() -> Motion:
    return template("walk")


def test_hips_knees_shoulders_and_elbows_are_the_usual_ones(walk):
    rotations = joint_rotations(walk)
    assert rotations.shape == (walk.frames, 8, 4)
    np.testing.assert_allclose(np.linalg.norm(rotations, axis=-1), 1, atol=1e-12)


def test_a_joint_turns_the_bone_that_begins_there(walk):
    """Bending what is called the left knee moves ankle and toe, and nothing else."""
    places = canonical_indices(walk.skeleton, find_convention(walk.skeleton.names))
    knee = joint_rotations(walk, ["left_knee"])[:, 0]
    own = next(j for j in range(len(walk.skeleton.names)) if np.array_equal(walk.rotations[:, j], knee))
    bent = walk.rotations.copy()
    bent[:, own] = (Rotation.from_quat(knee) * Rotation.from_rotvec([0.5, 0, 0])).as_quat()
    apart = np.linalg.norm(walk.positions() - replace(walk, rotations=bent).positions(), axis=-1).max(axis=0)
    moved = [joint for joint, index in zip(CANONICAL_JOINTS, places, strict=True) if apart[index] > 1e-9]
    assert moved == ["left_ankle", "left_toe"]


def test_joints_come_in_the_order_that_is_asked_for(walk):
    both = joint_rotations(walk, ["right_elbow", "left_hip"])
    np.testing.assert_array_equal(both[:, 0], joint_rotations(walk)[:, FP_JOINTS.index("right_elbow")])
    np.testing.assert_array_equal(both[:, 1], joint_rotations(walk)[:, FP_JOINTS.index("left_hip")])


def test_the_rate_is_that_which_is_asked_for(walk):
    fast = joint_rotations(walk, rate=2 * walk.fps)
    assert len(fast) == 2 * walk.frames - 1
    np.testing.assert_allclose(np.abs(np.sum(fast[::2] * joint_rotations(walk), axis=-1)), 1, atol=1e-12)


def test_two_takes_of_two_formats_agree(shared_data):
    """The same take as ASF/AMC and as BVH: the two write the bones' axes each in their own way, so the knees'
    rotations differ, while how far a knee turns from frame to frame does not."""
    turned = []
    for suffix in ("amc", "bvh"):
        knee = joint_rotations(read_motion(shared_data / "pairs" / f"01_01.{suffix}"), ["left_knee"])[:, 0]
        rotation = Rotation.from_quat(knee)
        turned.append((rotation[:-1].inv() * rotation[1:]).magnitude())
    np.testing.assert_allclose(turned[0], turned[1], atol=2e-3)


def test_markers_are_refused(walk):
    markers = replace(
        walk,
        rotations=np.empty((walk.frames, 0, 4)),
        places=walk.positions() - walk.root_position[:, None],
    )
    with pytest.raises(ValueError, match=r"captured as markers.*features"):
        joint_rotations(markers)


@pytest.mark.parametrize(
    ("joints", "rate", "what"),
    [
        (["left_knee", "tail"], None, "'tail'; there are pelvis"),
        ([], None, "no joint is named"),
        (["left_knee"], 0.0, "rate is 0.0"),
        (["left_knee"], float("nan"), "rate is nan"),
    ],
)
def test_what_cannot_be_is_refused(walk, joints, rate, what):
    with pytest.raises(ValueError, match=what):
        joint_rotations(walk, joints, rate)


def test_a_skeleton_of_another_kind_is_refused(cart):
    with pytest.raises(UnknownSkeletonError, match="body, wheel"):
        joint_rotations(cart)


def test_every_real_clip_with_rotations_reads(shared_data):
    for path in ("hdm05", "bandai", "cmu"):
        clip = next(one for one in sorted((shared_data / path).iterdir()) if one.suffix in (".amc", ".bvh"))
        rotations = joint_rotations(read_motion(clip), rate=60.0)
        assert rotations.shape[1:] == (8, 4)
        assert np.isfinite(rotations).all()


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_bones_point_where_the_next_joint_lies(convention):
    skeleton = CONVENTIONS[convention].skeleton(DEFAULT_BODY)
    directions = bone_directions(skeleton)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    down = directions[[FP_JOINTS.index("left_knee"), FP_JOINTS.index("right_hip")]] @ (0, -1, 0)
    assert (down > 0.9).all()
    sideways = directions[:, 0]
    assert sideways[FP_JOINTS.index("left_elbow")] > 0.99
    assert sideways[FP_JOINTS.index("right_shoulder")] < -0.99


def test_joint_trajectories_are_the_limbs_of_a_performance():
    """Turned by its joint and all above it, a bone's direction is the limb's in the world."""
    motion = template("kick")
    own = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
    place = dict(zip(CANONICAL_JOINTS, own, strict=True))
    knee, ankle = place["left_knee"], place["left_ankle"]
    thigh = motion.skeleton.parents[knee]
    world = Rotation.identity(motion.frames)
    for joint in reversed(_above(motion.skeleton.parents, thigh)):
        world = world * Rotation.from_quat(motion.rotations[:, joint])
    shank = Rotation.from_quat(motion.rotations[:, knee]).apply(
        bone_directions(motion.skeleton)[FP_JOINTS.index("left_knee")]
    )
    positions = motion.positions()
    shown = positions[:, ankle] - positions[:, knee]
    expected = shown / np.linalg.norm(shown, axis=1, keepdims=True)
    np.testing.assert_allclose(world.apply(shank), expected, atol=1e-9)


def _above(parents, joint):
    chain = [joint]
    while parents[chain[-1]] != -1:
        chain.append(parents[chain[-1]])
    return chain


def test_a_bone_of_no_length_is_refused():
    skeleton = CONVENTIONS["mixamo"].skeleton(DEFAULT_BODY)
    own = dict(
        zip(CANONICAL_JOINTS, canonical_indices(skeleton, find_convention(skeleton.names)), strict=True)
    )
    offsets = skeleton.offsets.copy()
    offsets[own["left_ankle"]] = 0
    with pytest.raises(ValueError, match="that begins at '.*LeftLeg' has length 0"):
        bone_directions(replace(skeleton, offsets=offsets))


def test_a_limb_may_have_a_joint_between():
    skeleton = CONVENTIONS["mixamo"].skeleton(DEFAULT_BODY)
    own = dict(
        zip(CANONICAL_JOINTS, canonical_indices(skeleton, find_convention(skeleton.names)), strict=True)
    )
    at, knee = own["left_ankle"], own["left_knee"]
    assert skeleton.parents[at] == knee
    parents = [parent + (parent >= at) for parent in skeleton.parents]
    parents[at] = at  # hangs from the new joint, which takes its place
    twisted = Skeleton(
        (*skeleton.names[:at], "twist", *skeleton.names[at:]),
        (*parents[:at], int(knee), *parents[at:]),
        np.insert(skeleton.offsets, at, [7.0, 0, 0], axis=0),
    )
    shank = skeleton.offsets[at] + [7.0, 0, 0]
    found = bone_directions(twisted)
    np.testing.assert_allclose(found[FP_JOINTS.index("left_knee")], shank / np.linalg.norm(shank))
    np.testing.assert_allclose(found[FP_JOINTS.index("right_knee")], bone_directions(skeleton)[3])
