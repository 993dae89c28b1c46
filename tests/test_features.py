"""Features do not change with what does not matter: place, heading, size, frame rate, source format."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import CANONICAL_JOINTS, SkeletonError, UnknownSkeletonError
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import at_rate, frame_features, motion_features, sample_times
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import template

KINDS = ("pose+travel", "paper")
UNMERGED = FeatureConfig(epsilon=0.0)


def moved(motion: Motion, angle: float, place: tuple[float, float, float], scale: float) -> Motion:
    turn = Rotation.from_rotvec([0, angle, 0])
    rotations = motion.rotations.copy()
    rotations[:, 0] = (turn * Rotation.from_quat(rotations[:, 0])).as_quat()
    skeleton = replace(motion.skeleton, offsets=motion.skeleton.offsets * scale)
    return replace(
        motion,
        skeleton=skeleton,
        rotations=rotations,
        root_position=(turn.apply(motion.root_position) + place) * scale,
    )


@pytest.fixture(scope="module")
def walk() -> Motion:
    return template("walk")


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15, deadline=None)
@given(
    angle=st.floats(-7, 7),
    place=st.tuples(*[st.floats(-500, 500)] * 3),
    scale=st.sampled_from([0.01, 0.3937, 1.0, 17.0]),
)
def test_place_heading_and_size_do_not_matter(walk, kind, angle, place, scale):
    config = replace(UNMERGED, kind=kind)
    here, there = (frame_features(one, config).values for one in (walk, moved(walk, angle, place, scale)))
    np.testing.assert_allclose(there, here, atol=2e-5)


@pytest.mark.parametrize(("kind", "width"), [("pose+travel", 59), ("paper", 54)])
def test_shapes_and_types(walk, kind, width):
    features = motion_features(walk, FeatureConfig(kind=kind))
    assert features.shape[1] == width
    assert features.dtype == np.float32
    assert 1 < len(features) <= len(at_rate(walk, 30).root_position)


def test_travel_is_velocity_in_the_own_frame_times_tau(walk):
    # Gliding sideways at two leg lengths a second, without a change of pose.
    still = walk.sampled(np.zeros(40))
    leg = frame_features(walk, UNMERGED).leg_length
    times = np.arange(40) / still.fps
    facing = frame_features(still, UNMERGED).heading[0]
    left = np.array([np.cos(facing), 0, -np.sin(facing)])
    gliding = replace(still, root_position=still.root_position + 2.0 * leg * times[:, None] * left)
    travel = frame_features(gliding, UNMERGED).values[:, 57:]
    np.testing.assert_allclose(travel, np.tile([0.2, 0.0], (len(travel), 1)), atol=1e-5)


def test_the_pose_distance_is_the_rms_joint_distance_in_leg_lengths(walk):
    features = frame_features(walk, UNMERGED)
    pose = features.values[:, :57].astype(float)
    apart = np.linalg.norm((pose[0] - pose[9]).reshape(19, 3), axis=1) * np.sqrt(19)
    assert np.linalg.norm(pose[0] - pose[9]) == pytest.approx(np.sqrt((apart**2).mean()))


def test_feet_stand_on_the_floor_and_the_pelvis_over_the_origin(walk):
    pose = frame_features(walk, UNMERGED).values[:, :57].reshape(-1, 19, 3)
    toes = pose[:, [CANONICAL_JOINTS.index("left_toe"), CANONICAL_JOINTS.index("right_toe")], 1].min(axis=1)
    assert abs(np.percentile(toes, 2)) < 1e-6
    np.testing.assert_allclose(pose[:, 0, [0, 2]], 0, atol=1e-7)


@pytest.mark.parametrize(
    ("frames", "fps", "expected"),
    [
        (31, 30.0, np.arange(31)),
        (121, 120.0, np.arange(31) * 4),
        (31, 1 / 0.0333333, np.arange(31)),
        (61, 1 / 0.016667, np.arange(31) * 2),
        (1, 30.0, [0]),
        (2, 120.0, [0]),
        (16, 15.0, np.arange(31) / 2),
        (26, 25.0, np.arange(31) * 25 / 30),
    ],
)
def test_sample_times(frames, fps, expected):
    np.testing.assert_allclose(sample_times(frames, fps, 30.0), expected, atol=1e-9)


def test_the_frame_rate_of_the_source_does_not_matter():
    fast, slow = template("punch", fps=120.0), template("punch", fps=30.0)
    a, b = (frame_features(one, UNMERGED).values for one in (fast, slow))
    frames = min(len(a), len(b))
    assert np.abs(a[:frames, :57] - b[:frames, :57]).max() < 5e-3


def test_one_frame_has_no_velocity(walk):
    features = motion_features(walk.sampled(np.zeros(1)))
    assert features.shape == (1, 59)
    np.testing.assert_array_equal(features[:, 57:], 0)


def test_a_figure_without_legs_is_refused(walk):
    flat = replace(walk, skeleton=replace(walk.skeleton, offsets=np.zeros_like(walk.skeleton.offsets)))
    with pytest.raises(SkeletonError, match="legs of .* have length 0"):
        motion_features(flat)


def test_a_skeleton_of_another_kind_is_refused(cart):
    with pytest.raises(UnknownSkeletonError, match="body, wheel"):
        motion_features(cart)


def test_the_source_format_does_not_matter(shared_data):
    """The same take as ASF/AMC and as BVH: our reader drops the BVH's rest pose, then frames correspond.

    That BVH leaves out the thorax and the wrist bones, so only hips, legs and spine can agree.
    """
    amc, bvh = (read_motion(shared_data / "pairs" / f"01_01.{suffix}") for suffix in ("amc", "bvh"))
    a, b = (frame_features(one, UNMERGED).values[:, :57].reshape(-1, 19, 3) for one in (amc, bvh))
    lower = [
        n for n, joint in enumerate(CANONICAL_JOINTS) if joint in ("pelvis", "spine", "chest") or "_" in joint
    ]
    lower = [n for n in lower if not CANONICAL_JOINTS[n].endswith(("shoulder", "elbow", "wrist"))]
    # The heading is found from hips and shoulders; these differ a little, and turn the lower body with them.
    assert np.abs(a[:, lower] - b[:, lower]).max() < 0.02
    assert np.median(np.abs(a[:, lower] - b[:, lower])) < 1e-3
