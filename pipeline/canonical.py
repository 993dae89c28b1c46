"""Joint-name conventions -> the 19 canonical joints.

Every skeleton that motionary compares is seen through the same 19 joints. A *convention* says which of a
skeleton's joints is which canonical one. Names mislead across conventions (`LeftArm` is the shoulder joint,
`LeftLeg` the knee, `LeftShoulder` the clavicle), so the mapping is always by a whole convention, never joint
by joint. Where a spine has more than two joints between pelvis and neck, those nearest to a third and two
thirds of the way are taken, as in the CMU skeleton.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionary.pipeline.motion import Skeleton

CANONICAL_JOINTS: tuple[str, ...] = (
    "pelvis",
    "spine",
    "chest",
    "neck",
    "head",
    "left_shoulder",
    "left_elbow",
    "left_wrist",
    "right_shoulder",
    "right_elbow",
    "right_wrist",
    "left_hip",
    "left_knee",
    "left_ankle",
    "left_toe",
    "right_hip",
    "right_knee",
    "right_ankle",
    "right_toe",
)
"""The joints of a canonical pose, in the order of its columns."""

CANONICAL_PARENTS: tuple[int, ...] = (-1, 0, 1, 2, 3, 2, 5, 6, 2, 8, 9, 0, 11, 12, 13, 0, 15, 16, 17)
"""For each canonical joint the one it hangs from, for drawing."""


class SkeletonError(ValueError):
    """A skeleton cannot be compared; `what` says why, `mend` what to do."""

    def __init__(self, what: str, mend: str) -> None:
        super().__init__(what, mend)
        self.what = what
        self.mend = mend

    def __str__(self) -> str:
        return f"{self.what}; {self.mend}"


class UnknownSkeletonError(SkeletonError):
    """No convention fits a skeleton; `what` says which came nearest."""


@dataclass(frozen=True)
class Convention:
    """Which joint of a skeleton is which canonical joint.

    Parameters
    ----------
    name : str
        What the convention is called.
    joints : mapping of str to str
        For each canonical joint the skeleton's joint, or the markers that it is the mean of, see
        `motionary.pipeline.readers.markers`. Names are compared without case and without a namespace
        (`mixamorig:Hips` is `hips`).

    Raises
    ------
    ValueError
        A canonical joint is missing or a name is not one.
    """

    name: str
    joints: Mapping[str, str]

    def __post_init__(self) -> None:
        unknown = sorted(set(self.joints) - set(CANONICAL_JOINTS))
        missing = [joint for joint in CANONICAL_JOINTS if joint not in self.joints]
        if unknown or missing:
            raise ValueError(
                f"convention {self.name!r}: unknown canonical joints {unknown}, missing {missing}; "
                f"the canonical joints are {', '.join(CANONICAL_JOINTS)}"
            )


def find_convention(joint_names: Sequence[str], extra: Iterable[Convention] = ()) -> Convention:
    """Return the convention that a skeleton's joint names follow.

    Parameters
    ----------
    joint_names : sequence of str
        Names of the skeleton's joints, in any order.
    extra : iterable of Convention
        A user's own conventions; they come before the built-in ones.

    Returns
    -------
    Convention
        The first that finds all its 19 joints.

    Raises
    ------
    UnknownSkeletonError
        None does; the message has the joint names and the nearest convention.
    """
    known = {plain_name(name) for name in joint_names}
    conventions = (*extra, *CONVENTIONS)
    for convention in conventions:
        if not _missing(convention, known):
            return convention
    nearest = min(conventions, key=lambda convention: len(_missing(convention, known)))
    missing = ", ".join(_missing(nearest, known))
    raise UnknownSkeletonError(
        f"no joint-name convention fits this skeleton: the nearest, {nearest.name!r}, misses {missing}; "
        f"the skeleton's joints are {', '.join(joint_names)}",
        "name the 19 canonical joints of this skeleton under [conventions.NAME] in the configuration file",
    )


def canonical_indices(skeleton: Skeleton, convention: Convention) -> np.ndarray:
    """Return the indices (19,) of a skeleton's joints in the order of `CANONICAL_JOINTS`."""
    place: dict[str, int] = {}
    for index, name in enumerate(skeleton.names):
        place.setdefault(plain_name(name), index)
    return np.array(
        [place[plain_name(convention.joints[joint])] for joint in CANONICAL_JOINTS], dtype=np.intp
    )


_NAMESPACE = re.compile(r"^(?:.*:)?(?:mixamorig\d*_|character\d+_)?", re.IGNORECASE)


