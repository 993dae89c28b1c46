"""How well a motion can be played: how fast its lower foot slides while it stands, and its fastest joint.

The lower foot is that of the lower toe. It stands in a frame where its toe is at most 1/36 leg length over
the clip's floor, 2.5 cm for a leg of .90 m; the floor is the 2nd percentile of the lower toe, as in the
features. The height is by our trial: on the embedded library, whose standing feet do not move, feet that come
or go then add .3 cm/s to runs, 1.1 to jumps and nothing to other actions; with twice the height 2.2 and 3.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.motion import Motion
from motionary.pipeline.style.root_motion import features_by_frame

USUAL_LEG = 0.90
"""Metres of a leg where the source does not say its unit."""

_STANDING = 0.025 / USUAL_LEG  # leg lengths over the floor
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
    leg_length = features_by_frame(motion, conventions).leg_length
    joints = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names, conventions))
    toes = motion.positions()[:, joints[_TOES]]
    lower = toes[:, :, 1].argmin(axis=1)
    height = toes[:, :, 1].min(axis=1)
    stands = height <= np.percentile(height, 2) + _STANDING * leg_length
    pairs = np.flatnonzero(stands[:-1] & stands[1:] & (lower[:-1] == lower[1:]))
    if not pairs.size:
        return 0.0
    steps = (toes[pairs + 1, lower[pairs]] - toes[pairs, lower[pairs]])[:, [0, 2]]
    metres = motion.unit if motion.unit is not None else USUAL_LEG / leg_length
    return float(np.linalg.norm(steps, axis=1).mean() * motion.fps * metres * 100)


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
