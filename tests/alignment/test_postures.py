from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment.adaptive import adaptive_dtw
from motionary.pipeline.alignment.postures import (
    linearised_postures,
    posture_weights,
    weighted_postures,
)
from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    Convention,
    UnknownSkeletonError,
    canonical_indices,
    find_convention,
)
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import synthetic_library


def arm(rotations: np.ndarray, names: tuple[str, ...] = ("root", "upper", "fore")) -> Motion:
    skeleton = Skeleton(names, (-1, 0, 1), np.zeros((3, 3)))
    return Motion("arm", skeleton, 30.0, np.zeros((len(rotations), 3)), rotations)


def turns(*vectors: np.ndarray) -> np.ndarray:
    return np.stack([Rotation.from_rotvec(one).as_quat() for one in vectors], axis=1)


def test_small_turns_about_a_mean_come_out_as_they_are() -> None:
    rng = np.random.default_rng(0)
    mean = Rotation.from_euler("xyz", [40, -70, 130], degrees=True)
    small = rng.uniform(-0.2, 0.2, (20, 3))
    small = np.concatenate([small, -small])  # so that the mean is the mean
    upper = (mean * Rotation.from_rotvec(small)).as_quat() * rng.choice([-1, 1], (40, 1))
    motion = arm(np.stack([np.tile([0.0, 0, 0, 1], (40, 1)), upper, upper], axis=1))
    moving, reference = linearised_postures(arm(motion.rotations[3:9]), motion, 30.0)
    np.testing.assert_allclose(reference[:, 3:6], small, atol=1e-7)
    np.testing.assert_allclose(moving, reference[3:9], atol=1e-12)
    assert not reference[:, :3].any()


def test_the_mean_is_the_references() -> None:
    still = arm(turns(np.zeros((5, 3)), np.tile([0.0, 0, 0.3], (5, 1)), np.zeros((5, 3))))
    other = arm(turns(np.zeros((4, 3)), np.tile([0.0, 0, 0.5], (4, 1)), np.tile([0.1, 0, 0], (4, 1))))
    moving, reference = linearised_postures(other, still, 30.0)
    np.testing.assert_allclose(reference, 0, atol=1e-12)
    np.testing.assert_allclose(moving, np.tile([0, 0, 0, 0, 0, 0.2, 0.1, 0, 0], (4, 1)), atol=1e-12)


def test_heading_is_no_posture_and_leaning_is() -> None:
    headings = np.outer(np.linspace(0, 6, 9), [0.0, 1, 0])
    nothing = np.zeros((9, 3))
    still, turning = arm(turns(nothing, nothing, nothing)), arm(turns(headings, nothing, nothing))
    np.testing.assert_allclose(linearised_postures(turning, still, 30.0)[0], 0, atol=1e-12)
    leaning = arm(turns(np.tile([0.1, 0, 0], (9, 1)), nothing, nothing))
    lean = linearised_postures(leaning, still, 30.0)[0][:, :3]
    np.testing.assert_allclose(np.linalg.norm(lean, axis=1), 2 * np.sin(0.05), atol=1e-12)


def test_joints_go_by_name_and_rates_by_seconds() -> None:
    rng = np.random.default_rng(3)
    motion = arm(turns(*rng.uniform(-0.4, 0.4, (3, 41, 3))))
    skeleton = Skeleton(("root", "fore", "upper"), (-1, 0, 0), np.zeros((3, 3)))
    shuffled = replace(motion, skeleton=skeleton, rotations=motion.rotations[:, [0, 2, 1]])
    moving, reference = linearised_postures(shuffled, motion, 10.0)
    np.testing.assert_array_equal(moving, reference)
    assert moving.shape == (14, 9)
    with pytest.raises(ValueError, match="other joints: fore, hand in one alone; .* reads features"):
        linearised_postures(arm(motion.rotations, ("root", "upper", "hand")), motion, 30.0)


def test_markers_have_no_postures() -> None:
    motion = arm(turns(*np.zeros((3, 6, 3))))
    markers = replace(motion, rotations=np.empty((6, 0, 4)), places=np.zeros((6, 3, 3)), name="dots")
    for pair in ((markers, motion), (motion, markers)):
        with pytest.raises(ValueError, match="'dots' was captured as markers, .* reads features"):
            linearised_postures(*pair, 30.0)


NAMES = {
    "Hips": "", "Spine": "Hips", "Chest": "Spine", "Neck": "Chest", "Head": "Neck",
    "Shoulder_R": "Chest", "UpperArm_R": "Shoulder_R", "LowerArm_R": "UpperArm_R", "Hand_R": "LowerArm_R",
    "Shoulder_L": "Chest", "UpperArm_L": "Shoulder_L", "LowerArm_L": "UpperArm_L", "Hand_L": "LowerArm_L",
    "Finger_L": "Hand_L", "Tip_L": "Finger_L",
    "UpperLeg_R": "Hips", "LowerLeg_R": "UpperLeg_R", "Foot_R": "LowerLeg_R", "Toes_R": "Foot_R",
    "UpperLeg_L": "Hips", "LowerLeg_L": "UpperLeg_L", "Foot_L": "LowerLeg_L", "Toes_L": "Foot_L",
}  # fmt: skip


