"""A motion: a skeleton, and where each of its joints is turned in every frame.

Everything downstream of the readers sees motions only through this module and never asks which file
format one came from. The conventions, each named with its rival:

- world: right-handed, **Y up** (not Z up); a figure facing +Z has its left side at +X
- quaternions: **x, y, z, w** (scipy's order, not w first), unit length, local to the parent joint
- one joint translates: the root, which is the pelvis; every other joint keeps a constant offset

A motion of markers (C3D) has places instead of rotations: nobody measured how its joints are turned, and
nothing here makes that up. Its `rotations` are of no joint, and `places` tells where the joints are.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.floating]


@dataclass(frozen=True)
class Skeleton:
    """Joints as a tree, parents before children.

    Parameters
    ----------
    names : tuple of str
        J joint names, all different; the root is the first.
    parents : tuple of int
        J indices; -1 for the root, otherwise smaller than the joint's own index.
    offsets : array (J, 3)
        Each joint's place in its parent's frame, in source units; the root's row is not used.

    Raises
    ------
    ValueError
        The tree is not one: lengths differ, a name stands twice, or a parent comes after its child.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "offsets", np.asarray(self.offsets, dtype=np.float64))
        count = len(self.names)
        if len(self.parents) != count or self.offsets.shape != (count, 3):
            raise ValueError(
                f"{count} joint names, {len(self.parents)} parents, offsets of shape {self.offsets.shape}: "
                f"a skeleton of {count} joints needs {count} parents and offsets of shape ({count}, 3)"
            )
        if len(set(self.names)) != count:
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise ValueError(f"joint name {twice!r} stands twice; joint names must differ")
        for joint, parent in enumerate(self.parents):
            if not (parent == -1 if joint == 0 else 0 <= parent < joint):
                raise ValueError(
                    f"joint {self.names[joint]!r} has parent {parent}; parents stand before children"
                )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Skeleton):
            return NotImplemented
        same_tree = self.names == other.names and self.parents == other.parents
        return same_tree and np.array_equal(self.offsets, other.offsets)

    def __hash__(self) -> int:
        return hash((self.names, self.parents, self.offsets.tobytes()))

    def index(self, name: str) -> int:
        """Index of the joint called `name`.

        Raises
        ------
        KeyError
            No joint has that name.
        """
        try:
            return self._index_of[name]
        except KeyError:
            raise KeyError(f"no joint {name!r}; this skeleton has {', '.join(self.names)}") from None

    @cached_property
    def _index_of(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """One take of motion capture.

    Parameters
    ----------
    name : str
        What the take is called; the readers use the file's stem.
    skeleton : Skeleton
        J joints.
    fps : float
        Frames a second.
    root_position : array (T, 3)
        Place of the root joint in the world, in source units.
    rotations : array (T, J, 4)
        Local unit quaternions x, y, z, w; the root's turns the skeleton into the world.
    unit : float, optional
        Metres in one source unit, where the source says so.
    source : str
        The file the motion was read from, or what made it.
    notes : tuple of str
        What the reader changed or assumed, for a person to read.
    places : array (T, J, 3), optional
        Of a motion of markers: each joint seen from the root along the world's axes, in source units, 0 for
        the root. `rotations` is then (T, 0, 4), and the skeleton's offsets say no more than how long the
        bones are.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, a quaternion is zero, or fps is not positive.
    """

    name: str
    skeleton: Skeleton
    fps: float
    root_position: FloatArray
    rotations: FloatArray
    unit: float | None = None
    source: str = ""
    notes: tuple[str, ...] = field(default=())
    places: FloatArray | None = None

    def __post_init__(self) -> None:
        root = np.asarray(self.root_position, dtype=np.float64)
        rotations = np.asarray(self.rotations, dtype=np.float64)
        frames, joints = len(root), len(self.skeleton.names)
        turned = 0 if self.places is not None else joints
        if root.shape != (frames, 3) or rotations.shape != (frames, turned, 4):
            raise ValueError(
                f"root_position has shape {root.shape} and rotations {rotations.shape}; "
                f"this skeleton needs (T, 3) and (T, {turned}, 4) with one T"
            )
        if frames == 0:
            raise ValueError(f"motion {self.name!r} has no frames")
        if not (np.isfinite(self.fps) and self.fps > 0):
            raise ValueError(f"fps is {self.fps}; it must be positive")
        if not (np.isfinite(root).all() and np.isfinite(rotations).all()):
            raise ValueError(f"motion {self.name!r} holds a value that is not a number")
        norms = np.linalg.norm(rotations, axis=-1, keepdims=True)
        if not (norms > 1e-8).all():
            raise ValueError(f"motion {self.name!r} holds a quaternion of length zero")
        object.__setattr__(self, "root_position", root)
        object.__setattr__(self, "rotations", rotations / norms)
        if self.places is not None:
            object.__setattr__(self, "places", self._checked_places(frames, joints))

    def _checked_places(self, frames: int, joints: int) -> FloatArray:
        places = np.asarray(self.places, dtype=np.float64)
        if places.shape != (frames, joints, 3):
            raise ValueError(f"places have shape {places.shape}; this motion needs ({frames}, {joints}, 3)")
        if not np.isfinite(places).all() or places[:, 0].any():
            raise ValueError(
                f"motion {self.name!r} holds a place that is not a number, or a root beside itself"
            )
        return places

    def __repr__(self) -> str:
        joints = f"{len(self.skeleton.names)} joints{'' if self.places is None else ' of markers'}"
        return f"<Motion {self.name!r}: {self.frames} frames at {self.fps:g} a second, {joints}>"

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.root_position)

    @property
    def seconds(self) -> float:
        """Time from the first frame to the last, in seconds."""
        return (self.frames - 1) / self.fps

    def positions(self) -> FloatArray:
        """Place every joint in the world: by forward kinematics, or as its markers were.

        Returns
        -------
        array (T, J, 3)
            Joint positions in source units.
        """
        if self.places is not None:
            return self.root_position[:, None] + self.places
        skeleton = self.skeleton
        frames, joints = self.rotations.shape[:2]
        local = Rotation.from_quat(self.rotations.reshape(-1, 4)).as_matrix().reshape(frames, joints, 3, 3)
        world = np.empty_like(local)
        place = np.empty((frames, joints, 3))
        world[:, 0], place[:, 0] = local[:, 0], self.root_position
        for joint in range(1, joints):
            parent = skeleton.parents[joint]
            np.matmul(world[:, parent], local[:, joint], out=world[:, joint])
            place[:, joint] = place[:, parent] + world[:, parent] @ skeleton.offsets[joint]
        return place

    def sampled(self, frame_times: FloatArray) -> Motion:
        """Show the motion at fractional frames: slerp for rotations, linear for places.

        Parameters
        ----------
        frame_times : array (S,)
            Times in frames, within 0 .. T-1.

        Returns
        -------
        Motion
            S frames at the same fps.

        Raises
        ------
        ValueError
            A time lies outside the motion.
        """
        times = np.asarray(frame_times, dtype=np.float64)
        if times.size and not (times.min() >= -1e-6 and times.max() <= self.frames - 1 + 1e-6):
            raise ValueError(
                f"frame times run from {times.min():g} to {times.max():g}; "
                f"motion {self.name!r} has frames 0 to {self.frames - 1}"
            )
        times = np.clip(times, 0, self.frames - 1)
        before = np.minimum(times.astype(np.intp), max(self.frames - 2, 0))
        after = np.minimum(before + 1, self.frames - 1)
        share = times - before
        root = (1 - share)[:, None] * self.root_position[before] + share[:, None] * self.root_position[after]
        if self.places is not None:
            part = share[:, None, None]
            places = (1 - part) * self.places[before] + part * self.places[after]
            return replace(self, root_position=root, rotations=np.empty((len(root), 0, 4)), places=places)
        rotations = self.rotations[before]
        between = np.flatnonzero(share)  # on a frame there is nothing to turn
        rotations[between] = slerp(rotations[between], self.rotations[after[between]], share[between, None])
        return replace(self, root_position=root, rotations=rotations)


def slerp(start: FloatArray, end: FloatArray, share: FloatArray) -> FloatArray:
    """Turn from one rotation towards another at constant angular speed, the short way round.

    Parameters
    ----------
    start, end : array (..., 4)
        Unit quaternions x, y, z, w.
    share : array, broadcast against the leading axes
        0 gives `start`, 1 gives `end`.

    Returns
    -------
    array (..., 4)
        Unit quaternions.
    """
    shape = start.shape
    first = Rotation.from_quat(start.reshape(-1, 4))
    turn = (first.inv() * Rotation.from_quat(end.reshape(-1, 4))).as_rotvec()
    shares = np.broadcast_to(share, shape[:-1]).reshape(-1, 1)
    return (first * Rotation.from_rotvec(shares * turn)).as_quat().reshape(shape)
