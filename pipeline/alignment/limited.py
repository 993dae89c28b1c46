"""DTW that stands still a few steps at most.

What the experiment of [ADTW] calls constrained DTW is not its own recurrence but this bound: at most two
steps in a row along either axis [Kovar & Gleicher 2003, *Flexible automatic motion blending with registration
curves*]. A diagonal step ends a stay, and so does a step along the other axis.
"""

from __future__ import annotations

import numpy as np

from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.warp import checked_pair
from motionary.pipeline.motion import FloatArray


def limited_dtw(moving: FloatArray, reference: FloatArray, most: int = 2) -> PathWarp:
    """Warp one sequence along the nearest path that stands still no longer than a few steps.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
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
        Shapes disagree, a value is not finite, `most` is out of its range, or the lengths differ by more than
        such a path can make up for.
    """
    from motionary.pipeline.alignment.limited_kernels import limited_path
    from motionary.pipeline.distances import cost_matrix

    moving, reference = checked_pair(moving, reference)
    if not 1 <= most <= 60:
        raise ValueError(f"most is {most}; it is a number of steps from 1 to 60")
    n, m = len(moving), len(reference)
    before = np.zeros((n, m, 2 * most + 1), dtype=np.int8)
    path = np.empty((n + m - 1, 2), dtype=np.int64)
    begin = limited_path(cost_matrix(moving, reference).astype(np.float64), most, before, path)
    if begin < 0:
        raise ValueError(
            f"no path with at most {most} steps in a row along one axis joins {n} moving and {m} reference "
            "frames; allow more, or bring them nearer in length first, by `uniform`"
        )
    return path_warp(path[begin:], n)
