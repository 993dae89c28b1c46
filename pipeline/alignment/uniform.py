"""Uniform time warping (UTW): two sequences brought to one length [CoTW 3.1].

Reference frame k of m shows moving time k (n - 1) / (m - 1): first and last frames meet, and all between is
stretched evenly. The paper's warping matrix W holds the same interpolation factors.
"""

from __future__ import annotations

import numpy as np

from motionary.pipeline.alignment.warp import Warp, checked_sequence
from motionary.pipeline.motion import FloatArray


def uniform(moving: FloatArray, reference: FloatArray) -> Warp:
    """Stretch or compress one sequence evenly to the length of another.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, any dofs)
        Only its length counts. Where it has a single frame, that shows the moving sequence's first.

    Returns
    -------
    Warp
        m times from 0 to n - 1.

    Raises
    ------
    ValueError
        A sequence is not (frames, dofs), is empty, or holds a value that is not finite.
    """
    frames = len(checked_sequence(moving, "moving"))
    return Warp(uniform_times(frames, len(checked_sequence(reference, "reference"))), frames)


def uniform_times(moving_frames: int, reference_frames: int) -> FloatArray:
    """Return the moving times k (n - 1) / (m - 1) of uniform time warping, (m,); 0 for a single frame."""
    return np.arange(reference_frames) * (moving_frames - 1) / max(reference_frames - 1, 1)
