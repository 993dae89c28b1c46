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
from motionary.pipeline.motion import Motion, Skeleton

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

_BONE_ENDS = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist"}


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
    refuse_markers(motion)
    unknown = [joint for joint in joints if joint not in CANONICAL_JOINTS]
    if unknown or not joints:
        what = f"no canonical joint is called {unknown[0]!r}" if unknown else "no joint is named"
        raise ValueError(f"{what}; there are {', '.join(CANONICAL_JOINTS)}")
    if rate is not None and not 0 < rate < np.inf:
        raise ValueError(f"rate is {rate}; it must be a positive number of frames a second")
    own = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names, conventions))
    shown = motion if rate is None else at_rate(motion, rate)
    return np.ascontiguousarray(shown.rotations[:, own[[CANONICAL_JOINTS.index(joint) for joint in joints]]])


def refuse_other_joints(moving: Motion, reference: Motion) -> None:
    """Raise ValueError where two motions have other joints, and so local rotations that do not compare."""
    strange = sorted(set(moving.skeleton.names) ^ set(reference.skeleton.names))
    if strange:
        raise ValueError(
            f"motions {moving.name!r} and {reference.name!r} have other joints: {', '.join(strange[:6])}"
            f"{' ...' if len(strange) > 6 else ''} in one alone; "
            "align them by a method that reads features"
        )


def refuse_markers(motion: Motion) -> None:
    """Raise ValueError where a motion was captured as markers, whose joints have places and no rotations."""
    if motion.places is not None:
        raise ValueError(
            f"{motion.name!r} was captured as markers, which have no rotations: "
            "give it as BVH, ASF/AMC or AMASS, or align it by a method that reads features"
        )


def bone_directions(skeleton: Skeleton, conventions: Iterable[Convention] = ()) -> NDArray[np.float64]:
    """Return where the bones of `FP_JOINTS` point at rest, each in its joint's own frame.

    A limb may have joints between, such as those of a twist; at rest they are not turned.

    Parameters
    ----------
    skeleton : Skeleton
        Any that a joint-name convention fits.
    conventions : iterable of Convention
        A user's own, tried before the built-in ones.

    Returns
    -------
    array (8, 3)
        Of length 1.

    Raises
    ------
    ValueError
        A bone has no length.
    UnknownSkeletonError
        No convention fits the skeleton.
    """
    own = canonical_indices(skeleton, find_convention(skeleton.names, conventions))
    joint_of = dict(zip(CANONICAL_JOINTS, own.tolist(), strict=True))
    directions = np.empty((len(FP_JOINTS), 3))
    for place, name in enumerate(FP_JOINTS):
        side, part = name.split("_")
        start, joint = joint_of[name], joint_of[f"{side}_{_BONE_ENDS[part]}"]
        reach = np.zeros(3)
        while joint not in (start, -1):
            reach += skeleton.offsets[joint]
            joint = skeleton.parents[joint]
        length = np.linalg.norm(reach)
        if not length > 0:
            raise ValueError(
                f"the bone that begins at {skeleton.names[start]!r} has length {length:g}, so it points "
                "nowhere: give the skeleton offsets of its joints"
            )
        directions[place] = reach / length
    return directions