def plain_name(name: str) -> str:
    """Return a joint's or a marker's name as it is compared: without case and namespace."""
    return _NAMESPACE.sub("", name).lower()


def _missing(convention: Convention, known: set[str]) -> list[str]:
    return [name for name in convention.joints.values() if plain_name(name) not in known]


def _convention(
    name: str, trunk: str, left_arm: str, left_leg: str, right_from: tuple[str, str]
) -> Convention:
    """Build a convention of mirrored names from those of the trunk and the left side."""
    here, there = right_from

    def mirrored(names: str) -> list[str]:
        return [re.sub(here, there, one, count=1) for one in names.split()]

    sides = [*left_arm.split(), *mirrored(left_arm), *left_leg.split(), *mirrored(left_leg)]
    return Convention(name, dict(zip(CANONICAL_JOINTS, [*trunk.split(), *sides], strict=True)))


_HUMAN_ARM = "LeftArm LeftForeArm LeftHand"
_HUMAN_LEG = "LeftUpLeg LeftLeg LeftFoot LeftToeBase"
_HUMAN_SIDES = ("Left", "Right")

# Of two that fit, the first counts: the more particular stand before the more general.
CONVENTIONS: tuple[Convention, ...] = (
    _convention(
        "cmu-asf",
        "root upperback thorax lowerneck head",
        "lhumerus lradius lwrist",
        "lfemur ltibia lfoot ltoes",
        ("^l", "r"),
    ),
    # This export leaves out the thorax: Neck lies on the chest, and Neck1 where an ASF's neck is.
    _convention("cmu-bvh", "Hips Spine Spine1 Neck1 Head", _HUMAN_ARM, _HUMAN_LEG, _HUMAN_SIDES),
    _convention(
        "bandai",
        "Hips Spine Chest Neck Head",
        "UpperArm_L LowerArm_L Hand_L",
        "UpperLeg_L LowerLeg_L Foot_L Toes_L",
        ("_L$", "_R"),
    ),
    _convention(
        "lafan1",
        "Hips Spine1 Spine2 Neck Head",
        _HUMAN_ARM,
        "LeftUpLeg LeftLeg LeftFoot LeftToe",
        _HUMAN_SIDES,
    ),
    _convention("mixamo", "Hips Spine1 Spine2 Neck Head", _HUMAN_ARM, _HUMAN_LEG, _HUMAN_SIDES),
    _convention("humanik", "Hips Spine Spine1 Neck Head", _HUMAN_ARM, _HUMAN_LEG, _HUMAN_SIDES),
    _convention("humanik-chest", "Hips Spine Chest Neck Head", _HUMAN_ARM, _HUMAN_LEG, _HUMAN_SIDES),
    _convention(
        "character-creator",
        "CC_Base_Hip CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head",
        "CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand",
        "CC_Base_L_Thigh CC_Base_L_Calf CC_Base_L_Foot CC_Base_L_ToeBase",
        ("_L_", "_R_"),
    ),
    _convention(
        "xsens",
        "Hips Chest2 Chest4 Neck Head",
        "LeftShoulder LeftElbow LeftWrist",
        "LeftHip LeftKnee LeftAnkle LeftToe",
        _HUMAN_SIDES,
    ),
    # The segments of Xsens MVN, each named at its start: a shoulder is the collarbone, a foot the ankle.
    _convention(
        "xsens-mvn",
        "Pelvis L3 T8 Neck Head",
        "LeftUpperArm LeftForeArm LeftHand",
        "LeftUpperLeg LeftLowerLeg LeftFoot LeftToe",
        _HUMAN_SIDES,
    ),
    _convention(
        "smpl",
        "Pelvis Spine1 Spine3 Neck Head",
        "L_Shoulder L_Elbow L_Wrist",
        "L_Hip L_Knee L_Ankle L_Foot",
        ("^L_", "R_"),
    ),
    _convention(
        "smpl-x",
        "pelvis spine1 spine3 neck head",
        "left_shoulder left_elbow left_wrist",
        "left_hip left_knee left_ankle left_foot",
        ("^left", "right"),
    ),
    _convention(
        "unreal-5",
        "pelvis spine_02 spine_04 neck_01 head",
        "upperarm_l lowerarm_l hand_l",
        "thigh_l calf_l foot_l ball_l",
        ("_l$", "_r"),
    ),
    _convention(
        "unreal-4",
        "pelvis spine_01 spine_03 neck_01 head",
        "upperarm_l lowerarm_l hand_l",
        "thigh_l calf_l foot_l ball_l",
        ("_l$", "_r"),
    ),
    # What readers make of markers.
    Convention("canonical", {joint: joint for joint in CANONICAL_JOINTS}),
)
