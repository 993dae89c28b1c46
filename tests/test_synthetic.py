import csv
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.canonical import CANONICAL_JOINTS, canonical_indices, find_convention
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import (
    ACTIONS,
    BODIES,
    CONVENTIONS,
    DEFAULT_BODY,
    STYLES,
    SyntheticTake,
    synthetic_library,
    template,
    template_frames,
    write_library,
)
from motionary.pipeline.synthetic.library import random_warp
from motionary.pipeline.synthetic.posture import mirrored, pose
from motionary.pipeline.synthetic.styles import NEUTRAL, apply

TOE_HEIGHT = 0.025
SIDES = ("left", "right")


@pytest.fixture(scope="module")
def library() -> list[SyntheticTake]:
    return synthetic_library(seed=0)


def canonical_metres(motion) -> dict[str, np.ndarray]:
    indices = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
    places = motion.positions()[:, indices] * motion.unit
    return dict(zip(CANONICAL_JOINTS, np.moveaxis(places, 1, 0), strict=True))


def stacked(joints: dict[str, np.ndarray]) -> np.ndarray:
    return np.stack([joints[name] for name in CANONICAL_JOINTS], axis=1)


def facing(joints: dict[str, np.ndarray]) -> np.ndarray:
    across = joints["left_hip"] - joints["right_hip"] + joints["left_shoulder"] - joints["right_shoulder"]
    forward = np.stack([-across[:, 2], 0 * across[:, 0], across[:, 0]], axis=1)
    return forward / np.linalg.norm(forward, axis=1, keepdims=True)


