"""Paths of sequences to a mean that goes on at every step: the DTW of `procrustes.py`, and its start.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012, 5.1, does not say how the DTW is modified.
Here steps are (1, 1) and (0, 1) alone: a sequence goes on to its next frame or keeps it, and skips none. The
rival, plain DTW, would show several frames of a sequence at one step of the mean.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray


def one_frame_a_step(costs: FloatArray) -> NDArray[np.int64]:
    """Find the cheapest way through a sequence in which every step shows its last frame or the next one.

    Parameters
    ----------
    costs : array (n, l)
        Of showing frame i at step t; l >= n.

    Returns
    -------
    array (l,) int64
        The frame at every step, from 0 to n - 1, rising by 0 or 1. Of ways that cost the same it is, looking
        back from the end, the one that is ahead.
    """
    frames, steps = costs.shape
    total = np.full(frames, np.inf)
    total[0] = costs[0, 0]
    came = np.zeros((steps, frames), dtype=bool)  # from the frame before
    for step in range(1, steps):
        np.less(total[:-1], total[1:], out=came[step, 1:])
        total[1:] = np.minimum(total[1:], total[:-1])
        total += costs[:, step]
    path = np.empty(steps, dtype=np.int64)
    frame = frames - 1
    for step in range(steps - 1, -1, -1):
        path[step] = frame
        frame -= int(came[step, frame])
    return path


def uniform_path(lengths: Sequence[int], steps: int) -> NDArray[np.int64]:
    """Return the path on which all sequences run evenly from end to end, where procrustes warping starts.

    Parameters
    ----------
    lengths : sequence of int (m,)
        Frames of the sequences.
    steps : int
        l.

    Returns
    -------
    array (l, m) int64
        The nearest frames, halves upwards.
    """
    places = np.linspace(0, np.asarray(lengths, dtype=np.float64) - 1, steps)
    return np.floor(places + 0.5).astype(np.int64)
