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
