"""How much a binary file may ask for: a few bytes can declare a motion of any size, which a text cannot."""

from __future__ import annotations

import math
from pathlib import Path

from motionary.pipeline.readers.bvh import SLOWEST
from motionary.pipeline.readers.errors import ReadError

LONGEST = 4 * 3600.0
"""Seconds of one take at most: at the common rate each hour of joints fills some hundred megabytes."""

_FASTEST = 1e6  # frames a second, as for a BVH's frame time


def check_extent(path: Path, frames: int, fps: float) -> None:
    """Raise `ReadError` where a file declares no frames, an impossible rate, or a take beyond `LONGEST`."""
    if frames == 0:
        raise ReadError(path, None, "the file has no frames", "export it with its motion")
    if not (math.isfinite(fps) and 1 / SLOWEST <= fps <= _FASTEST):
        what = f"a rate of {fps:g} frames a second is impossible"
        raise ReadError(path, None, what, "export the file with its rate")
    if frames / fps > LONGEST:
        what = f"{frames} frames at {fps:g} a second are {frames / fps / 3600:.3g} hours"
        mend = f"check its rate, or cut it into takes of at most {LONGEST / 3600:g} hours"
        raise ReadError(path, None, what, mend)
