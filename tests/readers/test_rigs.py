"""One figure as a BVH of each public rig: whatever joints a rig has between, features are the same.

Hierarchies as LAFAN1, Mixamo, 100STYLE, Xsens MVN and Unreal publish them, from their lists of joints.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import frame_features
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.writers import write_bvh

# Trunk from the top of the file to what the collarbones hang from; neck; left arm from the collarbone; left
# leg; left to right. A star stands by the pelvis, spine, chest, neck and head.
RIGS = {
    "lafan1": (
        "Hips* Spine Spine1* Spine2*",
        "Neck* Head*",
        "LeftShoulder LeftArm LeftForeArm LeftHand",
        "LeftUpLeg LeftLeg LeftFoot LeftToe",
        ("Left", "Right"),
    ),
    "mixamo": (
        "mixamorig:Hips* mixamorig:Spine mixamorig:Spine1* mixamorig:Spine2*",
        "mixamorig:Neck* mixamorig:Head* mixamorig:HeadTop_End",
        "mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand "
        "mixamorig:LeftHandIndex1",
        "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:LeftToeBase "
        "mixamorig:LeftToe_End",
        ("Left", "Right"),
    ),
    "xsens": (
        "Hips* Chest Chest2* Chest3 Chest4*",
        "Neck* Head*",
        "LeftCollar LeftShoulder LeftElbow LeftWrist",
        "LeftHip LeftKnee LeftAnkle LeftToe",
        ("Left", "Right"),
    ),
    "xsens-mvn": (
        "Pelvis* L5 L3* T12 T8*",
        "Neck* Head*",
        "LeftShoulder LeftUpperArm LeftForeArm LeftHand",
        "LeftUpperLeg LeftLowerLeg LeftFoot LeftToe",
        ("Left", "Right"),
    ),
    "unreal-4": (
        "root pelvis* spine_01* spine_02 spine_03*",
        "neck_01* head*",
        "clavicle_l upperarm_l lowerarm_l hand_l index_01_l",
        "thigh_l calf_l foot_l ball_l",
        ("_l$", "_r"),
    ),
    "unreal-5": (
        "root pelvis* spine_01 spine_02* spine_03 spine_04* spine_05",
        "neck_01* neck_02 head*",
        "clavicle_l upperarm_l lowerarm_l hand_l index_01_l",
        "thigh_l calf_l foot_l ball_l",
        ("_l$", "_r"),
    ),
}
BESIDE = {"unreal-4": ("ik_foot_root", "ik_hand_root"), "unreal-5": ("ik_foot_root", "ik_hand_root")}
LEFT = {  # a T-pose in centimetres, Y up, facing +Z
    "shoulder": (18, 142, 0), "elbow": (46, 142, 0), "wrist": (71, 142, 0),
    "hip": (9, 92, 0), "knee": (9, 50, 1), "ankle": (9, 8, 0), "toe": (9, 2, 13),
}  # fmt: skip
REST = {"pelvis": (0, 95, 0), "spine": (0, 108, 0), "chest": (0, 122, 0), "neck": (0, 147, 0)} | {
    "head": (0, 158, 2),
    **{f"left_{name}": place for name, place in LEFT.items()},
    **{f"right_{name}": (-x, y, z) for name, (x, y, z) in LEFT.items()},
}


def tree_of(rig: str) -> dict[str, str | None]:
    """Return the parent of every joint, parents first."""
    trunk, neck, arm, leg, (here, there) = RIGS[rig]
    parents: dict[str, str | None] = {}

    def hang(chain: list[str], above: str | None) -> None:
        for name in chain:
            parents[name] = above
            above = name

    def mirrored(chain: str) -> list[str]:
        return [re.sub(here, there, name) for name in chain.split()]

    joints = trunk.replace("*", "").split()
    hang(joints, None)
    (hip, *_) = re.findall(r"\S+(?=\*)", trunk)
    for chain in (neck.replace("*", "").split(), arm.split(), mirrored(arm)):
        hang(chain, joints[-1])
    for chain in (leg.split(), mirrored(leg)):
        hang(chain, hip)
    return parents | dict.fromkeys(BESIDE.get(rig, ()), joints[0])


def canonical_of(rig: str) -> dict[str, str]:
    """Return which joint of a rig is which canonical one, by its place in the lists above."""
    trunk, neck, arm, leg, (here, there) = RIGS[rig]
    marked = re.findall(r"\S+(?=\*)", f"{trunk} {neck}")
    joints = dict(zip(marked, ("pelvis", "spine", "chest", "neck", "head"), strict=True))
    sides = [*arm.split()[1:4], *leg.split()[:4]]
    for name, joint in zip(sides, LEFT, strict=True):
        joints |= {name: f"left_{joint}", re.sub(here, there, name): f"right_{joint}"}
    return joints


def figure(rig: str, frames: int = 25) -> Motion:
    """Return the figure, which walks, turns and bends its canonical joints, and no others, in a rig."""
    parents, canonical = tree_of(rig), canonical_of(rig)
    names = [*parents]
    places = {name: np.array(REST[canonical[name]], float) for name in canonical}
    for name in names:  # joints between and beyond lie a little beside what they hang from
        places.setdefault(name, places[parents[name]] + [1.0, 2.0, 0.5] if parents[name] else np.zeros(3))
    offsets = [places[name] - places[parents[name]] if parents[name] else np.zeros(3) for name in names]
    indices = [-1 if parents[name] is None else names.index(str(parents[name])) for name in names]
    time = np.linspace(0, 1, frames)
    rotations = np.tile([0.0, 0, 0, 1], (frames, len(names), 1))
    for name, joint in canonical.items():
        seed = np.random.default_rng(CANONICAL_JOINTS.index(joint))
        bend = np.outer(np.sin(2 * np.pi * time + seed.uniform(0, 6)), 0.4 * seed.normal(size=3))
        rotations[:, names.index(name)] = Rotation.from_rotvec(bend).as_quat()
    path = np.column_stack([20 * time, 0 * time, 90 * time])
    return Motion(
        "figure",
        Skeleton(tuple(names), tuple(indices), np.array(offsets)),
        30,
        path + places[names[0]],
        rotations,
    )


@pytest.mark.parametrize("rig", RIGS)
def test_a_rig_is_read_and_gives_the_features_of_any_other(rig: str, tmp_path: Path) -> None:
    features = {}
    for name in ("lafan1", rig):
        write_bvh(figure(name), tmp_path / f"{name}.bvh")
        features[name] = frame_features(read_motion(tmp_path / f"{name}.bvh"), FeatureConfig())
    assert features[rig].convention == rig
    assert features[rig].leg_length == pytest.approx(features["lafan1"].leg_length, rel=1e-6)

    np.testing.assert_allclose(features[rig].heading, features["lafan1"].heading, atol=1e-5)
    np.testing.assert_allclose(features[rig].values, features["lafan1"].values, atol=1e-5)


def test_control_joints_beside_the_pelvis_are_left_out(tmp_path: Path) -> None:
    write_bvh(figure("unreal-5"), tmp_path / "x.bvh")
    read = read_motion(tmp_path / "x.bvh")
    assert read.skeleton.names[0] == "pelvis"
    assert not {"ik_foot_root", "ik_hand_root", "root"} & set(read.skeleton.names)
    assert any("composed into the pelvis 'pelvis': root" in note for note in read.notes)
