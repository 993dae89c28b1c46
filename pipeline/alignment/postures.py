"""Motions of one skeleton as joint rotations, linearised about the reference's mean posture [ADTW].

Each joint's rotation is seen from its mean over the reference, q_mean^-1 q, and becomes a rotation vector by
the log map [Johnson 2003, *Exploiting quaternions to support expressive interactive character motion*]: near
the mean, differences of such vectors are differences of rotations, in radians. The mean is the quaternion
whose squared dot products with the reference's are the greatest, so signs do not matter. Further than half a
turn from the mean a vector leaps; joints do not turn so far.

The root's rotation is a posture only in part: which way the figure faces is where it goes. So its three
numbers are the vertical as seen from the root, less its mean over the reference: a lean by an angle changes
them by as many radians, turning about the vertical by nothing. The rival, all of the root's rotation, joins
frames of two takes by where the actor faced.

Weights have four substructures, both hands, the upper body (with the arms) and the lower body, of 1, 1, 1 and
.5. Inside one a joint weighs as the mass that it moves, relative to the joint that moves the most; the rival
reading, relative to the sum, makes joints of a hand with many the lighter. Masses are fractions of the
body's [Winter, *Biomechanics and motor control of human movement*, after Dempster]; a segment's mass is
spread evenly over its joints, such as those of the fingers.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.features import at_rate
from motionary.pipeline.joint_rotations import refuse_markers, refuse_other_joints
from motionary.pipeline.motion import FloatArray, Motion, Skeleton

_MASS = {
    "pelvis": 0.142,
    "spine": 0.139,
    "chest": 0.216,
    "neck": 0.081,
    "shoulder": 0.028,
    "elbow": 0.016,
    "wrist": 0.006,
    "hip": 0.100,
    "knee": 0.0465,
    "ankle": 0.0145,
}
"""Of the segment that begins at a canonical joint; the neck's has the head, the ankle's the toes."""

_LEGS = ("hip", "knee", "ankle")
_LOWER_BODY_WEIGHT = 0.5


def weighted_postures(
    moving: Motion, reference: Motion, rate: float, conventions: Iterable[Convention] = ()
) -> tuple[FloatArray, FloatArray]:
    """Turn two motions into vectors whose squared differences are weighted by limb: what aligners read.

    Parameters
    ----------
    moving, reference, rate
        As of `linearised_postures`.
    conventions : iterable of Convention
        A user's own joint names, as of `posture_weights`.

    Returns
    -------
    moving, reference : array (frames, 3 J) float64
        `linearised_postures`, every column times the root of its weight among `posture_weights`. A method
        that reads them needs no weights besides.

    Raises
    ------
    ValueError
        As `linearised_postures`.
    UnknownSkeletonError
        No convention fits the skeleton.
    """
    first, second = linearised_postures(moving, reference, rate)
    scale = np.sqrt(posture_weights(reference.skeleton, conventions))
    return first * scale, second * scale


def linearised_postures(moving: Motion, reference: Motion, rate: float) -> tuple[FloatArray, FloatArray]:
    """Turn two motions into vectors of joint rotations about the mean posture of one.

    Parameters
    ----------
    moving, reference : Motion
        Of J joints of the same names, with rotations. The mean is the reference's.
    rate : float
        Frames a second of the result.

    Returns
    -------
    moving, reference : array (frames, 3 J) float64
        Three columns a joint, in the order of the reference's skeleton, in radians.

    Raises
    ------
    ValueError
        A motion has markers and no rotations, or the skeletons differ in their joints.
    """
    for motion in (moving, reference):
        refuse_markers(motion)
    refuse_other_joints(moving, reference)
    names = reference.skeleton.names
    order = [moving.skeleton.index(name) for name in names]
    turned = at_rate(moving, rate).rotations[:, order]
    target = at_rate(reference, rate).rotations
    vertical = [_vertical_from(rotations[:, 0]) for rotations in (turned, target)]
    upright = vertical[1].mean(axis=0)
    columns = [[seen - upright] for seen in vertical]
    for joint in range(1, len(names)):
        to_mean = Rotation.from_quat(target[:, joint]).mean().inv()
        for rotations, found in zip((turned, target), columns, strict=True):
            found.append((to_mean * Rotation.from_quat(rotations[:, joint])).as_rotvec())
    return np.concatenate(columns[0], axis=1), np.concatenate(columns[1], axis=1)


def posture_weights(skeleton: Skeleton, conventions: Iterable[Convention] = ()) -> FloatArray:
    """Weigh the columns of `linearised_postures` by limb and by the mass that a joint moves.

    Parameters
    ----------
    skeleton : Skeleton
        J joints that a joint-name convention fits.
    conventions : iterable of Convention
        A user's own, tried before the built-in ones.

    Returns
    -------
    array (3 J,) float64
        From above 0 to 1, as weights of squared differences.

    Raises
    ------
    UnknownSkeletonError
        No convention fits the skeleton.
    """
    segments = _segments(skeleton, find_convention(skeleton.names, conventions))
    joints = len(segments)
    sharing = {segment: segments.count(segment) for segment in segments}
    moved = np.array([_MASS[_unsided(segment)] / sharing[segment] for segment in segments])
    parts = [_substructure(segment) for segment in segments]
    for joint in range(joints - 1, 0, -1):  # children before parents
        parent = skeleton.parents[joint]
        if parts[parent] == parts[joint]:
            moved[parent] += moved[joint]
    weights = np.empty(joints)
    for part in set(parts):
        inside = np.array([one == part for one in parts])
        whole = _LOWER_BODY_WEIGHT if part == "lower body" else 1.0
        weights[inside] = whole * moved[inside] / moved[inside].max()
    return np.repeat(weights, 3)


def _vertical_from(root: FloatArray) -> FloatArray:
    """Return the world's vertical as seen from the root (frames, 3)."""
    return Rotation.from_quat(root).inv().apply([0.0, 1.0, 0.0])


def _segments(skeleton: Skeleton, convention: Convention) -> list[str]:
    """Name for every joint its segment: the nearest canonical joint with a mass, up the tree."""
    places = canonical_indices(skeleton, convention).tolist()
    owners = {
        place: name for place, name in zip(places, CANONICAL_JOINTS, strict=True) if _unsided(name) in _MASS
    }
    segments: list[str] = []
    for joint, parent in enumerate(skeleton.parents):
        segments.append(owners.get(joint, "pelvis" if parent < 0 else segments[parent]))
    return segments


def _substructure(segment: str) -> str:
    if _unsided(segment) == "wrist":
        return segment
    return "lower body" if _unsided(segment) in _LEGS else "upper body"


def _unsided(joint: str) -> str:
    return joint.removeprefix("left_").removeprefix("right_")
