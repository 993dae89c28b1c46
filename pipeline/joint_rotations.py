"""How chosen joints of a motion are turned, the same ones whatever a skeleton calls them.

What online alignment compares [FP 4] are the local rotations of a few joints: those with the most to do with
the pose. The convention, with its rival: a joint's rotation is that of the bone which *begins* there, seen
from the joint's own parent in the skeleton, as its file has it. So a shoulder leaves out what the collarbone
turns, and two rigs whose bones lie differently at rest have other rotations in one pose (the rival would
count from a common rest pose, which the formats do not name).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.features import at_rate
from motionary.pipeline.motion import Motion

FP_JOINTS: tuple[str, ...] = (
    "left_hip",
    "left_knee",
    "right_hip",
    "right_knee",
    "left_shoulder",
    "left_elbow",
    "right_shoulder",
    "right_elbow",
)
"""The joints that [FP 4] compares, each weighing the same."""


def joint_rotations(
    motion: Motion,
    joints: Sequence[str] = FP_JOINTS,
    rate: float | None = None,
    conventions: Iterable[Convention] = (),
) -> NDArray[np.float64]:
    """Return the local rotations of canonical joints.

    Parameters
    ----------
    motion : Motion
        Of any skeleton that a joint-name convention fits.
    joints : sequence of str
        J names of `motionary.pipeline.canonical.CANONICAL_JOINTS`, in the order wanted.
    rate : float, optional
        Frames a second to show the motion at, by slerp; its own where left out.
    conventions : iterable of Convention
        A user's own, tried before the built-in ones.

    Returns
    -------
    array (frames, J, 4) float64
        Unit quaternions x, y, z, w.

    Raises
    ------
    ValueError
        The motion is of markers, a joint is not canonical, none is named, or the rate is not positive.
    UnknownSkeletonError
        No convention fits the skeleton.
    """
    if motion.places is not None:
        raise ValueError(
            f"{motion.name!r} was captured as markers, which have no rotations: "
            "give it as BVH, ASF/AMC or AMASS, or align it by a method that reads features"
        )
    unknown = [joint for joint in joints if joint not in CANONICAL_JOINTS]
    if unknown or not joints:
        what = f"no canonical joint is called {unknown[0]!r}" if unknown else "no joint is named"
        raise ValueError(f"{what}; there are {', '.join(CANONICAL_JOINTS)}")
    if rate is not None and not 0 < rate < np.inf:
        raise ValueError(f"rate is {rate}; it must be a positive number of frames a second")
    own = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names, conventions))
    shown = motion if rate is None else at_rate(motion, rate)
    return np.ascontiguousarray(shown.rotations[:, own[[CANONICAL_JOINTS.index(joint) for joint in joints]]])
