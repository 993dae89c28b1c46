"""Dynamic time warping of frames (DTW), and of their derivatives (DDTW).

DTW joins the frames that lie nearest. Where one sequence stands higher than the other, many of its frames may
be joined with a single extreme of the other; DDTW [Keogh & Pazzani 2001, *Derivative dynamic time warping*]
joins frames that rise and fall alike, so an offset in any DOF changes nothing. It compares their estimate

    q'_i = ((q_i - q_{i-1}) + (q_{i+1} - q_{i-1}) / 2) / 2,    a frame at the least

the mean of the slope from the frame before and of the slope from the frame before to the frame after. At both
ends, where there is no such frame, the neighbour's estimate stands. Two frames have the one slope between
them, a single frame 0: the paper says nothing of sequences that short. The rival, central differences
(q_{i+1} - q_{i-1}) / 2, is smoother and lags by nothing; this one leans towards the frame before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.warp import checked_sequence
from motionary.pipeline.alignment.weights import weighted_pair
from motionary.pipeline.alignment.windows import Window, check_window
from motionary.pipeline.motion import FloatArray


def dtw(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    window: Window | None = None,
) -> PathWarp:
    """Warp one sequence along the path on which its frames lie nearest to the reference's [CoTW 2].

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    weights : array (dofs,), optional
        Of the squared differences, not negative; 1 each by default.
    window : Window, optional
        Cells that the path keeps to, see `motionary.pipeline.alignment.windows`; all by default. Time and
        memory go with the number of its cells.

    Returns
    -------
    PathWarp
        Along `motionary.pipeline.distances.dtw_path`: the least total of Euclidean distances, steps (1, 1),
        (1, 0) and (0, 1), both ends joined.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, the window leaves no path, or the sequences are too long
        (n + m above 2^19).
    TypeError
        The window is none.
    """
    from motionary.pipeline.distances import cost_matrix, dtw_path

    check_window(window)
    moving, reference = weighted_pair(moving, reference, weights)
    if window is None:
        path = dtw_path(cost_matrix(moving, reference))
    else:
        from motionary.pipeline.alignment.banded import banded_path

        path = banded_path(moving, reference, *window.limits(len(moving), len(reference)))
    return path_warp(path, len(moving))


def derivative_dtw(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    window: Window | None = None,
) -> PathWarp:
    """Warp one sequence along the path on which it rises and falls as the reference does.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    weights, window
        As of `dtw`.

    Returns
    -------
    PathWarp
        That of `dtw` on the `derivatives` of both. Where one of them has a single frame, or does not move,
        nothing can be compared and only the other's slopes count.

    Raises
    ------
    ValueError
        As `dtw`.
    """
    moving, reference = weighted_pair(moving, reference)
    return dtw(derivatives(moving), derivatives(reference), weights, window)


def nearest_path(moving: FloatArray, reference: FloatArray) -> NDArray[np.int64]:
    """Find the path of the least sum of *squared* distances [GTW eq. 1], which other methods alternate with.

    Parameters
    ----------
    moving : array (n, dofs)
    reference : array (m, dofs)

    Returns
    -------
    array (L, 2) of int
        As `motionary.pipeline.distances.dtw_path`.

    Raises
    ------
    ValueError
        As `dtw`.
    """
    from motionary.pipeline.distances import cost_matrix, dtw_path

    return dtw_path(cost_matrix(*weighted_pair(moving, reference)) ** 2)


def derivatives(values: FloatArray) -> FloatArray:
    """Estimate how fast a sequence changes at each of its frames, as Keogh and Pazzani do.

    Parameters
    ----------
    values : array (frames, dofs)
        Any sequence.

    Returns
    -------
    array (frames, dofs) float64
        In units a frame; both ends repeat their neighbours'. The slope between two frames; 0 of a single one.

    Raises
    ------
    ValueError
        `values` is not (frames, dofs), is empty, or holds a value that is not finite.
    """
    values = checked_sequence(values, "values").astype(np.float64)
    if len(values) < 3:
        return np.broadcast_to(values[-1] - values[0], values.shape).copy()
    before, here, after = values[:-2], values[1:-1], values[2:]
    inner = ((here - before) + (after - before) / 2) / 2
    return np.concatenate([inner[:1], inner, inner[-1:]])
