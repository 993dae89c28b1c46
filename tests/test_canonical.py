"""Which joint is which, in every convention."""

import pytest

from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    CANONICAL_PARENTS,
    CONVENTIONS,
    Convention,
    UnknownSkeletonError,
    find_convention,
)


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda one: one.name)
def test_a_convention_names_nineteen_different_joints_and_mirrors_them(convention):
    names = [convention.joints[joint] for joint in CANONICAL_JOINTS]
    assert len(set(names)) == len(CANONICAL_JOINTS)
    for joint in CANONICAL_JOINTS:
        if joint.startswith("left_"):
            assert convention.joints[joint] != convention.joints[joint.replace("left_", "right_")]


@pytest.mark.parametrize("convention", CONVENTIONS, ids=lambda one: one.name)
def test_a_convention_is_found_by_its_own_joints(convention):
    found = find_convention([*convention.joints.values(), "Weapon"])
    assert [found.joints[j] for j in CANONICAL_JOINTS] == [convention.joints[j] for j in CANONICAL_JOINTS]


def test_names_mislead_and_are_mapped_by_convention():
    mixamo = next(one for one in CONVENTIONS if one.name == "mixamo")
    assert (mixamo.joints["left_shoulder"], mixamo.joints["left_knee"]) == ("LeftArm", "LeftLeg")
    xsens = next(one for one in CONVENTIONS if one.name == "xsens")
    assert xsens.joints["right_shoulder"] == "RightShoulder"


@pytest.mark.parametrize("prefix", ["mixamorig:", "mixamorig1:", "mixamorig_", "Character1_", "rig:ns:"])
def test_namespaces_and_case_do_not_matter(prefix):
    mixamo = next(one for one in CONVENTIONS if one.name == "mixamo")
    names = [prefix + name.upper() for name in mixamo.joints.values()]
    assert find_convention(names).name == "mixamo"


def test_an_unknown_skeleton_is_told_the_nearest_convention():
    bandai = next(one for one in CONVENTIONS if one.name == "bandai")
    names = [name for name in bandai.joints.values() if name != "Toes_L"]
    with pytest.raises(
        UnknownSkeletonError, match=r"nearest, 'bandai', misses Toes_L; .* UpperArm_L.*\[conventions"
    ):
        find_convention(names)


def test_a_users_convention_comes_first():
    own = Convention("robot", {joint: f"bone_{n}" for n, joint in enumerate(CANONICAL_JOINTS)})
    assert find_convention([f"bone_{n}" for n in range(19)], extra=(own,)) is own


def test_a_users_convention_is_checked():
    with pytest.raises(ValueError, match="missing.*'right_toe'"):
        Convention("short", dict.fromkeys(CANONICAL_JOINTS[:-1], "x"))


def test_the_drawing_tree_has_parents_before_children():
    assert len(CANONICAL_PARENTS) == len(CANONICAL_JOINTS)
    assert all(parent < joint for joint, parent in enumerate(CANONICAL_PARENTS))


# Joint lists as these rigs are exported.
ARMS = "LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand"
REAL = {
    "mixamo": f"""Hips Spine Spine1 Spine2 Neck Head HeadTop_End {ARMS}
        LeftUpLeg LeftLeg LeftFoot LeftToeBase LeftToe_End
        RightUpLeg RightLeg RightFoot RightToeBase RightToe_End""",
    "lafan1": f"""Hips LeftUpLeg LeftLeg LeftFoot LeftToe RightUpLeg RightLeg RightFoot RightToe
        Spine Spine1 Spine2 Neck Head {ARMS}""",
    "humanik": f"""Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg RightFoot RightToeBase
        Spine Spine1 {ARMS} Neck Head""",
    "xsens": """Hips Chest Chest2 Chest3 Chest4 Neck Head RightCollar RightShoulder RightElbow RightWrist
        LeftCollar LeftShoulder LeftElbow LeftWrist RightHip RightKnee RightAnkle RightToe
        LeftHip LeftKnee LeftAnkle LeftToe""",
    "xsens-mvn": """Pelvis L5 L3 T12 T8 Neck Head RightShoulder RightUpperArm RightForeArm RightHand
        LeftShoulder LeftUpperArm LeftForeArm LeftHand RightUpperLeg RightLowerLeg RightFoot RightToe
        LeftUpperLeg LeftLowerLeg LeftFoot LeftToe""",
    "smpl": """Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck
        L_Collar R_Collar Head L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist L_Hand R_Hand""",
    "smpl-x": """pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3
        left_foot right_foot neck left_collar right_collar head left_shoulder right_shoulder left_elbow
        right_elbow left_wrist right_wrist jaw""",
    "unreal-4": """root pelvis spine_01 spine_02 spine_03 clavicle_l upperarm_l lowerarm_l hand_l
        clavicle_r upperarm_r lowerarm_r hand_r neck_01 head
        thigh_l calf_l foot_l ball_l thigh_r calf_r foot_r ball_r""",
    "unreal-5": """root pelvis spine_01 spine_02 spine_03 spine_04 spine_05 clavicle_l upperarm_l lowerarm_l
        hand_l clavicle_r upperarm_r lowerarm_r hand_r neck_01 neck_02 head
        thigh_l calf_l foot_l ball_l thigh_r calf_r foot_r ball_r""",
}


@pytest.mark.parametrize("name", REAL)
def test_exported_rigs_are_recognised(name):
    assert find_convention(REAL[name].split()).name == name
