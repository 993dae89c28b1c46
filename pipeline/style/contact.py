"""When feet stand, and how well a motion can be played: how fast feet slide, and the fastest joint.

A foot may stand in a frame where its toe is at most 1/36 leg length over the clip's floor, 2.5 cm for a leg
of .90 m; the floor is the 2nd percentile of the lower toe, as in the features. The height is by our trial: on
the embedded library, whose standing feet do not move, feet that come or go then add .3 cm/s to runs, 1.1 to
jumps and nothing to other actions; with twice the height 2.2 and 3.2.

Sliding is measured of the lower foot, that of the lower toe, wherever it is that low, however fast it goes:
else a foot that slides would not count. One that is shown as standing is nearly still besides: else one that
swings low would be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.style.root_motion import features_by_frame

USUAL_LEG = 0.90
"""Metres of a leg where the source does not say its unit."""

_STANDING = 0.025 / USUAL_LEG  # leg lengths over the floor
_STILL = 0.6  # leg lengths a second
_TOES = [CANONICAL_JOINTS.index(f"{side}_toe") for side in ("left", "right")]


def foot_sliding(motion: Motion, conventions: Sequence[Convention] = ()) -> float:
    """Measure how fast the lower foot slides while it stands.

    Parameters
    ----------
    motion : Motion
        Where its `unit` is not known, a leg is taken to be .90 m long.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    float
        Mean horizontal speed of the lower toe, cm/s, over all pairs of neighbouring frames in which the same
        toe is the lower one and stands. 0 where there is no such pair: nothing slides where nothing stands.

    Raises
    ------
    SkeletonError
        No convention fits the skeleton, or it has no legs.
    """
    toes, leg_length = _toes(motion, conventions)
    lower = toes[:, :, 1].argmin(axis=1)
    left, right = _low(toes, leg_length).T
    stands = left | right
    pairs = np.flatnonzero(stands[:-1] & stands[1:] & (lower[:-1] == lower[1:]))
    if not pairs.size:
        return 0.0
    steps = (toes[pairs + 1, lower[pairs]] - toes[pairs, lower[pairs]])[:, [0, 2]]
    metres = motion.unit if motion.unit is not None else USUAL_LEG / leg_length
    return float(np.linalg.norm(steps, axis=1).mean() * motion.fps * metres * 100)


def standing_toes(motion: Motion, conventions: Sequence[Convention] = ()) -> NDArray[np.bool_]:
    """Find when each toe stands: low, as `foot_sliding` has it, and at most .6 leg lengths a second fast.

    Parameters
    ----------
    motion : Motion
        T frames; a single one counts as still.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    array (T, 2) bool
        The left toe, the right.

    Raises
    ------
    SkeletonError
        No convention fits the skeleton, or it has no legs.
    """
    toes, leg_length = _toes(motion, conventions)
    low = _low(toes, leg_length)
    if motion.frames == 1:
        return low
    velocity = np.gradient(toes, 1 / motion.fps, axis=0)
    return low & (np.linalg.norm(velocity, axis=2) <= _STILL * leg_length)


def fastest_joint(motion: Motion, conventions: Sequence[Convention] = ()) -> float:
    """Measure the greatest speed of any joint, leg lengths a second.

    Rotations that flip in a source show here once a style is transferred: 0 for a single frame.

    Raises
    ------
    SkeletonError
        No convention fits the skeleton, or it has no legs.
    """
    leg_length = features_by_frame(motion, conventions).leg_length
    steps = np.linalg.norm(np.diff(motion.positions(), axis=0), axis=2)
    return float(steps.max(initial=0.0) * motion.fps / leg_length)


def _toes(motion: Motion, conventions: Sequence[Convention]) -> tuple[FloatArray, float]:
    """Return where the left and the right toe are (T, 2, 3), source units, and the length of a leg."""
    leg_length = features_by_frame(motion, conventions).leg_length
    joints = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names, conventions))
    return motion.positions()[:, joints[_TOES]], leg_length


def _low(toes: FloatArray, leg_length: float) -> NDArray[np.bool_]:
    """Return whether each toe is so low that it may stand (T, 2)."""
    height = toes[:, :, 1]
    return height <= np.percentile(height.min(axis=1), 2) + _STANDING * leg_length
