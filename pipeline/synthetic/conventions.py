"""Two skeletons for one posed body: joint names, bone splits, rest pose and unit differ, the pose does not.

- ``mixamo``: 22 joints, centimetres, at rest a T-pose.
- ``cmu-bvh``: 31 joints with the names of the CMU library's BVH release, its unit of 1/0.45 inch, and at
  rest legs spread by 20 degrees. Unlike that release, the thorax keeps its length.

A joint turns with one segment of the body. With W the segment's turn from the T-pose into the world and B
its turn from the T-pose into the skeleton's rest pose, the joint's turn in the world is W B^-1, and an
offset is B of the segment it is fixed to, applied to the step between two landmarks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.synthetic.bodies import Body
from motionary.pipeline.synthetic.posture import Posture

Row = tuple[str, str, str, str]
"""Joint, its parent, the segment it turns with, the landmark it lies at."""


@dataclass(frozen=True)
class SkeletonConvention:
    """How a body is written as a skeleton.

    Parameters
    ----------
    name : str
        As in `motionary.pipeline.canonical`.
    unit : float
        Metres in one unit of length.
    rows : tuple of (joint, parent, segment, landmark)
        In the skeleton's order; the root's parent is empty.
    leg_spread : float
        Degrees by which each leg is spread at rest.
    """

    name: str
    unit: float
    rows: tuple[Row, ...]
    leg_spread: float

    def skeleton(self, body: Body) -> Skeleton:
        """Build the skeleton of a body, offsets in this convention's unit."""
        names = [row[0] for row in self.rows]
        landmarks = body.landmarks()
        place = {joint: landmarks[landmark] for joint, _, _, landmark in self.rows}
        segment = {joint: part for joint, _, part, _ in self.rows}
        offsets = np.zeros((len(names), 3))
        for index, (joint, parent, _, _) in enumerate(self.rows[1:], start=1):
            offsets[index] = self._rest_turn(segment[parent]) @ (place[joint] - place[parent]) / self.unit
        parents = tuple(names.index(parent) if parent else -1 for _, parent, _, _ in self.rows)
        return Skeleton(tuple(names), parents, offsets)

    def motion(self, posture: Posture, body: Body, fps: float, name: str) -> Motion:
        """Write a posed body as a motion of this skeleton.

        Parameters
        ----------
        posture : Posture
            F frames.
        body : Body
            The body that was posed.
        fps : float
            Frames a second.
        name : str
            The motion's name.

        Returns
        -------
        Motion
            F frames in this convention's unit.
        """
        skeleton = self.skeleton(body)
        world = [posture.turns[segment] @ self._rest_turn(segment).T for _, _, segment, _ in self.rows]
        local = [
            turn if parent < 0 else np.swapaxes(world[parent], 1, 2) @ turn
            for parent, turn in zip(skeleton.parents, world, strict=True)
        ]
        # All at once: what a call costs is far more than what a rotation does.
        quaternions = Rotation.from_matrix(np.concatenate(local)).as_quat()
        rotations = np.moveaxis(quaternions.reshape(len(local), -1, 4), 0, 1).copy()
        return Motion(
            name, skeleton, fps, posture.pelvis / self.unit, rotations, unit=self.unit, source="synthetic"
        )

    def _rest_turn(self, segment: str) -> FloatArray:
        side, _, part = segment.partition("_")
        if part not in {"thigh", "shank"}:
            return np.eye(3)
        angle = self.leg_spread if side == "left" else -self.leg_spread
        return Rotation.from_euler("z", angle, degrees=True).as_matrix()


def _both_sides(rows: tuple[Row, ...], rename: Callable[[str], str]) -> tuple[Row, ...]:
    """Add the right side's rows to those of the left."""

    def right(row: Row) -> Row:
        joint, parent, segment, landmark = row
        return (
            rename(joint),
            rename(parent),
            segment.replace("left_", "right_"),
            landmark.replace("left_", "right_"),
        )

    return rows + tuple(right(row) for row in rows)


def _long_name(joint: str) -> str:
    return joint.replace("Left", "Right")


def _cmu_name(joint: str) -> str:
    short = {"LHipJoint": "RHipJoint", "LFingers": "RFingers", "LThumb": "RThumb"}
    return short.get(joint, _long_name(joint))


_LEG = (
    ("LeftLeg", "LeftUpLeg", "left_shank", "left_knee"),
    ("LeftFoot", "LeftLeg", "left_foot", "left_ankle"),
    ("LeftToeBase", "LeftFoot", "left_toes", "left_toe"),
)
_ARM = (
    ("LeftArm", "LeftShoulder", "left_upper_arm", "left_shoulder"),
    ("LeftForeArm", "LeftArm", "left_forearm", "left_elbow"),
    ("LeftHand", "LeftForeArm", "left_hand", "left_wrist"),
)
MIXAMO = SkeletonConvention(
    "mixamo",
    unit=0.01,
    rows=(
        ("Hips", "", "pelvis", "pelvis"),
        ("Spine", "Hips", "waist", "waist"),
        ("Spine1", "Spine", "lumbar", "spine"),
        ("Spine2", "Spine1", "thorax", "chest"),
        ("Neck", "Spine2", "neck", "neck"),
        ("Head", "Neck", "head", "head"),
        *_both_sides((("LeftShoulder", "Spine2", "left_clavicle", "left_clavicle"), *_ARM), _long_name),
        *_both_sides((("LeftUpLeg", "Hips", "left_thigh", "left_hip"), *_LEG), _long_name),
    ),
    leg_spread=0.0,
)
CMU_BVH = SkeletonConvention(
    "cmu-bvh",
    unit=0.0254 / 0.45,
    rows=(
        ("Hips", "", "pelvis", "pelvis"),
        *_both_sides(
            (
                ("LHipJoint", "Hips", "pelvis", "pelvis"),
                ("LeftUpLeg", "LHipJoint", "left_thigh", "left_hip"),
                *_LEG,
            ),
            _cmu_name,
        ),
        ("LowerBack", "Hips", "waist", "waist"),
        ("Spine", "LowerBack", "lumbar", "spine"),
        ("Spine1", "Spine", "thorax", "chest"),
        ("Neck", "Spine1", "thorax", "collar"),
        ("Neck1", "Neck", "neck", "neck"),
        ("Head", "Neck1", "head", "head"),
        *_both_sides(
            (
                ("LeftShoulder", "Spine1", "left_clavicle", "left_clavicle"),
                *_ARM,
                ("LeftFingerBase", "LeftHand", "left_hand", "left_fingers"),
                ("LFingers", "LeftFingerBase", "left_hand", "left_fingertips"),
                ("LThumb", "LeftHand", "left_hand", "left_thumb"),
            ),
            _cmu_name,
        ),
    ),
    leg_spread=20.0,
)
CONVENTIONS: dict[str, SkeletonConvention] = {one.name: one for one in (MIXAMO, CMU_BVH)}
