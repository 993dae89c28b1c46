"""The vector of a frame.

``pose+travel`` (59 values, the default): the 19 canonical joints in the heading frame, in leg lengths, across
and along from the pelvis and up from the clip's floor, over the square root of 19; then the root's velocity
to its left and forward, in leg lengths a second, times tau. ``paper`` (54 values): the pelvis at the origin
and the other 18 joints, in leg lengths over the square root of 18, computed from the former. Either way the
distance of two frames is about the root-mean-square distance of their joints, in leg lengths.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import CANONICAL_JOINTS, SkeletonError, canonical_indices, find_convention
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.normalise import NormalisedPose, normalise, turn_about_vertical
from motionary.pipeline.resample import Resampled, merge_low_motion

_CHAINS = [
    [CANONICAL_JOINTS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")]
    for side in ("left", "right")
]
_TOES = [CANONICAL_JOINTS.index("left_toe"), CANONICAL_JOINTS.index("right_toe")]
POSE_COLUMNS = 3 * len(CANONICAL_JOINTS)
"""Leading columns of pose and travel that are pose."""

_SMOOTHING = 5  # frames of the velocity's running mean


@dataclass(frozen=True, eq=False)
class FrameFeatures:
    """A motion at the common frame rate, as vectors, with what normalising took away.

    Parameters
    ----------
    values : array (T, 59) float32
        Pose and travel of each frame, before merging.
    path : array (T, 2)
        The root on the ground plane (x, z), leg lengths.
    height : array (T,)
        The root over the floor, leg lengths.
    heading : array (T,)
        Radians from +Z towards +X.
    leg_length : float
        Thigh and shank, in source units.
    convention : str
        The joint-name convention that fitted the skeleton.
    """

    values: NDArray[np.float32]
    path: FloatArray
    height: FloatArray
    heading: FloatArray
    leg_length: float
    convention: str


def motion_features(motion: Motion, config: FeatureConfig | None = None) -> NDArray[np.float32]:
    """Turn a motion into the sequence of vectors that distances compare.

    Parameters
    ----------
    motion : Motion
        Any skeleton that a joint-name convention fits, at any frame rate.
    config : FeatureConfig, optional
        Feature, frame rate and merging; the defaults when left out.

    Returns
    -------
    array (frames, 59) float32
        Normalised and resampled; 54 columns for ``kind="paper"``.

    Raises
    ------
    UnknownSkeletonError
        No convention fits the skeleton.
    SkeletonError
        The figure has no legs to measure it by.
    """
    config = config or FeatureConfig()
    return merged(frame_features(motion, config).values, config).values


def merged(values: NDArray[np.float32], config: FeatureConfig) -> Resampled:
    """Merge the low-motion frames of a motion [DC 4.2].

    Parameters
    ----------
    values : array (T, 59) float32
        Pose and travel.
    config : FeatureConfig
        The kind of feature that is merged, and the bound. Only the pose decides what is merged.
    """
    if config.kind == "paper":
        values = _paper_pose(values)
    driving = min(values.shape[1], POSE_COLUMNS)
    return merge_low_motion(values, config.epsilon, config.criterion, driving=driving)


def frame_features(motion: Motion, config: FeatureConfig) -> FrameFeatures:
    """Compute pose and travel of every frame at the common rate; see `motion_features`."""
    convention = find_convention(motion.skeleton.names, config.conventions)
    resampled = at_rate(motion, config.frame_rate)
    joints = resampled.positions()[:, canonical_indices(motion.skeleton, convention)]
    leg_length = _leg_length(joints, motion.name)
    floor = float(np.percentile(joints[:, _TOES, 1].min(axis=1), 2))
    normal = normalise(joints)
    return FrameFeatures(
        values=_pose_and_travel(normal, leg_length, floor, config).astype(np.float32),
        path=normal.path / leg_length,
        height=(normal.height - floor) / leg_length,
        heading=normal.heading,
        leg_length=leg_length,
        convention=convention.name,
    )


def at_rate(motion: Motion, frame_rate: float) -> Motion:
    """Show a motion at another frame rate (slerp, linear).

    Parameters
    ----------
    motion : Motion
        At any rate.
    frame_rate : float
        Frames a second.

    Returns
    -------
    Motion
        Samples at k / frame_rate seconds for k = 0 .. floor((T - 1) frame_rate / fps).
    """
    return replace(motion.sampled(sample_times(motion.frames, motion.fps, frame_rate)), fps=float(frame_rate))


def sample_times(frames: int, fps: float, frame_rate: float) -> FloatArray:
    """Return where, in source frames, the samples at another rate fall (S,)."""
    nearest = round(fps)
    # A frame time printed with few digits (0.0333333, 0.016667) means the whole rate.
    rate = nearest if nearest and abs(fps - nearest) <= 1e-3 * nearest else fps
    last = int(np.floor((frames - 1) * frame_rate / rate + 1e-6))
    return np.minimum(np.arange(last + 1) * (rate / frame_rate), frames - 1)


def _leg_length(joints: FloatArray, name: str) -> float:
    bones = [np.linalg.norm(np.diff(joints[:, chain], axis=1), axis=-1).sum(axis=1) for chain in _CHAINS]
    length = float(np.mean([np.median(leg) for leg in bones]))
    if not length > 1e-9:
        raise SkeletonError(
            f"the legs of {name!r} have length {length:g}, and a figure is measured by its legs",
            "check the OFFSETs of its thighs and shanks",
        )
    return length


def _pose_and_travel(
    normal: NormalisedPose, leg_length: float, floor: float, config: FeatureConfig
) -> FloatArray:
    pose = (normal.pose - [0.0, floor, 0.0]) / (leg_length * np.sqrt(len(CANONICAL_JOINTS)))
    travel = _own_frame_velocity(normal, config.frame_rate) / leg_length
    return np.hstack([pose.reshape(len(pose), -1), config.travel_time * travel])


def _paper_pose(values: NDArray[np.float32]) -> NDArray[np.float32]:
    joints = values[:, :POSE_COLUMNS].astype(np.float64).reshape(len(values), -1, 3)
    others = joints[:, 1:] - joints[:, :1]
    scale = np.sqrt(joints.shape[1] / others.shape[1])
    return (others * scale).reshape(len(values), -1).astype(np.float32)


def _own_frame_velocity(normal: NormalisedPose, frame_rate: float) -> FloatArray:
    """Velocity of the root to its left and forward (T, 2), source units a second."""
    if len(normal.path) == 1:
        return np.zeros((1, 2))
    velocity = np.gradient(normal.path, 1.0 / frame_rate, axis=0)
    in_space = np.insert(velocity, 1, 0.0, axis=1)
    own = turn_about_vertical(in_space, -normal.heading)[:, [0, 2]]
    half = _SMOOTHING // 2
    padded = np.pad(own, ((half, half), (0, 0)), mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, _SMOOTHING, axis=0).mean(axis=-1)
