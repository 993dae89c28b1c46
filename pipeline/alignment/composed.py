"""Warps that share their steps, brought to the frames of one of the sequences.

`generalized_time_warping` and other methods for several sequences show each along l steps of a time of their
own. Frame k of the reference is met where the reference's own path passes k; there the other paths are read,
linearly between steps.

- Where the reference's path stands still at k for several steps, the middle of them counts, as a path of
  joined frames shows the mean of the frames that one meets.
- Frames that the reference's path does not cover, before it begins or after it ends, show what its first or
  last covered time shows: they are held, not extrapolated.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.motion import FloatArray


def in_time_of(warps: Sequence[Warp], reference: int) -> tuple[Warp, ...]:
    """Bring warps of one number of steps to the frames of one sequence.

    Parameters
    ----------
    warps : sequence of Warp
        One a sequence, each with l times: steps that they share.
    reference : int
        Place among `warps` of the sequence whose frames count.

    Returns
    -------
    tuple of Warp
        One a sequence, in their order, each with a time for every frame of the reference. The reference's own
        is the identity over the frames that its path covers.

    Raises
    ------
    ValueError
        The warps have other numbers of steps, or none is at that place.
    """
    if not 0 <= reference < len(warps):
        raise ValueError(f"reference is {reference}; there are {len(warps)} warps, counted from 0")
    for place, warp in enumerate(warps):
        if warp.reference_frames != warps[0].reference_frames:
            raise ValueError(
                f"warp {place} has {warp.reference_frames} steps and warp 0 {warps[0].reference_frames}; "
                "warps must share their steps"
            )
    steps = _passing_steps(warps[reference].source_time, warps[reference].moving_frames)
    every = np.arange(warps[reference].reference_frames)
    return tuple(
        Warp(np.maximum.accumulate(np.interp(steps, every, warp.source_time)), warp.moving_frames)
        for warp in warps
    )


def _passing_steps(path: FloatArray, frames: int) -> FloatArray:
    """Return at which step, maybe fractional, a path passes each frame (frames,)."""
    shown, first, stays = np.unique(path, return_index=True, return_counts=True)
    last = first + stays - 1
    wanted = np.clip(np.arange(frames), shown[0], shown[-1])
    before = np.searchsorted(shown, wanted, side="right") - 1
    after = np.searchsorted(shown, wanted, side="left")
    gap = shown[after] - shown[before]
    share = np.divide(wanted - shown[before], gap, out=np.full(frames, 0.5), where=gap > 0)
    return last[before] + share * (first[after] - last[before])
