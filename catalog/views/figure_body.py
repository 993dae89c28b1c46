"""What a skeleton is to the player: its size, its canonical joints, where it faces, when its feet stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    Convention,
    UnknownSkeletonError,
    canonical_indices,
    find_convention,
)
from motionary.pipeline.motion import FloatArray, Skeleton
from motionary.pipeline.normalise import headings

_STANDING = 0.028  # leg lengths over the floor, 2.5 cm, as `motionary.pipeline.style.contact` has it
_STILL = 0.6  # leg lengths a second


def body_size(skeleton: Skeleton) -> float:
    """Return the length of the longest chain of bones from the root, in source units; 0 without bones."""
    reach = np.zeros(len(skeleton.names))
    for joint in range(1, len(reach)):
        reach[joint] = reach[skeleton.parents[joint]] + np.linalg.norm(skeleton.offsets[joint])
    return float(reach.max())


def canonical_body(skeleton: Skeleton, conventions: Sequence[Convention] = ()) -> dict[str, int]:
    """Return the joint that each canonical joint is; empty where no convention fits."""
    try:
        convention = find_convention(skeleton.names, conventions)
    except UnknownSkeletonError:
        return {}
    return dict(zip(CANONICAL_JOINTS, canonical_indices(skeleton, convention).tolist(), strict=True))


def first_heading(places: FloatArray, body: Mapping[str, int]) -> float:
    """Return where the first frame faces, radians from +Z towards +X; 0 where that is not known."""
    return float(headings(places[:, [*body.values()]])[0]) if body else 0.0


def kept_joints(skeleton: Skeleton, joints: Sequence[str] | None) -> list[int]:
    """Return the indices of the joints named, in the skeleton's order; all of them for None."""
    if joints is None:
        return [*range(len(skeleton.names))]
    return sorted({skeleton.index(name) for name in joints})


def hung_parents(skeleton: Skeleton, place_of: Mapping[int, int]) -> tuple[int, ...]:
    """Hang each kept joint from the nearest kept one above it."""
    parents = []
    for joint in place_of:
        above = skeleton.parents[joint]
        while above != -1 and above not in place_of:
            above = skeleton.parents[above]
        parents.append(place_of.get(above, -1))
    return tuple(parents)


def joints_between(skeleton: Skeleton, body: Mapping[str, int]) -> list[str]:
    """Name the canonical joints and what stands between them and the root."""
    kept: set[int] = set()
    for joint in body.values():
        above = joint
        while above != -1 and above not in kept:
            kept.add(above)
            above = skeleton.parents[above]
    return [skeleton.names[joint] for joint in sorted(kept)]


def contacts_of(
    places: FloatArray, body: Mapping[str, int], fps: float
) -> list[tuple[int, NDArray[np.bool_]]]:
    """Find when each toe stands: as low as `foot_sliding` counts it, and nearly still."""
    if not body or len(places) < 2:
        return []
    leg = np.mean(
        [
            np.linalg.norm(places[:, body[f"{side}_{upper}"]] - places[:, body[f"{side}_{lower}"]], axis=-1)
            for side in ("left", "right")
            for upper, lower in (("hip", "knee"), ("knee", "ankle"))
        ]
    )
    toes = [body["left_toe"], body["right_toe"]]
    height = places[:, toes, 1]
    floor = np.percentile(height.min(axis=1), 2)
    speed = np.linalg.norm(np.gradient(places[:, toes], 1 / fps, axis=0), axis=-1)
    on = (height <= floor + _STANDING * 2 * leg) & (speed <= _STILL * 2 * leg)
    return [(toe, on[:, side]) for side, toe in enumerate(toes)]
