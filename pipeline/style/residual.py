"""A clip minus its reference, once both run in the same time: its style [CoTW 6.3].

The paper subtracts joint angles. Here it is the rotation that is left, q_ref^-1 q_clip as a rotation vector
the short way round, since angles about axes do not subtract; the root's heading is taken out of both, and its
travel is compared as velocity, not place. Where the rigs differ rotations mean nothing to each other, and the
difference of the normalised poses is taken instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from motionary.pipeline.alignment.warp import interpolate
from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import POSE_COLUMNS, FrameFeatures
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.style.rig import (
    CANONICAL_REGIONS,
    REGIONS,
    is_one_rig,
    joint_regions,
    refuse_markers,
    rig_difference,
)
from motionary.pipeline.style.root_motion import RootMotion, features_by_frame, root_motion, without_heading

ResidualKind = Literal["rotations", "pose"]

ROOT_COLUMNS: tuple[str, ...] = ("left", "forward", "turning", "height")
"""Columns of `Residual.root`: leg lengths a second, twice, radians a second, leg lengths."""


@dataclass(frozen=True, eq=False)
class Residual:
    """What a clip does that its reference does not, frame by frame of the reference.

    Parameters
    ----------
    kind : {"rotations", "pose"}
        What `joints` holds.
    names : tuple of str
        The J joints: the rig's for rotations, the canonical ones for pose.
    regions : tuple of str
        The region of each joint, one of `REGIONS`.
    joints : array (m, J, 3)
        Rotations: log(q_ref^-1 q_clip), radians, at most pi long; the first joint's without the headings.
        Pose: difference of the joints' places in the heading frame, leg lengths.
    root : array (m, 4)
        Difference of the root's velocity to its left and forward (leg lengths a second), of its turning to
        the left (radians a second), each from a frame to the next and 0 at the last, and of its height over
        the floor (leg lengths).
    """

    kind: ResidualKind
    names: tuple[str, ...]
    regions: tuple[str, ...]
    joints: FloatArray
    root: FloatArray

    @property
    def joint_energy(self) -> dict[str, float]:
        """Mean square by joint: radians^2, or leg lengths^2 for a pose."""
        mean_squares = np.mean(np.sum(self.joints**2, axis=2), axis=0)
        return dict(zip(self.names, mean_squares.tolist(), strict=True))

    @property
    def region_energy(self) -> dict[str, float]:
        """Sum of the joints' energies by region, in the order of `REGIONS`.

        A sum, not a mean: fingers that do not move then change nothing, and the regions add up to the whole.
        """
        energies = dict.fromkeys(REGIONS, 0.0)
        for region, energy in zip(self.regions, self.joint_energy.values(), strict=True):
            energies[region] += energy
        return energies

    @property
    def root_energy(self) -> dict[str, float]:
        """Mean square of each of the root's four columns, the columns' units squared."""
        return dict(zip(ROOT_COLUMNS, np.mean(self.root**2, axis=0).tolist(), strict=True))

    def vector(self, stretches: int = 16) -> FloatArray:
        """Average the residual over equal stretches of the reference's time.

        Parameters
        ----------
        stretches : int
            How many; a frame on the border of two counts in each by its share.

        Returns
        -------
        array (stretches * (3 J + 4),)
            Stretch by stretch: the joints, then the root, whose velocity and turning are multiplied by the
            features' .10 s, so that they weigh against the pose as they do there.

        Raises
        ------
        ValueError
            `stretches` is below 1.
        """
        if stretches < 1:
            raise ValueError(f"stretches is {stretches}; it must be at least 1")
        seconds = FeatureConfig().travel_time
        frames = len(self.joints)
        rows = np.hstack([self.joints.reshape(frames, -1), self.root * [seconds, seconds, seconds, 1.0]])
        sums = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
        borders = interpolate(sums, np.linspace(0, frames, stretches + 1))
        return (np.diff(borders, axis=0) * stretches / frames).ravel()


@dataclass(frozen=True, eq=False)
class _Seen:
    """A motion, and what of it is subtracted."""

    motion: Motion
    features: FrameFeatures
    root: RootMotion


def residual(
    aligned: Motion,
    reference: Motion,
    kind: ResidualKind | None = None,
    conventions: Sequence[Convention] = (),
) -> Residual:
    """Subtract a reference from a clip that is aligned to it; see `residuals`."""
    return residuals([aligned], reference, kind, conventions)[0]


def residuals(
    aligned: Sequence[Motion],
    reference: Motion,
    kind: ResidualKind | None = None,
    conventions: Sequence[Convention] = (),
) -> list[Residual]:
    """Subtract a reference from the clips of its cluster, all in one kind, so that their vectors compare.

    Parameters
    ----------
    aligned : sequence of Motion
        In the reference's time, see `motionary.pipeline.alignment.Warp.apply_motion`: m frames at its rate.
    reference : Motion
        m frames.
    kind : {"rotations", "pose"}, optional
        Rotations where all are of one rig with the reference and none is of markers, else pose.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    list of Residual
        One a clip.

    Raises
    ------
    ValueError
        Frames or rates differ, rotations are asked for and the skeletons differ or a motion is of markers, or
        there is no such kind.
    SkeletonError
        No convention fits a skeleton, or it has no legs.
    """
    if kind not in (None, "rotations", "pose"):
        raise ValueError(f"kind is {kind!r}; it must be 'rotations' or 'pose'")
    if kind == "rotations":
        refuse_markers([reference, *aligned])
    others = [one for one in aligned if not is_one_rig(one.skeleton, reference.skeleton)]
    if kind == "rotations" and others:
        raise ValueError(
            f"{rig_difference(others[0], reference)}; rotations compare in one rig, poses in any"
        )
    for one in aligned:
        check_same_time(one, reference)
    unturned = any(one.places is not None for one in (reference, *aligned))
    subtract = _pose_residual if kind == "pose" or others or unturned else _rotation_residual
    to = _seen(reference, conventions)
    return [subtract(_seen(one, conventions), to, conventions) for one in aligned]


def check_same_time(motion: Motion, reference: Motion) -> None:
    """Check that a motion runs in its reference's time.

    Raises
    ------
    ValueError
        Frames differ, or rates by more than a thousandth (a printed frame time has few digits).
    """
    if motion.frames != reference.frames:
        raise ValueError(
            f"{motion.name!r} has {motion.frames} frames and its reference {reference.name!r} "
            f"{reference.frames}; align it first (Warp.apply_motion)"
        )
    if abs(motion.fps - reference.fps) > 1e-3 * reference.fps:
        raise ValueError(
            f"{motion.name!r} has {motion.fps:g} frames a second and its reference {reference.name!r} "
            f"{reference.fps:g}; bring both to one rate before they are aligned"
        )


def pose_differences(own: FloatArray, reference: FloatArray) -> FloatArray:
    """Subtract the poses of a reference from those of a clip in its time.

    Parameters
    ----------
    own, reference : array (m, columns)
        Features of pose and travel; see `motionary.pipeline.features`. Those of a clip may be of the motion
        in the reference's time, or its own features warped.

    Returns
    -------
    array (m, 19, 3)
        By canonical joint, in the heading frames, leg lengths.
    """
    difference = own[:, :POSE_COLUMNS].astype(np.float64) - reference[:, :POSE_COLUMNS]
    # The columns are divided by the root of the number of joints; here they are leg lengths again.
    return difference.reshape(len(difference), -1, 3) * np.sqrt(len(CANONICAL_JOINTS))


def _seen(motion: Motion, conventions: Sequence[Convention]) -> _Seen:
    features = features_by_frame(motion, conventions)
    return _Seen(motion, features, root_motion(motion, features))


def _rotation_residual(clip: _Seen, reference: _Seen, conventions: Sequence[Convention]) -> Residual:
    turned, still = (without_heading(one.motion, one.root.heading) for one in (clip, reference))
    skeleton = reference.motion.skeleton
    joints = (still.inv() * turned).as_rotvec().reshape(reference.motion.frames, -1, 3)
    regions = joint_regions(skeleton, conventions)
    return Residual("rotations", skeleton.names, regions, joints, _root_residual(clip, reference))


def _pose_residual(clip: _Seen, reference: _Seen, _conventions: Sequence[Convention]) -> Residual:
    joints = pose_differences(clip.features.values, reference.features.values)
    return Residual("pose", CANONICAL_JOINTS, CANONICAL_REGIONS, joints, _root_residual(clip, reference))


def _root_residual(clip: _Seen, reference: _Seen) -> FloatArray:
    fps = reference.motion.fps
    columns = np.zeros((reference.motion.frames, len(ROOT_COLUMNS)))
    columns[:-1, :2] = (clip.root.steps - reference.root.steps) * fps
    columns[:-1, 2] = (clip.root.turns - reference.root.turns) * fps
    columns[:, 3] = clip.root.height - reference.root.height
    return columns
