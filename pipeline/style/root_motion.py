"""The root in its own heading frame: how fast it goes left and forward and turns, and how high it is.

A step from frame k to k + 1 is seen from halfway between their headings. That can be undone exactly: steps
and turns give the path back, from any place and heading, which central differences would not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import Convention
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import FrameFeatures, frame_features
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.normalise import turn_about_vertical


@dataclass(frozen=True, eq=False)
class RootMotion:
    """What the root of one motion does, T frames.

    Parameters
    ----------
    steps : array (T - 1, 2)
        From each frame to the next, to the left and forward as the figure faces; leg lengths.
    turns : array (T - 1,)
        Change of heading from each frame to the next, radians to the left.
    height : array (T,)
        Over the clip's floor, leg lengths.
    heading : array (T,)
        Radians from +Z towards +X.
    leg_length : float
        In source units.
    """

    steps: FloatArray
    turns: FloatArray
    height: FloatArray
    heading: FloatArray
    leg_length: float


def features_by_frame(motion: Motion, conventions: Sequence[Convention] = ()) -> FrameFeatures:
    """Compute heading, height and pose of the frames as they stand, whatever their rate.

    Raises
    ------
    SkeletonError
        No convention fits the skeleton, or it has no legs to measure it by.
    """
    config = FeatureConfig(epsilon=0.0, conventions=tuple(conventions))
    return frame_features(replace(motion, fps=config.frame_rate), config)


def root_motion(motion: Motion, features: FrameFeatures) -> RootMotion:
    """See the root of a motion from its own heading; `features` are its `features_by_frame`."""
    heading = features.heading
    travelled = np.diff(motion.root_position, axis=0) * [1.0, 0.0, 1.0] / features.leg_length
    steps = turn_about_vertical(travelled, -_halfway(heading))
    return RootMotion(steps[:, [0, 2]], np.diff(heading), features.height, heading, features.leg_length)


def retraced(steps: FloatArray, turns: FloatArray, start_heading: float) -> tuple[FloatArray, FloatArray]:
    """Go the way that steps and turns describe.

    Parameters
    ----------
    steps : array (T - 1, 2)
        To the left and forward, any unit.
    turns : array (T - 1,)
        Radians.
    start_heading : float
        Radians.

    Returns
    -------
    path : array (T, 3)
        From the origin along the ground, in the unit of the steps.
    heading : array (T,)
        Radians.
    """
    heading = start_heading + np.concatenate([[0.0], np.cumsum(turns)])
    travelled = turn_about_vertical(np.insert(steps, 1, 0.0, axis=1), _halfway(heading))
    return np.concatenate([np.zeros((1, 3)), np.cumsum(travelled, axis=0)]), heading


def without_heading(motion: Motion, heading: FloatArray) -> Rotation:
    """Return the local rotations, the root's relative to the heading; (T * J) of them, frame by frame."""
    local = motion.rotations.copy()
    local[:, 0] = (about_vertical(-heading) * Rotation.from_quat(local[:, 0])).as_quat()
    return Rotation.from_quat(local.reshape(-1, 4))


def about_vertical(angle: FloatArray) -> Rotation:
    """Turn by angles (T,), radians from +Z towards +X."""
    return Rotation.from_rotvec(np.multiply.outer(angle, [0.0, 1.0, 0.0]))


def _halfway(heading: FloatArray) -> FloatArray:
    return (heading[1:] + heading[:-1]) / 2
