"""Transfer: what it must leave alone, what it must add, and how its result moves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment import cotw_search
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import at_rate, frame_features
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.style import foot_sliding, residual, transfer
from motionary.pipeline.synthetic import ACTIONS, BODIES, STYLES
from motionary.pipeline.synthetic.conventions import CMU_BVH
from motionary.pipeline.writers import write_bvh
from tests.style.figures import moved, performed, renamed, shaken


def bone_lengths(motion: Motion) -> np.ndarray:
    places = motion.positions()
    return np.linalg.norm(places[:, 1:] - places[:, list(motion.skeleton.parents[1:])], axis=2)


def assert_same_pose(first: Motion, second: Motion, precision: float = 1e-9) -> None:
    """Quaternions are equal up to their sign."""
    agree = np.abs(np.sum(first.rotations * second.rotations, axis=-1))
    np.testing.assert_allclose(agree, 1.0, atol=precision)
    np.testing.assert_allclose(first.positions(), second.positions(), atol=precision * 1e2)


@settings(max_examples=40, deadline=None)
@given(
    action=st.sampled_from(list(ACTIONS)),
    body=st.sampled_from(list(BODIES)),
    style=st.sampled_from(list(STYLES)),
    frames=st.integers(1, 60),
    turn=st.floats(-10, 10),
    place=st.tuples(*[st.floats(-500, 500)] * 3),
    seed=st.integers(0, 99),
)
def test_no_style_changes_nothing_whichever_way_one_walks(action, body, style, frames, turn, place, seed):
    reference = shaken(performed(action, frames=frames, heading=0.7), seed, amount=0.2)
    onto = moved(shaken(performed(action, style, body, frames=frames), seed + 1, 0.2), turn, place)
    result = transfer(reference, reference, onto)
    np.testing.assert_allclose(result.root_position, onto.root_position, atol=1e-9)
    assert_same_pose(result, onto)


@settings(max_examples=40, deadline=None)
@given(
    action=st.sampled_from(list(ACTIONS)),
    body=st.sampled_from(list(BODIES)),
    frames=st.integers(1, 60),
    turn=st.floats(-3, 3),
    seed=st.integers(0, 99),
)
def test_style_on_the_reference_is_the_styled_clip(action, body, frames, turn, seed):
    reference = performed(action, frames=frames)
    styled = moved(
        shaken(performed(action, "sneaky", body, frames=frames), seed, 0.1), turn, (30.0, 5.0, -70.0)
    )
    result = transfer(styled, reference, reference)
    assert result.skeleton == reference.skeleton
    # On the styled one's body, turned and placed alike, it is the styled one.
    own = residual(result, styled)
    assert np.abs(own.joints).max() < 1e-9 if body == "alex" else True
    agree = np.abs(np.sum(result.rotations[:, 1:] * styled.rotations[:, 1:], axis=-1))
    np.testing.assert_allclose(agree, 1.0, atol=1e-9)
    back = Rotation.from_quat(result.rotations[:, 0]) * Rotation.from_quat(styled.rotations[:, 0]).inv()
    turned = back.as_rotvec()
    np.testing.assert_allclose(turned, np.broadcast_to(turned[0], turned.shape), atol=1e-8)
    np.testing.assert_allclose(turned[:, [0, 2]], 0, atol=1e-8)
    if body == "alex":
        path = back[0].apply(styled.root_position - styled.root_position[0]) + result.root_position[0]
        np.testing.assert_allclose(result.root_position, path, atol=1e-7)


def test_steps_grow_with_the_leg():
    reference, styled = performed("walk", frames=60), performed("walk", "sneaky", frames=60)
    onto = performed("walk", body="dora", frames=60, heading=np.pi / 2)
    result = transfer(styled, reference, onto)

    def travelled(motion: Motion) -> float:
        return float(np.linalg.norm((motion.root_position[-1] - motion.root_position[0])[[0, 2]]))

    legs = BODIES["dora"].leg / BODIES["alex"].leg
    expected = travelled(onto) + legs * (travelled(styled) - travelled(reference))
    assert travelled(result) == pytest.approx(expected, rel=2e-3)
    assert travelled(result) < 0.9 * travelled(onto)
    # It walks towards +X as before.
    assert (result.root_position[-1] - result.root_position[0])[0] > 0.99 * travelled(result)
    height = onto.root_position[:, 1] + legs * (styled.root_position - reference.root_position)[:, 1]
    np.testing.assert_allclose(result.root_position[:, 1], height, atol=0.3)


def test_rotations_against_one_joint_at_a_time():
    reference, styled = performed("punch", frames=12), performed("punch", "proud", frames=12)
    onto = shaken(performed("punch", "tired", "emil", frames=12), 5, 0.2)
    result = transfer(styled, reference, onto)
    for frame in range(12):
        for joint in range(1, len(onto.skeleton.names)):
            q = [Rotation.from_quat(m.rotations[frame, joint]) for m in (onto, reference, styled)]
            expected = q[0] * q[1].inv() * q[2]
            found = Rotation.from_quat(result.rotations[frame, joint])
            assert (found.inv() * expected).magnitude() < 1e-9


def test_turning_is_added():
    # The styled one turns left by 90 degrees over the clip, in place.
    reference = performed("wave", frames=31)
    turn = Rotation.from_rotvec(np.multiply.outer(np.linspace(0, np.pi / 2, 31), [0.0, 1.0, 0.0]))
    rotations = reference.rotations.copy()
    rotations[:, 0] = (turn * Rotation.from_quat(rotations[:, 0])).as_quat()
    styled = replace(reference, rotations=rotations)
    walk = performed("walk", frames=31, heading=-1.0)
    result = transfer(styled, reference, walk)
    end = Rotation.from_quat(result.rotations[-1, 0]) * Rotation.from_quat(walk.rotations[-1, 0]).inv()
    np.testing.assert_allclose(end.as_rotvec(), [0, np.pi / 2, 0], atol=1e-6)
    first, last = (np.diff(result.root_position, axis=0)[k] for k in (0, -1))
    straight = np.diff(walk.root_position, axis=0)
    np.testing.assert_allclose(np.linalg.norm(first), np.linalg.norm(straight[0]), rtol=1e-2)
    bend = Rotation.from_rotvec([0, np.pi / 2 * 29.5 / 30, 0]).apply(straight[-1])
    np.testing.assert_allclose(last[[0, 2]], bend[[0, 2]], atol=0.02 * np.linalg.norm(bend))


@settings(max_examples=25, deadline=None)
@given(action=st.sampled_from(list(ACTIONS)), style=st.sampled_from(list(STYLES)), seed=st.integers(0, 99))
def test_bones_keep_their_length_and_rotations_are_unit(action, style, seed):
    reference = performed(action, frames=25)
    onto = shaken(performed(action, body="chidi", frames=25), seed, 0.2)
    result = transfer(shaken(performed(action, style, "bea", frames=25), seed + 1, 0.3), reference, onto)
    assert result.skeleton == onto.skeleton
    assert (result.fps, result.unit, result.frames) == (onto.fps, onto.unit, onto.frames)
    np.testing.assert_allclose(bone_lengths(result), bone_lengths(onto), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(result.rotations, axis=-1), 1, atol=1e-12)
    np.testing.assert_allclose(result.root_position[0, [0, 2]], onto.root_position[0, [0, 2]], atol=1e-9)


def test_other_skeletons_are_refused_by_name():
    reference, styled = performed("walk", frames=10), performed("walk", "tired", frames=10)
    other = performed("walk", "proud", frames=10, convention=CMU_BVH)
    for motions in ((other, reference, styled), (styled, reference, other)):
        with pytest.raises(ValueError, match="within one rig only") as refused:
            transfer(*motions)
        said = str(refused.value)
        assert "'walk_proud_alex' (31 joints)" in said
        assert "'walk_neutral_alex' (22 joints)" in said
        assert "joint 1 is 'LHipJoint' and 'Spine'" in said
    with pytest.raises(ValueError, match="joint 5 is 'Kopf' and 'Head'"):
        transfer(renamed(styled, 5, "Kopf"), reference, reference)
    rehung = replace(styled.skeleton, parents=(-1, 0, 1, 2, 3, 3, *styled.skeleton.parents[6:]))
    with pytest.raises(ValueError, match="joint 5, 'Head', hangs from 'Spine2' and 'Neck'"):
        transfer(replace(styled, skeleton=rehung), reference, reference)
    with pytest.raises(ValueError, match=r"\(23 joints\).*joint 22, 'Tail', is in one only"):
        transfer(with_a_tail(styled), reference, reference)
    with pytest.raises(ValueError, match="has 11 frames and its reference 'walk_neutral_alex' 10"):
        transfer(styled, reference, performed("walk", frames=11))


def with_a_tail(motion: Motion) -> Motion:
    old = motion.skeleton
    skeleton = Skeleton((*old.names, "Tail"), (*old.parents, 0), np.vstack([old.offsets, [0, -5, 0]]))
    still = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (motion.frames, 1, 4))
    return replace(motion, skeleton=skeleton, rotations=np.concatenate([motion.rotations, still], axis=1))


def pose(motion: Motion) -> np.ndarray:
    return frame_features(motion, FeatureConfig(epsilon=0.0)).values[:, :57]


def aligned(motion: Motion, reference: Motion) -> Motion:
    return cotw_search(pose(motion), pose(reference), effort="fast").apply_motion(motion, rate=30.0)


def greatest_speed(motion: Motion) -> float:
    """Of any joint, in leg lengths a second."""
    leg = frame_features(motion, FeatureConfig()).leg_length
    return float(np.linalg.norm(np.diff(motion.positions(), axis=0), axis=2).max() * motion.fps / leg)


@pytest.mark.parametrize(
    ("styled", "reference", "onto", "most_sliding"),
    [
        ("bk_kickLFront1Reps_007", "dg_kickLFront1Reps_014", "bd_kickLFront1Reps_001", 100),
        ("bk_sneak2StepsLStart_004", "dg_sneak2StepsLStart_007", "mm_sneak2StepsLStart_011", 50),
        (
            "bk_jogLeftCircle4StepsRstart_003",
            "dg_jogLeftCircle4StepsRstart_008",
            "mm_jogLeftCircle4StepsRstart_011",
            60,
        ),
    ],
)
def test_real_clips_of_other_actors(shared_data: Path, tmp_path: Path, styled, reference, onto, most_sliding):
    read = [read_motion(shared_data / f"hdm05/HDM_{name}_120.amc") for name in (styled, reference, onto)]
    to = at_rate(read[1], 30.0)
    source, target = aligned(read[0], to), aligned(read[2], to)
    result = transfer(source, to, target)
    np.testing.assert_allclose(bone_lengths(result), bone_lengths(target), rtol=1e-9, atol=1e-9)
    # Nothing jumps: no joint is faster than the three clips' fastest together.
    assert greatest_speed(result) < sum(greatest_speed(one) for one in (source, to, target))
    # Feet are not held to the floor and slide more than they did, yet less than the figure travels.
    assert foot_sliding(target) < foot_sliding(result) < most_sliding
    # What was added is what the style is, joint by joint; the root's is without headings, found anew.
    style, added = (list(residual(*pair).joint_energy.values()) for pair in ((source, to), (result, target)))
    np.testing.assert_allclose(added[1:], style[1:], atol=1e-9)
    write_bvh(result, tmp_path / "result.bvh")
    again = read_motion(tmp_path / "result.bvh", unit=result.unit)
    assert again.frames == result.frames
    order = [again.skeleton.index(name) for name in result.skeleton.names]
    np.testing.assert_allclose(again.positions()[:, order], result.positions(), atol=1e-3)
