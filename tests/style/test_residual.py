"""Residuals against one joint at a time, and what must not change them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import read_motion
from motionary.pipeline.style import REGIONS, joint_regions, pose_differences, residual, residuals
from motionary.pipeline.style.root_motion import features_by_frame
from motionary.pipeline.synthetic import ACTIONS
from motionary.pipeline.synthetic.conventions import CMU_BVH
from tests.style.figures import moved, performed, renamed, shaken

TAU = 0.10


def plain_root(motion: Motion) -> dict[str, list[float]]:
    """Heading, height, velocity and turning of a Mixamo-like figure, a frame at a time."""
    names = motion.skeleton.names
    at = {name: motion.positions()[:, names.index(name)] for name in names}
    sides = [("LeftUpLeg", "LeftLeg", "LeftFoot"), ("RightUpLeg", "RightLeg", "RightFoot")]
    bones = []
    for hip, knee, ankle in sides:
        both = [
            math.dist(h, k) + math.dist(k, a) for h, k, a in zip(at[hip], at[knee], at[ankle], strict=True)
        ]
        bones.append(float(np.median(both)))
    leg = sum(bones) / 2
    lower = [min(x[1], y[1]) for x, y in zip(at["LeftToeBase"], at["RightToeBase"], strict=True)]
    floor = float(np.percentile(lower, 2))
    heading = []
    for k in range(motion.frames):
        across = at["LeftUpLeg"][k] - at["RightUpLeg"][k] + at["LeftArm"][k] - at["RightArm"][k]
        angle = math.atan2(-across[2], across[0])
        if heading:
            angle += 2 * math.pi * round((heading[-1] - angle) / (2 * math.pi))
        heading.append(angle)
    height = [(y - floor) / leg for y in motion.root_position[:, 1]]
    left, forward, turning = [], [], []
    for k in range(motion.frames - 1):
        step = (motion.root_position[k + 1] - motion.root_position[k]) / leg * motion.fps
        between = (heading[k] + heading[k + 1]) / 2
        forward.append(step[0] * math.sin(between) + step[2] * math.cos(between))
        left.append(step[0] * math.cos(between) - step[2] * math.sin(between))
        turning.append((heading[k + 1] - heading[k]) * motion.fps)
    rows = {"left": left, "forward": forward, "turning": turning}
    return {"heading": heading, "height": height} | {name: [*row, 0.0] for name, row in rows.items()}


def plain_turn(motion: Motion, heading: list[float], frame: int, joint: int) -> Rotation:
    turn = Rotation.from_quat(motion.rotations[frame, joint])
    return Rotation.from_euler("y", -heading[frame]) * turn if joint == 0 else turn


@pytest.mark.parametrize(("action", "amount"), [("walk", 0.3), ("punch", 0.2)])
def test_residuals_are_those_of_one_joint_at_a_time(action, amount):
    reference = performed(action, "tired", "bea", frames=13, heading=1.0)
    clip = shaken(performed(action, "proud", "chidi", frames=13, heading=-2.5), seed=1, amount=amount)
    found = residual(clip, reference)
    roots = plain_root(clip), plain_root(reference)
    assert found.kind == "rotations"
    assert found.names == reference.skeleton.names
    for frame in range(13):
        for joint in range(len(found.names)):
            ours, theirs = (
                plain_turn(motion, root["heading"], frame, joint)
                for motion, root in zip((clip, reference), roots, strict=True)
            )
            expected = (theirs.inv() * ours).as_rotvec()
            np.testing.assert_allclose(found.joints[frame, joint], expected, atol=1e-9)
    for column, name in enumerate(("left", "forward", "turning", "height")):
        expected = np.subtract(roots[0][name], roots[1][name])
        np.testing.assert_allclose(found.root[:, column], expected, atol=1e-9)


def test_a_residual_goes_the_short_way_round():
    reference = performed("wave", frames=9)
    clip = shaken(reference, seed=2, amount=3.0)
    assert np.linalg.norm(residual(clip, reference).joints, axis=2).max() <= np.pi + 1e-12


@settings(max_examples=25, deadline=None)
@given(
    action=st.sampled_from(list(ACTIONS)),
    frames=st.integers(1, 40),
    turn=st.floats(-10, 10),
    place=st.tuples(*[st.floats(-500, 500)] * 3),
    kind=st.sampled_from(["rotations", "pose"]),
)
def test_where_a_clip_is_and_which_way_it_faces_is_no_style(action, frames, turn, place, kind):
    reference = performed(action, frames=frames)
    clip = performed(action, "sneaky", "dora", frames=frames, heading=0.3)
    first, second = residual(clip, reference, kind), residual(moved(clip, turn, place), reference, kind)
    precision = 1e-9 if kind == "rotations" else 1e-5  # features are float32
    np.testing.assert_allclose(second.joints, first.joints, atol=precision)
    np.testing.assert_allclose(second.root, first.root, atol=1e-8)


@pytest.mark.parametrize("kind", ["rotations", "pose"])
def test_a_clip_has_no_residual_against_itself(kind):
    clip = shaken(performed("kick", frames=31), seed=3)
    found = residual(clip, clip, kind)
    assert np.abs(found.joints).max() < 1e-12
    assert np.abs(found.root).max() < 1e-12
    assert max(found.joint_energy.values()) < 1e-20
    assert not found.vector().round(12).any()


def test_bodies_of_one_rig_that_do_the_same_turn_the_same():
    # The embedded library poses arms and trunk by angles, so they do not depend on the body.
    short, tall = (performed("wave", body=body, frames=20) for body in ("dora", "chidi"))
    energy = residual(short, tall).region_energy
    assert energy["arms"] < 1e-20
    assert energy["torso"] < 1e-20


def test_other_rigs_are_compared_by_pose():
    reference = performed("walk", frames=20)
    clip = performed("walk", "tired", frames=20, convention=CMU_BVH)
    found = residual(clip, reference)
    assert found.kind == "pose"
    assert found.names == CANONICAL_JOINTS
    assert found.joints.shape == (20, 19, 3)
    # In centimetres over the leg, a joint at a time: the head of the tired one is lower and further forward.
    same = residual(performed("walk", "tired", frames=20), reference, "pose")
    limbs = [CANONICAL_JOINTS.index(f"left_{one}") for one in ("wrist", "knee", "ankle", "toe")]
    np.testing.assert_allclose(found.joints[:, limbs], same.joints[:, limbs], atol=1e-5)
    np.testing.assert_allclose(found.root, same.root, atol=1e-6)
    head = CANONICAL_JOINTS.index("head")
    names = reference.skeleton.names
    one, other = (
        (motion.positions()[:, names.index("Head")] - motion.root_position)[:, 1] / 85.0
        for motion in (performed("walk", "tired", frames=20), reference)
    )
    height = same.root[:, 3]
    np.testing.assert_allclose(same.joints[:, head, 1], one - other + height, atol=1e-5)


def test_poses_differ_by_their_joints_in_leg_lengths():
    own, other = (features_by_frame(performed("walk", style, frames=12)) for style in ("tired", "proud"))
    found = pose_differences(own.values, other.values)
    assert (found.shape, found.dtype) == ((12, 19, 3), np.float64)
    for frame in range(12):
        for joint in range(19):
            one, two = (x.values[frame, 3 * joint : 3 * joint + 3].astype(float) for x in (own, other))
            np.testing.assert_allclose(found[frame, joint], (one - two) * math.sqrt(19), rtol=1e-12)


def test_a_cluster_of_several_rigs_is_compared_by_pose_throughout():
    reference, same = performed("walk", frames=20), performed("walk", "proud", frames=20)
    other = performed("walk", "tired", frames=20, convention=CMU_BVH)
    mixed = residuals([same, other], reference)
    assert [one.kind for one in mixed] == ["pose", "pose"]
    assert mixed[0].joints.tolist() == residual(same, reference, "pose").joints.tolist()
    assert mixed[1].joints.tolist() == residual(other, reference).joints.tolist()
    (alone,) = residuals([same], reference)
    assert alone.kind == "rotations"
    assert residuals([], reference) == []


def test_energies_are_mean_squares():
    reference = performed("throw", frames=15)
    found = residual(shaken(reference, seed=4), reference)
    for joint, name in enumerate(found.names):
        expected = sum(float(v @ v) for v in found.joints[:, joint]) / 15
        assert found.joint_energy[name] == pytest.approx(expected)
    arm = [f"{side}{one}" for side in ("Left", "Right") for one in ("Shoulder", "Arm", "ForeArm", "Hand")]
    assert found.region_energy["arms"] == pytest.approx(sum(found.joint_energy[name] for name in arm))
    assert tuple(found.region_energy) == REGIONS
    assert sum(found.region_energy.values()) == pytest.approx(sum(found.joint_energy.values()))
    assert found.root_energy["height"] == pytest.approx(np.mean(found.root[:, 3] ** 2))
    assert list(found.root_energy) == ["left", "forward", "turning", "height"]


def test_energy_lies_where_the_style_is():
    reference = performed("walk", frames=40)
    bent = reference.rotations.copy()
    head = reference.skeleton.names.index("Head")
    bent[:, head] = (Rotation.from_quat(bent[:, head]) * Rotation.from_rotvec([0.5, 0, 0])).as_quat()
    energy = residual(replace(reference, rotations=bent), reference).region_energy
    assert energy["head"] == pytest.approx(0.25)
    assert sum(energy.values()) == pytest.approx(0.25)


@settings(max_examples=40, deadline=None)
@given(frames=st.integers(1, 45), stretches=st.integers(1, 20), seed=st.integers(0, 99))
def test_vectors_are_averages_over_stretches(frames, stretches, seed):
    reference = performed("squat", frames=frames)
    found = residual(shaken(reference, seed), reference)
    vector = found.vector(stretches).reshape(stretches, -1)
    # Every frame cut into as many pieces as there are stretches: stretch k has the pieces k m .. (k + 1) m.
    rows = np.hstack([found.joints.reshape(frames, -1), found.root * [TAU, TAU, TAU, 1.0]])
    pieces = np.repeat(rows, stretches, axis=0)
    for k in range(stretches):
        expected = pieces[k * frames : (k + 1) * frames].mean(axis=0)
        np.testing.assert_allclose(vector[k], expected, atol=1e-10)


def test_vectors_do_not_depend_on_the_references_length():
    short, long = (
        residual(performed("kick", "tired", frames=n), performed("kick", frames=n)).vector()
        for n in (40, 320)
    )
    assert len(short) == len(long) == 16 * (22 * 3 + 4)
    assert np.linalg.norm(short - long) < 0.05 * np.linalg.norm(long)


def test_regions_of_rigs():
    skeleton = performed("walk").skeleton
    mixamo = dict(zip(skeleton.names, joint_regions(skeleton), strict=True))
    assert mixamo["Hips"] == "root"
    assert {mixamo[name] for name in ("Spine", "Spine1", "Spine2")} == {"torso"}
    assert {mixamo[name] for name in ("Neck", "Head")} == {"head"}
    assert mixamo["LeftShoulder"] == mixamo["RightHand"] == "arms"
    assert mixamo["LeftUpLeg"] == mixamo["RightToeBase"] == "legs"
    cmu = performed("walk", convention=CMU_BVH).skeleton
    by_name = dict(zip(cmu.names, joint_regions(cmu), strict=True))
    assert by_name["LHipJoint"] == "legs"
    assert by_name["LowerBack"] == "torso"
    assert by_name["LThumb"] == by_name["RFingers"] == "arms"


def test_regions_of_real_rigs(shared_data):
    for path in (
        "hdm05/HDM_bd_squat1Reps_001_120.amc",
        "cmu/006_01.bvh",
        "bandai/dataset-1_walk_normal_001.bvh",
    ):
        file = shared_data / path
        if not file.exists():
            file = next(iter(sorted(file.parent.glob("*.bvh"))))
        skeleton = read_motion(file).skeleton
        regions = joint_regions(skeleton)
        assert set(regions) == set(REGIONS)
        assert regions[0] == "root"
        for joint, parent in enumerate(skeleton.parents[1:], 1):
            if regions[parent] in ("head", "arms", "legs"):
                assert regions[joint] == regions[parent], skeleton.names[joint]


def test_a_users_own_rig():
    plain, reference = performed("walk", "proud", frames=12), performed("walk", frames=12)
    strange = [renamed(motion, 0, "gubbins") for motion in (plain, reference)]
    with pytest.raises(ValueError, match="no joint-name convention fits"):
        residual(*strange)
    names = dict(zip(CANONICAL_JOINTS, ("gubbins", "Spine1", "Spine2", "Neck", "Head"), strict=False))
    for side in ("Left", "Right"):
        parts = {"shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "hip": "UpLeg"}
        parts |= {"knee": "Leg", "ankle": "Foot", "toe": "ToeBase"}
        names |= {f"{side.lower()}_{joint}": f"{side}{part}" for joint, part in parts.items()}
    own = residual(*strange, conventions=[Convention("ours", names)])
    np.testing.assert_allclose(own.joints, residual(plain, reference).joints, atol=1e-12)


def test_what_is_not_aligned_is_refused():
    reference = performed("walk", frames=20)
    with pytest.raises(
        ValueError, match=r"'walk_neutral_alex' has 21 frames and its reference .* 20; align it"
    ):
        residual(performed("walk", frames=21), reference)
    with pytest.raises(ValueError, match="has 60 frames a second and its reference 'walk_neutral_alex' 30"):
        residual(replace(reference, fps=60.0), reference)
    other = performed("walk", frames=20, convention=CMU_BVH)
    with pytest.raises(ValueError, match=r"\(31 joints\).*\(22 joints\).*joint 1 is 'LHipJoint' and 'Spine'"):
        residual(other, reference, "rotations")
    with pytest.raises(ValueError, match="stretches is 0"):
        residual(reference, reference).vector(0)


def test_the_rate_is_only_a_name():
    # 29.97 a second, read from a file that prints its frame time with few digits, is 30.
    reference, clip = performed("jump", frames=25), performed("jump", "tired", frames=25)
    at_30 = residual(clip, reference)
    at_120 = residual(*(replace(motion, fps=120.0) for motion in (clip, reference)))
    np.testing.assert_allclose(at_120.joints, at_30.joints, atol=1e-12)
    np.testing.assert_allclose(at_120.root[:, :3], 4 * at_30.root[:, :3], atol=1e-9)
    assert np.isfinite(residual(replace(clip, fps=29.99), reference).root).all()
