"""A figure of the player, and how it becomes text.

A place is `origin + scale * value`, the values 16-bit whole numbers; `scale` is a five-thousandth of the body
(a third of a millimetre of a person) or, of a figure that goes far, what holds its range. In time a value is
told by how it departs from going on as it went (its second difference), which is nearly always one byte. The
rival, 16-bit values as they are, takes twice as much.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

_QUANTUM = 2e-4  # of the body's size
_LARGEST = 32767


@dataclass(frozen=True, eq=False)
class Figure:
    """A motion for the player.

    Parameters
    ----------
    name : str
        Shown with it.
    joints : tuple of str
        J names.
    parents : tuple of int
        J indices, -1 for the root, smaller than the joint's own index.
    fps : float
        Frames a second.
    source_fps : float
        Those of the file, which the player counts in.
    values : array (T, J, 3) int16
        Places: `origin + scale * values`, source units, Y up.
    scale : float
    origin : array (3,)
    size : float
        The longest chain of bones, source units; figures are drawn at one size.
    turn : float
        Where the first frame faces, radians from +Z towards +X; figures begin facing the viewer.
    floor : float
        Height of the lowest point, source units.
    clip_id, label : str, optional
    body : mapping of str to int
        The joint that each canonical joint is; empty where no convention fits.
    warp_times : array (m,), optional
        For each frame of the reference the seconds of this motion shown at it.
    warp_fps : float
        Frames a second of those.
    reference : str, optional
        What it is aligned to.
    residual : array (m, J) uint8, optional
        How far each joint is from the reference's in its time, 255 for `residual_max`.
    residual_max : float
        The most that it reaches, leg lengths.
    contacts : mapping of int to array (T,) bool
        For joints that may stand on the floor, whether they do.
    """

    name: str
    joints: tuple[str, ...]
    parents: tuple[int, ...]
    fps: float
    source_fps: float
    values: NDArray[np.int16]
    scale: float
    origin: FloatArray
    size: float
    turn: float
    floor: float
    clip_id: str | None = None
    label: str | None = None
    body: Mapping[str, int] = field(default_factory=dict)
    warp_times: FloatArray | None = None
    warp_fps: float = 30.0
    reference: str | None = None
    residual: NDArray[np.uint8] | None = None
    residual_max: float = 0.0
    contacts: Mapping[int, NDArray[np.bool_]] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.values)

    @property
    def seconds(self) -> float:
        """Time from the first frame to the last, in seconds."""
        return (self.frames - 1) / self.fps

    def positions(self) -> FloatArray:
        """Return the places (T, J, 3) as the player shows them, source units."""
        return self.origin + self.scale * self.values

    def only(self, kept: Sequence[int]) -> Figure:
        """Return the figure with some joints, ascending; each hangs from the nearest kept one above it."""
        place_of = {joint: place for place, joint in enumerate(kept)}
        return replace(
            self,
            joints=tuple(self.joints[joint] for joint in kept),
            parents=_hung(self.parents, place_of),
            values=self.values[:, kept],
            body={name: place_of[joint] for name, joint in self.body.items() if joint in place_of},
            residual=None if self.residual is None else self.residual[:, kept],
            contacts={place_of[joint]: on for joint, on in self.contacts.items() if joint in place_of},
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as the player's JSON."""
        return {
            "name": self.name,
            "clip_id": self.clip_id,
            "label": self.label,
            "fps": self.fps,
            "source_fps": self.source_fps,
            "frames": self.frames,
            "seconds": self.seconds,
            "joints": list(self.joints),
            "parents": list(self.parents),
            "body": dict(self.body),
            "scale": self.scale,
            "origin": self.origin.tolist(),
            "positions": _text(packed(self.values)),
            "size": self.size,
            "turn": self.turn,
            "floor": self.floor,
            **self._reference_dict(),
            **self._contact_dict(),
        }

    def _reference_dict(self) -> dict[str, Any]:
        made: dict[str, Any] = {}
        if self.warp_times is not None:
            times = _text(self.warp_times.astype("<f4"))
            made["warp"] = {"fps": self.warp_fps, "reference": self.reference, "times": times}
        if self.residual is not None:
            different, column = np.unique(self.residual, axis=1, return_inverse=True)  # fingers: their hand's
            made["residual"] = {
                "max": self.residual_max,
                "column": column.tolist(),
                "values": _text(different),
            }
        return made

    def _contact_dict(self) -> dict[str, Any]:
        if not self.contacts:
            return {}
        bits = np.packbits(np.stack([*self.contacts.values()], axis=1), axis=None, bitorder="little")
        return {"contacts": {"joints": [*self.contacts], "bits": _text(bits)}}


def quantised(places: FloatArray, size: float) -> tuple[NDArray[np.int16], float, FloatArray]:
    """Return places (T, J, 3) as whole numbers, their scale and their origin; `size` is the body's."""
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    scale = max(size * _QUANTUM, float((high - low).max()) / (2 * _LARGEST))
    origin = low + (high - low) / 2
    return np.rint((places - origin) / scale).astype(np.int16), scale, origin


def shares(residual: FloatArray) -> tuple[NDArray[np.uint8], float]:
    """Return a residual (m, J) as shares of 255, and the most that it reaches."""
    most = float(residual.max(initial=0.0))
    return np.rint(residual * (255 / (most or 1.0))).astype(np.uint8), most


def packed(values: NDArray[np.int16]) -> NDArray[np.uint8]:
    """Pack values (T, J, 3) by their second differences in time.

    A difference of at most 127 is one byte, signed; another is -128 and then four bytes, the low one first.
    The first frame is its own difference, the second its step from there.
    """
    rows = values.reshape(len(values), -1).astype(np.int32)
    steps = np.diff(rows, axis=0, prepend=0)
    turns = steps.copy()
    turns[2:] -= steps[1:-1]
    flat = turns.ravel()
    wide = np.abs(flat) > 127
    start = np.concatenate([[0], np.cumsum(np.where(wide, 5, 1))])
    stream = np.empty(start[-1], np.uint8)
    stream[start[:-1]] = np.where(wide, 128, flat & 255)
    for byte in range(4):
        stream[start[:-1][wide] + 1 + byte] = (flat[wide] >> (8 * byte)) & 255
    return stream


def _hung(parents: Sequence[int], place_of: Mapping[int, int]) -> tuple[int, ...]:
    found = []
    for joint in place_of:
        above = parents[joint]
        while above != -1 and above not in place_of:
            above = parents[above]
        found.append(place_of.get(above, -1))
    return tuple(found)


def _text(array: NDArray) -> str:
    return base64.b64encode(array.tobytes()).decode()
