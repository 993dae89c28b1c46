"""A motion by the paper's own DOFs: root displacement, root orientation and joint angles [CoTW 6.1, Table 2].

The paper has joint angle trajectories of captured skeletons, and so degrees and lengths side by side. What a
run compares by, positions of canonical joints, has one unit. The experiment is made by both.

Rotations are rotation vectors where the paper has Euler angles, which depend on an order of axes and leap.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.features import at_rate
from motionary.pipeline.motion import FloatArray, Motion


def joint_angles(motion: Motion, frame_rate: float) -> FloatArray:
    """Describe a motion by its root and the local rotations of its joints.

    Parameters
    ----------
    motion : Motion
        T frames of J joints, at any rate.
    frame_rate : float
        Frames a second of the result.

    Returns
    -------
    array (frames, 3 + 3 J) float64
        Root displacement since the first frame, seen from the root's first orientation, in centimetres (in
        hundredths of a source unit where that is unknown); root orientation since the first frame; the other
        joints' local rotations in the skeleton's order. Rotation vectors in degrees, without leaps.
    """
    motion = at_rate(motion, frame_rate)
    start = Rotation.from_quat(motion.rotations[0, 0]).inv()
    turned = (start * Rotation.from_quat(motion.rotations[:, 0])).as_quat()
    rotations = motion.rotations.copy()
    rotations[:, 0] = turned
    displacement = start.apply(motion.root_position - motion.root_position[0])
    centimetres = displacement * 100 * (motion.unit or 1.0)
    return np.concatenate([centimetres, rotation_vectors(rotations).reshape(motion.frames, -1)], axis=1)


def rotation_vectors(rotations: FloatArray) -> FloatArray:
    """Turn quaternions into rotation vectors in degrees that go on past 180.

    Parameters
    ----------
    rotations : array (frames, joints, 4)
        Unit quaternions x, y, z, w.

    Returns
    -------
    array (frames, joints, 3)
        The first at most 180 degrees long, each next one of the two within 360 that is the continuation.
    """
    first = np.where(rotations[:1, :, 3:] < 0, -1.0, 1.0)
    turns = np.where((rotations[1:] * rotations[:-1]).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    signed = rotations * np.cumprod(np.concatenate([first, turns]), axis=0)
    sine = np.linalg.norm(signed[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, signed[..., 3:])
    scale = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 1e-12)
    return np.rad2deg(scale * signed[..., :3])
