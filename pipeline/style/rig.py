"""Which motions are of one rig, and which region of the body each of a rig's joints belongs to.

Two motions are of one rig where their joints have the same names, in the same order, and the same parents.
Bones may differ in length. That the rest poses are alike is taken for granted: among the five actors of
HDM05, one rig, the bones at rest point up to 19 degrees apart.
"""

from __future__ import annotations

from collections.abc import Iterable

from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.motion import Motion, Skeleton

REGIONS: tuple[str, ...] = ("root", "torso", "head", "arms", "legs")
"""The regions of a body, in the order of tables."""

_REGION_OF_PART = {
    "pelvis": "root",
    **dict.fromkeys(("spine", "chest"), "torso"),
    **dict.fromkeys(("neck", "head"), "head"),
    **dict.fromkeys(("shoulder", "elbow", "wrist"), "arms"),
    **dict.fromkeys(("hip", "knee", "ankle", "toe"), "legs"),
}
CANONICAL_REGIONS: tuple[str, ...] = tuple(
    _REGION_OF_PART[joint.split("_")[-1]] for joint in CANONICAL_JOINTS
)
"""The region of each canonical joint."""


def is_one_rig(first: Skeleton, second: Skeleton) -> bool:
    """Tell whether joint names and parents are the same; bones may differ in length."""
    return first.names == second.names and first.parents == second.parents


def refuse_markers(motions: Iterable[Motion]) -> None:
    """Check that motions have rotations.

    Raises
    ------
    ValueError
        One is of markers; it names that.
    """
    for motion in motions:
        if motion.places is not None:
            raise ValueError(
                f"{motion.name!r} was captured as markers: it has places of joints and no rotations"
            )


def rig_difference(first: Motion, second: Motion) -> str:
    """Say how two motions' skeletons differ: their names and numbers of joints, and the first difference."""
    names = first.skeleton.names, second.skeleton.names
    said = f"{first.name!r} ({len(names[0])} joints) and {second.name!r} ({len(names[1])} joints)"
    for joint, pair in enumerate(zip(*names, strict=False)):
        if pair[0] != pair[1]:
            return f"{said} have different skeletons: joint {joint} is {pair[0]!r} and {pair[1]!r}"
        parents = first.skeleton.parents[joint], second.skeleton.parents[joint]
        if parents[0] != parents[1]:
            return (
                f"{said} have different skeletons: joint {joint}, {pair[0]!r}, hangs from "
                f"{names[0][parents[0]]!r} and {names[1][parents[1]]!r}"
            )
    shared = min(map(len, names))
    further = max(names, key=len)[shared]
    return f"{said} have different skeletons: joint {shared}, {further!r}, is in one only"


def joint_regions(skeleton: Skeleton, conventions: Iterable[Convention] = ()) -> tuple[str, ...]:
    """Find the region of every joint.

    Parameters
    ----------
    skeleton : Skeleton
        J joints, of any rig that a convention fits.
    conventions : iterable of Convention
        A user's own, tried before the built-in ones.

    Returns
    -------
    tuple of str
        One of `REGIONS` a joint: that of the canonical joint it is; else that of the canonical joints below
        it (a clavicle is of the arms), which is the torso where they are of several; else that of its parent
        (fingers are of the arms).

    Raises
    ------
    UnknownSkeletonError
        No convention fits the skeleton.
    """
    indices = canonical_indices(skeleton, find_convention(skeleton.names, conventions)).tolist()
    own = dict(zip(indices, CANONICAL_REGIONS, strict=True))
    below: list[set[str]] = [set() for _ in skeleton.names]
    for joint in range(len(skeleton.names) - 1, 0, -1):
        below[skeleton.parents[joint]] |= below[joint] | ({own[joint]} if joint in own else set())
    regions: list[str] = []
    for joint, parent in enumerate(skeleton.parents):
        if joint in own or joint == 0:
            regions.append(own.get(joint, "root"))
        elif below[joint]:
            regions.append(below[joint].pop() if len(below[joint]) == 1 else "torso")
        else:
            regions.append(regions[parent])
    return tuple(regions)
