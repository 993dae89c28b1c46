"""DTW that stands still a few steps at most.

What the experiment of [ADTW] calls constrained DTW is not its own recurrence but this bound: at most two
steps in a row along either axis [Kovar & Gleicher 2003, *Flexible automatic motion blending with registration
curves*]. A diagonal step ends a stay, and so does a step along the other axis.
"""

from __future__ import annotations

import numpy as np

from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.weights import weighted_pair
from motionary.pipeline.motion import FloatArray

MOST_WAYS = 1 << 30
"""Ways to come to cells that are kept, a byte each: with 2 steps those of two clips of 14,600 frames."""


def limited_dtw(
    moving: FloatArray, reference: FloatArray, weights: FloatArray | None = None, most: int = 2
) -> PathWarp:
    """Warp one sequence along the nearest path that stands still no longer than a few steps.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    weights : array (dofs,), optional
        Of the squared differences, not negative; 1 each by default.
    most : int
        Steps in a row along one axis that are allowed, 1 to 60.

    Returns
    -------
    PathWarp
        The least total of Euclidean distances among such paths, both ends joined. Memory grows with
        n m (2 most + 1).

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, `most` is out of its range, the lengths differ by more than
        such a path can make up for, or the sequences are too long (n m (2 most + 1) above 2^30).
    """
    from motionary.pipeline.alignment.limited_kernels import limited_path
    from motionary.pipeline.distances import cost_matrix

    moving, reference = weighted_pair(moving, reference, weights)
    if not 1 <= most <= 60:
        raise ValueError(f"most is {most}; it is a number of steps from 1 to 60")
    n, m = len(moving), len(reference)
    _refuse_too_long(n, m, most)
    before = np.zeros((n, m, 2 * most + 1), dtype=np.int8)
    path = np.empty((n + m - 1, 2), dtype=np.int64)
    begin = limited_path(cost_matrix(moving, reference).astype(np.float64), most, before, path)
    if begin < 0:
        raise ValueError(
            f"no path with at most {most} steps in a row along one axis joins {n} moving and {m} reference "
            "frames; allow more, or bring them nearer in length first, by `uniform`"
        )
    return path_warp(path[begin:], n)


def _refuse_too_long(moving_frames: int, reference_frames: int, most: int) -> None:
    ways = 2 * most + 1
    needed = moving_frames * reference_frames * ways
    if needed > MOST_WAYS:
        raise ValueError(
            f"{moving_frames} moving and {reference_frames} reference frames: {needed} ways to come to their "
            f"cells, {ways} each, and at most {MOST_WAYS} can be kept; resample or cut the clips"
            f"{', or allow fewer steps' if most > 1 else ''}"
        )
