"""What a skeleton is to the player: its size, its canonical joints, where it faces, when its feet stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    Convention,
    SkeletonError,
    UnknownSkeletonError,
    canonical_indices,
    find_convention,
)
from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.normalise import headings
from motionary.pipeline.style.contact import standing_toes


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


def kept_joints(skeleton: Skeleton, joints: Sequence[str]) -> list[int]:
    """Return the indices of the joints named, in the skeleton's order."""
    return sorted({skeleton.index(name) for name in joints})


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
    motion: Motion, body: Mapping[str, int], conventions: Sequence[Convention]
) -> dict[int, NDArray[np.bool_]]:
    """Return when each toe stands (T,); nothing of a figure without legs, or that no convention fits."""
    try:
        stands = standing_toes(motion, conventions)
    except SkeletonError:
        return {}
    return {body["left_toe"]: stands[:, 0], body["right_toe"]: stands[:, 1]}


def by_joint(canonical: FloatArray, skeleton: Skeleton, body: Mapping[str, int]) -> FloatArray:
    """Give joints the columns of canonical ones (m, 19); others have that of the joint above them (m, J)."""
    column = {joint: place for place, joint in enumerate(body.values())}
    columns: list[int] = []
    for joint, parent in enumerate(skeleton.parents):
        columns.append(column.get(joint, columns[parent] if parent >= 0 else 0))
    return canonical[:, columns]
