"""BVH out of a motion: what `readers.bvh` reads back, and what other programs read the same way.

The root's OFFSET is 0 and its position channels are the places themselves, so readers that add and
readers that replace agree. Every other joint has three rotation channels. Angles are continuous over time
(unwrapped by full turns), so programs that interpolate channels do not spin the long way round. A motion
does not know where its leaf bones end: their End Sites have zero length.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.writers.whole import whole_file

DECIMALS = 6
_AT_THE_POLE = 1e-7  # cosine of the middle angle under which the outer two turn about one axis


def write_bvh(motion: Motion, path: str | os.PathLike[str], *, rotation_order: str = "ZXY") -> None:
    """Write a motion as BVH.

    Parameters
    ----------
    motion : Motion
    path : path
        Replaced in one step once the whole file is written.
    rotation_order : str
        The three axes in the order of the channels: "ZXY" is R = Rz Rx Ry.

    Notes
    -----
    Joints are written each followed by all below it, and a reader numbers them so: a motion whose joints
    stand in another order comes back with the same joints in that one.

    Raises
    ------
    ValueError
        The motion is of markers, `rotation_order` is not an order of X, Y and Z, or a joint's name cannot
        stand in a BVH. Blanks in names become underscores; two names may not become equal by that.
    """
    if sorted(rotation_order.upper()) != ["X", "Y", "Z"]:
        raise ValueError(f"rotation_order is {rotation_order!r}; it must be an order of XYZ, such as 'ZXY'")
    if motion.places is not None:
        raise ValueError(
            f"{motion.name!r} was captured as markers: it has places of joints and no rotations, "
            "and a BVH is made of rotations; write it as NPZ or Parquet"
        )
    i, j, k = ("XYZ".index(axis) for axis in rotation_order.upper())
    names = _plain_names(motion.skeleton.names)
    lines = [*_hierarchy(motion, names, rotation_order.upper()), *_frames(motion, (i, j, k))]
    with whole_file(path) as file:
        file.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def euler_angles(quaternions: FloatArray, order: tuple[int, int, int]) -> FloatArray:
    """Convert quaternions to intrinsic Euler angles about three different axes.

    Parameters
    ----------
    quaternions : array (..., 4)
        Unit quaternions x, y, z, w.
    order : tuple of 3 int
        A permutation of 0, 1, 2: R = R_i(a) R_j(b) R_k(c).

    Returns
    -------
    array (..., 3)
        Degrees, in the order of `order`; where the outer axes coincide the last angle is 0.
    """
    i, j, k = order
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    shape = quaternions.shape[:-1]
    matrix = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix().reshape(*shape, 3, 3)
    cosine = np.hypot(matrix[..., i, i], matrix[..., i, j])
    middle = np.arctan2(sign * matrix[..., i, k], cosine)
    pole = cosine < _AT_THE_POLE
    first = np.where(
        pole,
        np.arctan2(sign * matrix[..., k, j], matrix[..., j, j]),
        np.arctan2(-sign * matrix[..., j, k], matrix[..., k, k]),
    )
    last = np.where(pole, 0.0, np.arctan2(-sign * matrix[..., i, j], matrix[..., i, i]))
    return np.degrees(np.stack([first, middle, last], axis=-1))


def _plain_names(names: tuple[str, ...]) -> list[str]:
    plain = ["_".join(name.split()) for name in names]
    for place, name in enumerate(plain):
        if not name or not name.isprintable() or set("{}#") & set(name) or "//" in name:
            raise ValueError(f"joint name {names[place]!r} cannot stand in a BVH; rename the joint")
        if name in plain[:place]:
            raise ValueError(f"two joints would be called {name!r} in the BVH; rename one of them")
    return plain


def _hierarchy(motion: Motion, names: list[str], rotation_order: str) -> Iterator[str]:
    children = _children(motion.skeleton.parents)
    rotations = " ".join(f"{axis}rotation" for axis in rotation_order)
    yield "HIERARCHY"
    depths = [0] * len(names)
    depth = 0
    for joint in _file_order(motion.skeleton.parents):
        if joint:
            depths[joint] = depths[motion.skeleton.parents[joint]] + 1
        yield from _closing(depth, depths[joint])
        depth = depths[joint] + 1
        pad = "  " * depths[joint]
        offset = _numbers(motion.skeleton.offsets[joint] if joint else np.zeros(3))
        positions = "" if joint else "Xposition Yposition Zposition "
        yield f"{pad}{'JOINT' if joint else 'ROOT'} {names[joint]}"
        yield f"{pad}{{"
        yield f"{pad}  OFFSET {offset}"
        yield f"{pad}  CHANNELS {3 if joint else 6} {positions}{rotations}"
        if not children[joint]:
            yield from (
                f"{pad}  End Site",
                f"{pad}  {{",
                f"{pad}    OFFSET {_numbers(np.zeros(3))}",
                f"{pad}  }}",
            )
    yield from _closing(depth, 0)


def _closing(depth: int, until: int) -> Iterator[str]:
    for level in range(depth - 1, until - 1, -1):
        yield "  " * level + "}"


def _frames(motion: Motion, order: tuple[int, int, int]) -> Iterator[str]:
    joints = _file_order(motion.skeleton.parents)
    angles = np.unwrap(euler_angles(motion.rotations, order)[:, joints], period=360, axis=0)
    values = np.concatenate([motion.root_position, angles.reshape(motion.frames, -1)], axis=1)
    values = np.round(values, DECIMALS) + 0.0  # no -0.000000
    yield "MOTION"
    yield f"Frames: {motion.frames}"
    yield f"Frame Time: {1 / motion.fps:.10f}"
    line = " ".join([f"%.{DECIMALS}f"] * values.shape[1])
    for row in values:
        yield line % tuple(row.tolist())


def _children(parents: tuple[int, ...]) -> list[list[int]]:
    children: list[list[int]] = [[] for _ in parents]
    for joint, parent in enumerate(parents[1:], 1):
        children[parent].append(joint)
    return children


def _file_order(parents: tuple[int, ...]) -> list[int]:
    """Joints in the order their blocks open: each followed by all below it."""
    children = _children(parents)
    order, waiting = [], [0]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    return order


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.{DECIMALS}f}" for value in np.round(values, DECIMALS) + 0.0)