def test_weights_are_of_limbs_and_of_the_mass_that_is_moved() -> None:
    names = tuple(NAMES)
    parents = tuple(names.index(parent) if parent else -1 for parent in NAMES.values())
    skeleton = Skeleton(names, parents, np.zeros((len(names), 3)))
    columns = posture_weights(skeleton).reshape(-1, 3)
    assert (columns == columns[:, :1]).all()
    weight = dict(zip(names, columns[:, 0], strict=True))
    assert weight["Hips"] == weight["Hand_R"] == weight["Hand_L"] == 1
    # A hand of three joints spreads its mass over them; the collarbones share that of the chest.
    assert weight["Finger_L"] == pytest.approx(2 / 3)
    assert weight["Tip_L"] == pytest.approx(1 / 3)
    upper = 0.142 + 0.139 + 0.216 + 0.081 + 2 * (0.028 + 0.016)
    assert weight["Spine"] == pytest.approx((upper - 0.142) / upper)
    assert weight["Shoulder_L"] == pytest.approx((0.216 / 3 + 0.028 + 0.016) / upper)
    assert weight["LowerArm_R"] == pytest.approx(0.016 / upper)
    assert weight["UpperLeg_R"] == weight["UpperLeg_L"] == 0.5
    assert weight["LowerLeg_L"] == pytest.approx(0.5 * (0.0465 + 0.0145) / (0.1 + 0.0465 + 0.0145))
    assert min(weight.values()) > 0


def test_a_skeleton_of_no_convention_has_no_weights() -> None:
    with pytest.raises(UnknownSkeletonError):
        posture_weights(arm(turns(*np.zeros((3, 2, 3)))).skeleton)


def test_weighted_postures_need_no_weights_besides() -> None:
    moving, reference = (
        take.motion
        for take in synthetic_library()
        if take.path in ("walk/walk_energetic_dora_01.bvh", "walk/walk_tired_bea_02.bvh")
    )
    plain = linearised_postures(moving, reference, 30.0)
    weights = posture_weights(reference.skeleton)
    weighted = weighted_postures(moving, reference, 30.0)
    for ours, raw in zip(weighted, plain, strict=True):
        np.testing.assert_allclose(ours**2, raw**2 * weights, rtol=1e-12)
    warp = adaptive_dtw(*plain, weights)
    np.testing.assert_array_equal(adaptive_dtw(*weighted).path, warp.path)
    assert not np.array_equal(adaptive_dtw(*plain).path, warp.path)


def test_weighted_postures_know_a_users_own_joint_names() -> None:
    motion = synthetic_library()[0].motion
    own = find_convention(motion.skeleton.names)
    skeleton = replace(motion.skeleton, names=tuple(f"q{k}" for k in range(len(motion.skeleton.names))))
    places = canonical_indices(motion.skeleton, own)
    mine = Convention("mine", {joint: f"q{k}" for joint, k in zip(CANONICAL_JOINTS, places, strict=True)})
    renamed = replace(motion, skeleton=skeleton)
    for ours, usual in zip(
        weighted_postures(renamed, renamed, 30.0, [mine]),
        weighted_postures(motion, motion, 30.0),
        strict=True,
    ):
        np.testing.assert_array_equal(ours, usual)
    with pytest.raises(UnknownSkeletonError):
        weighted_postures(renamed, renamed, 30.0)


def test_every_take_of_the_embedded_library_has_postures_and_weights() -> None:
    takes = synthetic_library()[::9]
    for take in takes:
        motion = take.motion
        postures, _ = linearised_postures(motion, motion, 30.0)
        weights = posture_weights(motion.skeleton)
        assert postures.shape[1] == len(weights) == 3 * len(motion.skeleton.names)
        assert (weights > 0).all()
        np.testing.assert_array_equal(
            adaptive_dtw(postures, postures, weights).source_time, np.arange(len(postures))
        )


def test_two_real_takes_have_a_warp(shared_data) -> None:
    folder = shared_data / "hdm05"
    moving, reference = (
        read_motion(folder / f"HDM_{take}_120.amc")
        for take in ("bd_sneak2StepsLStart_001", "bk_sneak2StepsLStart_004")
    )
    postures = linearised_postures(moving, reference, 30.0)
    warp = adaptive_dtw(*postures, posture_weights(reference.skeleton))
    assert warp.reference_frames == len(postures[1])
    assert np.abs(postures[0]).max() < np.pi