def faced_to_z(points: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Turn points (T, J, 3) about Y so that `forward` (3,) becomes +Z."""
    left = np.array([forward[2], 0.0, -forward[0]])
    return np.stack([points @ left, points[..., 1], points @ forward], axis=-1)


def test_holds_eight_actions_in_five_styles_by_several_bodies_on_two_skeletons(library):
    assert len(library) == 80
    assert Counter(t.action for t in library) == dict.fromkeys(
        ("walk", "run", "jump", "kick", "punch", "wave", "squat", "throw"), 10
    )
    assert Counter(t.style for t in library) == dict.fromkeys(STYLES, 16)
    assert len(STYLES) == 5
    assert {t.subject for t in library} == set(BODIES)
    assert len(BODIES) >= 4
    for action in ACTIONS:
        of_action = [t for t in library if t.action == action]
        assert {t.convention for t in of_action} == {"mixamo", "cmu-bvh"}
        assert {t.is_mirrored for t in of_action} == {True, False}
        assert {t.motion.fps for t in of_action} == {30.0, 60.0}
    assert len({t.path for t in library}) == len(library)


def test_the_conventions_are_those_that_canonical_knows(library):
    for one in library:
        assert find_convention(one.motion.skeleton.names).name == one.convention


def test_takes_differ_in_heading_place_speed_and_starting_phase(library):
    headings = [np.arctan2(*facing(canonical_metres(t.motion))[0, [0, 2]]) for t in library]
    assert np.histogram(headings, bins=6, range=(-np.pi, np.pi))[0].min() >= 3
    places = np.array([t.motion.root_position[0, [0, 2]] * t.motion.unit for t in library])
    assert np.ptp(places, axis=0).min() > 3
    for action in ACTIONS:
        seconds = [t.motion.seconds for t in library if t.action == action]
        assert max(seconds) > 1.5 * min(seconds)
    for gait in ("walk", "run"):
        cycle = (template_frames(gait) - 1) / ACTIONS[gait].cycles
        phases = [t.warp[0] / cycle for t in library if t.action == gait]
        assert 0 <= min(phases) < 0.2
        assert 0.8 < max(phases) <= 1


def test_a_seed_is_one_library(library):
    again = synthetic_library(seed=0)
    for first, second in zip(library, again, strict=True):
        assert first.path == second.path
        assert first.motion.skeleton == second.motion.skeleton
        assert np.array_equal(first.warp, second.warp)
        assert np.array_equal(first.motion.rotations, second.motion.rotations)
        assert np.array_equal(first.motion.root_position, second.motion.root_position)
    other = synthetic_library(seed=1)
    assert not any(np.array_equal(a.warp, b.warp) for a, b in zip(library, other, strict=True))


def test_seed_0_is_the_same_on_every_machine(library):
    assert library[0].motion.name == "walk_neutral_alex_01"
    np.testing.assert_allclose(
        library[0].warp[[0, 30, -1]], [9.84283271, 41.96511951, 75.84283271], atol=1e-7
    )
    ankle = template("kick").skeleton.index("RightFoot")
    np.testing.assert_allclose(
        template("kick").positions()[25, ankle], [-9.05571422, 74.01753504, 76.9322777], atol=1e-6
    )


def test_more_takes_leave_the_first_ones_alone(library):
    more = {t.path: t for t in synthetic_library(seed=0, takes=3)}
    assert len(more) == 120
    for one in library:
        assert np.array_equal(one.motion.rotations, more[one.path].motion.rotations)


@pytest.mark.parametrize("action", ACTIONS)
@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_both_skeletons_show_the_same_pose(action, style):
    time = np.linspace(0, 1, 9)
    for body in BODIES.values():
        posture = pose(apply(style, ACTIONS[action].curves(time, style)), body)
        one, other = (
            stacked(canonical_metres(c.motion(posture, body, 30.0, "x"))) for c in CONVENTIONS.values()
        )
        np.testing.assert_allclose(one, other, atol=1e-9)


def test_the_skeletons_differ_in_names_units_and_rest():
    mixamo, cmu = (c.skeleton(DEFAULT_BODY) for c in CONVENTIONS.values())
    assert (len(mixamo.names), len(cmu.names)) == (22, 31)
    shank = [s.offsets[s.index("LeftLeg")] for s in (mixamo, cmu)]
    np.testing.assert_allclose(shank[0], [0, -43, 0], atol=1e-9)
    np.testing.assert_allclose(np.degrees(np.arctan2(shank[1][0], -shank[1][1])), 20)
    np.testing.assert_allclose(np.linalg.norm(shank[1]) * 2.54 / 0.45, 43)


def test_motions_are_smooth(library):
    for one in library:
        positions = one.motion.positions() * one.motion.unit / BODIES[one.subject].leg
        speed = np.linalg.norm(np.diff(positions, axis=0), axis=-1) * one.motion.fps
        acceleration = np.linalg.norm(np.diff(positions, 2, axis=0), axis=-1) * one.motion.fps**2
        assert speed.max() < 25, one.path
        assert acceleration.max() < 650, one.path


def test_curves_have_no_jump_at_any_scale():
    # A jump in position or in speed would not shrink as the template is sampled more finely.
    for name in ACTIONS:
        coarse, fine = (template(name, fps=fps).positions() for fps in (240.0, 960.0))
        step, finer = (np.linalg.norm(np.diff(p, axis=0), axis=-1).max() for p in (coarse, fine))
        assert finer < 0.3 * step, name
        turn, finer_turn = (np.linalg.norm(np.diff(p, 2, axis=0), axis=-1).max() for p in (coarse, fine))
        assert finer_turn < 0.12 * turn, name


def test_feet_are_on_the_floor_and_do_not_slide(library):
    for one in library:
        joints = canonical_metres(one.motion)
        lowest = np.minimum(*(joints[f"{side}_toe"][:, 1] for side in SIDES))
        assert lowest.min() > TOE_HEIGHT - 1e-6, one.path
        assert min(joints[f"{side}_ankle"][:, 1].min() for side in SIDES) > 0.04, one.path
        if one.action not in ("run", "jump"):
            assert lowest.max() < TOE_HEIGHT + 0.002, one.path
        for side in SIDES:
            toe = joints[f"{side}_toe"]
            down = toe[:, 1] < TOE_HEIGHT + 0.001
            sliding = np.linalg.norm(np.diff(toe[:, [0, 2]], axis=0), axis=1) * one.motion.fps
            assert (sliding * (down[1:] & down[:-1])).max(initial=0) < 0.1, one.path


def test_knees_and_elbows_bend_the_right_way_and_heads_are_up(library):
    for one in library:
        joints = canonical_metres(one.motion)
        assert (joints["head"][:, 1] > joints["neck"][:, 1]).all(), one.path
        assert (joints["neck"][:, 1] > joints["pelvis"][:, 1] + 0.1).all(), one.path
        hips = joints["left_hip"] - joints["right_hip"]
        for side in SIDES:
            hip, knee, ankle = (joints[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
            bend = np.cross(knee - hip, ankle - knee)
            # Flexion turns the shank backwards about the axis through both hips.
            assert (np.sum(bend * hips, axis=1) > 0).all(), one.path


def test_gaits_go_where_they_face_on_alternate_feet(library):
    for one in (t for t in library if t.action in ("walk", "run")):
        joints = canonical_metres(one.motion)
        forward = facing(joints).mean(axis=0)
        travel = joints["pelvis"][-1] - joints["pelvis"][0]
        assert travel @ forward > 0.95 * np.linalg.norm(travel[[0, 2]]) > 1.0
        lead = (joints["left_ankle"] - joints["right_ankle"]) @ forward
        arms = (joints["left_wrist"] - joints["right_wrist"]) @ forward
        assert np.corrcoef(lead, arms)[0, 1] < -0.7, one.path
        changes = np.count_nonzero(np.diff(np.sign(lead)))
        assert abs(changes - 2 * ACTIONS[one.action].taken) <= 1, one.path
        flight = np.minimum(joints["left_toe"][:, 1], joints["right_toe"][:, 1]) > TOE_HEIGHT + 0.01
        assert flight.any() == (one.action == "run"), one.path


def leg_and_arm(one: SyntheticTake) -> tuple[float, float]:
    body = BODIES[one.subject]
    return body.leg, body.upper_arm + body.forearm


def test_every_action_does_what_it_is_called(library):
    for one in library:
        joints = canonical_metres(one.motion)
        leg, arm = leg_and_arm(one)
        side, other = ("left", "right") if one.is_mirrored else ("right", "left")
        drop = np.ptp(joints["pelvis"][:, 1]) / leg
        if one.action == "jump":
            assert np.minimum(*(joints[f"{s}_toe"][:, 1] for s in SIDES)).max() > 0.12 * leg
        elif one.action == "squat":
            assert drop > 0.33
        elif one.action == "kick":
            assert joints[f"{side}_ankle"][:, 1].max() > 0.75 * leg
            assert joints[f"{other}_toe"][:, 1].max() < TOE_HEIGHT + 0.002
        elif one.action == "punch":
            reach = np.linalg.norm(joints[f"{side}_wrist"] - joints[f"{side}_shoulder"], axis=1) / arm
            stance = joints[f"{other}_toe"] - joints[f"{side}_toe"]
            ahead = np.sum((joints[f"{side}_wrist"] - joints["pelvis"]) * stance, axis=1)
            assert reach.max() > 0.85
            assert (ahead / np.linalg.norm(stance, axis=1))[reach.argmax()] > 0.5 * leg
        elif one.action == "wave":
            up = joints[f"{side}_wrist"][:, 1] > joints["head"][:, 1]
            assert up.mean() > 0.4
            assert not (joints[f"{other}_wrist"][:, 1] > joints["chest"][:, 1]).any()
        elif one.action == "throw":
            assert (joints[f"{side}_wrist"][:, 1] > joints["head"][:, 1]).any()
            assert np.linalg.norm(joints["pelvis"][-1] - joints["pelvis"][0]) > 0.15 * leg


def test_warps_increase_strictly_within_the_template(library):
    for one in library:
        assert one.warp.shape == (one.motion.frames,)
        assert one.warp.dtype == np.float64
        assert (np.diff(one.warp) > 0).all()
        last = template_frames(one.action) - 1
        assert template(one.action).frames == last + 1
        if ACTIONS[one.action].cycles == 1:
            np.testing.assert_allclose(one.warp[[0, -1]], [0, last], atol=1e-12)
        else:
            assert one.warp[0] >= 0
            assert one.warp[-1] <= last + 1e-9


def test_warps_are_not_uniform(library):
    bent = [np.abs(t.warp - np.linspace(t.warp[0], t.warp[-1], len(t.warp))).max() for t in library]
    assert np.median(bent) > 1.5


@pytest.mark.parametrize("action", ACTIONS)
def test_the_plain_take_is_its_template_seen_through_its_warp(library, action):
    one = next(t for t in library if (t.action, t.style, t.take) == (action, "neutral", 1))
    assert (one.subject, one.is_mirrored) == (DEFAULT_BODY.name, False)
    finer = template(action, fps=480.0).sampled(one.warp * 16)
    expected, got = canonical_metres(finer), canonical_metres(one.motion)
    placed = [stacked(joints) - joints["pelvis"][0] * (1, 0, 1) for joints in (expected, got)]
    placed = [faced_to_z(p, facing(j)[0]) for p, j in zip(placed, (expected, got), strict=True)]
    np.testing.assert_allclose(placed[1], placed[0], atol=1e-3)
    wrong = stacked(
        canonical_metres(template(action).sampled(np.linspace(*one.warp[[0, -1]], len(one.warp))))
    )
    assert np.abs(wrong - stacked(expected)).max() > 0.02


def test_a_styled_take_is_nearest_its_template_near_its_warp(library):
    for one in (t for t in library if not t.is_mirrored and ACTIONS[t.action].cycles == 1):
        shown = template(one.action).sampled(one.warp)
        bent = np.clip(one.warp + 6, 0, template_frames(one.action) - 1)
        late = template(one.action).sampled(bent)
        takes = [canonical_metres(m) for m in (one.motion, shown, late)]
        pose_of = [
            faced_to_z(stacked(j) - j["pelvis"][:1, None], facing(j)[0]) / leg
            for j, leg in zip(takes, (BODIES[one.subject].leg, *[DEFAULT_BODY.leg] * 2), strict=True)
        ]
        right, wrong = (np.sqrt(np.mean((pose_of[0] - p) ** 2)) for p in pose_of[1:])
        assert right < wrong, one.path


def test_mirroring_swaps_left_and_right():
    for name, action in ACTIONS.items():
        posture = pose(action.curves(np.linspace(0, 1, 20), NEUTRAL), DEFAULT_BODY)
        for convention in CONVENTIONS.values():
            plain, swapped = (
                canonical_metres(convention.motion(p, DEFAULT_BODY, 30.0, name))
                for p in (posture, mirrored(posture))
            )
            for joint in CANONICAL_JOINTS:
                side, _, part = joint.partition("_")
                twin = {"left": f"right_{part}", "right": f"left_{part}"}.get(side, joint)
                np.testing.assert_allclose(swapped[twin], plain[joint] * (-1, 1, 1), atol=1e-12)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32), frames=st.integers(2, 400))
def test_random_warps_are_smooth_increasing_maps_of_the_unit_interval(seed, frames):
    warp = random_warp(np.linspace(0, 1, frames), np.random.default_rng(seed))
    assert warp[0] == 0
    assert warp[-1] == pytest.approx(1, abs=1e-12)
    speed = np.diff(warp) * (frames - 1)
    assert 0.39 < speed.min() <= speed.max() < 1.61


def test_a_written_library_reads_back(tmp_path: Path):
    write_library(tmp_path, seed=3, clips=40)
    written = synthetic_library(seed=3, takes=1)
    assert len(list(tmp_path.rglob("*.bvh"))) == 40
    with (tmp_path / "labels.csv").open(encoding="utf-8") as file:
        labels = list(csv.DictReader(file))
    assert list(labels[0]) == ["path", "action", "style", "subject", "take", "description"]
    for one, row in zip(written, labels, strict=True):
        assert (tmp_path / row["path"]).is_file()
        assert (row["action"], row["style"], row["subject"]) == (one.action, one.style, one.subject)
    with (tmp_path / "warps.csv").open(encoding="utf-8") as file:
        warps = list(csv.DictReader(file))
    assert len(warps) == sum(t.motion.frames for t in written)
    of_last = [float(row["template_frame"]) for row in warps if row["path"] == written[-1].path]
    np.testing.assert_allclose(of_last, written[-1].warp, atol=1e-6)
    for convention in CONVENTIONS:
        one = next(t for t in written if t.convention == convention)
        read = read_motion(tmp_path / one.path)
        assert read.skeleton.names == one.motion.skeleton.names
        assert read.fps == pytest.approx(one.motion.fps, rel=1e-4)
        assert read.frames == one.motion.frames
        error = np.abs(read.positions() - one.motion.positions()).max() * one.motion.unit
        assert error < 1e-4


def test_nearest_neighbours_are_mostly_of_the_same_action(library):
    vectors = []
    for one in library:
        joints = canonical_metres(one.motion.sampled(np.linspace(0, one.motion.frames - 1, 24)))
        poses = stacked(joints) - joints["pelvis"][:, None] * (1, 0, 1)
        turned = [faced_to_z(p[None], f)[0] for p, f in zip(poses, facing(joints), strict=True)]
        vectors.append(np.ravel(turned) / BODIES[one.subject].leg)
    vectors = np.array(vectors)
    distance = np.linalg.norm(vectors[:, None] - vectors, axis=-1)
    np.fill_diagonal(distance, np.inf)
    actions = np.array([t.action for t in library])
    assert np.mean(actions[distance.argmin(axis=1)] == actions) > 0.85


def test_names_what_is_wrong():
    with pytest.raises(ValueError, match="no action 'dance'; the actions are walk"):
        template("dance")
    with pytest.raises(ValueError, match="takes is 0"):
        synthetic_library(takes=0)
