"""Two motions, one of them aligned to the other by some methods: what the page of an alignment shows."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention
from motionary.pipeline.motion import FloatArray, Motion

DIRECTIONS = ("left", "up", "forward")
STRETCHED = "only stretched to its length (UTW)"
"""What the moving motion is called before it is aligned."""


@dataclass(frozen=True, eq=False)
class Take:
    """A motion, and its pose at every frame of the pair's rate.

    Parameters
    ----------
    name : str
        A clip_id, or a file as it was given.
    motion : Motion
        As captured.
    pose : array (frames, 57)
        The pose columns of its features; see `motionary.pipeline.features`.
    """

    name: str
    motion: Motion
    pose: FloatArray

    def joint(self, joint: str) -> FloatArray:
        """Return a canonical joint's way: left, up, forward, in leg lengths (frames, 3)."""
        column = 3 * CANONICAL_JOINTS.index(joint)
        # Features are divided by the root of the number of joints; here they are leg lengths again.
        return self.pose[:, column : column + 3] * np.sqrt(len(CANONICAL_JOINTS))


@dataclass(frozen=True, eq=False)
class AlignedPair:
    """A motion aligned to another.

    Parameters
    ----------
    moving, reference : Take
        The one that is warped, and the one whose time it takes.
    rate : float
        Frames a second of the poses and of the warps.
    warps : mapping of str to Warp
        Each method's by what it is called, without the plain stretch; perhaps none.
    conventions : sequence of Convention
        A user's own joint-name conventions.
    """

    moving: Take
    reference: Take
    rate: float
    warps: Mapping[str, Warp]
    conventions: Sequence[Convention] = ()

    @property
    def short_names(self) -> tuple[str, str]:
        """What the two are called where there is little room: without folders if that tells them apart."""
        full = self.moving.name, self.reference.name
        short = (posixpath.basename(full[0]) or full[0], posixpath.basename(full[1]) or full[1])
        return short if short[0] != short[1] else full

    @property
    def stretched(self) -> Warp:
        """The moving motion only stretched to the reference's length: how it was before."""
        return uniform(self.moving.pose, self.reference.pose)

    @property
    def shown(self) -> Mapping[str, Warp]:
        """The warps, or where there is none the plain stretch."""
        return self.warps or {STRETCHED: self.stretched}
