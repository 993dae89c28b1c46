"""Root translation and heading removed [DC 4.1].

A motion is the same motion wherever on the floor it happens and whichever way it faces. Per frame, the
pelvis goes to the vertical axis and the heading to +Z; what is removed (path, height, heading) is kept.

The paper does not say how the heading is found. Here it is perpendicular to the *across vector*, the sum of
right-to-left hip and right-to-left shoulder on the ground plane; its rival, the pelvis joint's own
orientation, means something else in every skeleton.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.motion import FloatArray

_PELVIS = CANONICAL_JOINTS.index("pelvis")
_LEFT = [CANONICAL_JOINTS.index("left_hip"), CANONICAL_JOINTS.index("left_shoulder")]
_RIGHT = [CANONICAL_JOINTS.index("right_hip"), CANONICAL_JOINTS.index("right_shoulder")]

# Under this share of its usual length the across vector stands nearly upright and its direction on the
# ground means nothing (lying on one side, upside down).
_SHORT_ACROSS = 0.1


@dataclass(frozen=True, eq=False)
class NormalisedPose:
    """Poses in their own heading frame, and what was taken away.

    Parameters
    ----------
    pose : array (T, 19, 3)
        Canonical joints with the pelvis over the origin and the figure facing +Z; source units, y as it was.
    path : array (T, 2)
        The pelvis on the ground plane: x, z; source units.
    height : array (T,)
        The pelvis's y; source units.
    heading : array (T,)
        Angle from +Z towards +X, radians, without jumps of a turn.
    """

    pose: FloatArray
    path: FloatArray
    height: FloatArray
    heading: FloatArray


def normalise(joints: FloatArray) -> NormalisedPose:
    """Remove root translation and heading, frame by frame [DC 4.1].

    Parameters
    ----------
    joints : array (T, 19, 3)
        Canonical joints in the world, Y up.

    Returns
    -------
    NormalisedPose

    Raises
    ------
    ValueError
        The shape is another.
    """
    joints = np.asarray(joints, dtype=np.float64)
    if joints.ndim != 3 or joints.shape[1:] != (len(CANONICAL_JOINTS), 3) or len(joints) == 0:
        raise ValueError(
            f"canonical joints have shape {joints.shape}; (T, {len(CANONICAL_JOINTS)}, 3) is needed"
        )
    heading = headings(joints)
    pelvis = joints[:, _PELVIS]
    centred = joints - pelvis[:, None] * [1.0, 0.0, 1.0]
    return NormalisedPose(
        pose=turn_about_vertical(centred, -heading),
        path=pelvis[:, [0, 2]],
        height=pelvis[:, 1],
        heading=heading,
    )


def headings(joints: FloatArray) -> FloatArray:
    """Find where the figure faces in every frame.

    Parameters
    ----------
    joints : array (T, 19, 3)
        Canonical joints in the world.

    Returns
    -------
    array (T,)
        Radians from +Z towards +X, unwrapped. Where the across vector is too short on the ground, taken
        between the nearest good frames; 0 throughout where there is none. Too short is under a tenth of the
        vector's usual length in space, which stays what it is in a clip that lies most of the time.
    """
    across = (joints[:, _LEFT] - joints[:, _RIGHT]).sum(axis=1)
    on_ground = np.hypot(across[:, 0], across[:, 2])
    usual = np.median(np.linalg.norm(across, axis=-1))
    good = np.flatnonzero((on_ground >= _SHORT_ACROSS * usual) & (on_ground > 0))
    if good.size == 0:
        return np.zeros(len(joints))
    angle = np.unwrap(np.arctan2(-across[good, 2], across[good, 0]))
    return np.interp(np.arange(len(joints)), good, angle)


def turn_about_vertical(points: FloatArray, angle: FloatArray) -> FloatArray:
    """Turn points about the Y axis.

    Parameters
    ----------
    points : array (T, ..., 3)
        One set of points a frame.
    angle : array (T,)
        Radians from +Z towards +X.

    Returns
    -------
    array (T, ..., 3)
    """
    angle = angle.reshape(-1, *(1,) * (points.ndim - 2))
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=-1)
