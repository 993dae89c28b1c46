"""How far apart two alignments lie, and how long one of them stands still.

A warping path of m sequences is a curve in R^m: each of its l rows holds the frames of the m sequences, whole
or fractional, that are shown together. `path_error` compares two such curves whatever their numbers of rows
[GTW 5.1, eq. 9]; `path_deviation` compares two warps of one pair, target frame by target frame [FP 4, eq. 3];
`longest_stay` says how long a path of frames runs along an axis, which a viewer sees as a still figure
[ADTW].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from motionary.pipeline.alignment.warp import checked_sequence
from motionary.pipeline.motion import FloatArray


def path_error(path_a: ArrayLike, path_b: ArrayLike) -> float:
    """Measure how far two warping paths lie apart [GTW 5.1, eq. 9].

    Of every row of each path the Euclidean distance to the nearest row of the other, averaged over the rows
    of both. The paper calls a path a curve and measures to its points; so does this, not to the lines between
    them.

    Parameters
    ----------
    path_a : array (l1, m)
        Frames of the m sequences that are shown together, a row a step.
    path_b : array (l2, m)
        Another path of the same m sequences.

    Returns
    -------
    float
        In frames, the same for either order; 0 where the paths hold the same rows, each at least once.

    Raises
    ------
    ValueError
        A path is not (steps, sequences), is empty or holds a value that is not finite; or the numbers of
        sequences differ.
    """
    first, second = _checked_path(path_a, "path_a"), _checked_path(path_b, "path_b")
    if first.shape[1] != second.shape[1]:
        raise ValueError(
            f"path_a has {first.shape[1]} sequences and path_b {second.shape[1]}; they must have the same"
        )
    there, _ = KDTree(second).query(first)
    back, _ = KDTree(first).query(second)
    return float((np.sum(there) + np.sum(back)) / (len(first) + len(second)))


def path_deviation(source_a: ArrayLike, source_b: ArrayLike) -> float:
    """Measure how far apart two warps show the input, on average over the target's frames [FP 4, eq. 3].

    Parameters
    ----------
    source_a, source_b : array (n,)
        The frame of the input that is shown at each frame of the target, such as `Warp.source_time`.

    Returns
    -------
    float
        Mean absolute difference, in frames of the input.

    Raises
    ------
    ValueError
        One of them is not (target frames,), is empty or holds a value that is not finite; or they have other
        numbers of target frames.
    """
    first, second = _checked_times(source_a, "source_a"), _checked_times(source_b, "source_b")
    if len(first) != len(second):
        raise ValueError(
            f"source_a has {len(first)} target frames and source_b {len(second)}; "
            "both must map the same target"
        )
    return float(np.abs(first - second).mean())


def longest_stay(path: ArrayLike) -> int:
    """Count the most steps in a row during which one of the sequences keeps its frame [ADTW].

    Parameters
    ----------
    path : array (L, 2)
        Joined frames of two sequences, neither of which falls; more columns are allowed.

    Returns
    -------
    int
        In steps, not cells: 0 on a diagonal, and k where a frame is joined with k + 1 of the other sequence.

    Raises
    ------
    ValueError
        The path is not (cells, sequences), is empty, holds a value that is not finite, or falls.
    """
    cells = _checked_path(path, "path")
    steps = np.diff(cells, axis=0)
    falls = np.flatnonzero((steps < 0).any(axis=1))
    if falls.size:
        cell = int(falls[0])
        raise ValueError(
            f"path falls from {tuple(cells[cell].tolist())} to {tuple(cells[cell + 1].tolist())} after cell "
            f"{cell}; time must not run backwards"
        )
    longest = 0
    for moves in (steps > 0).T:
        ends = np.flatnonzero(np.concatenate([[True], moves, [True]]))
        longest = max(longest, int(np.diff(ends).max()) - 1)
    return longest


def _checked_path(path: ArrayLike, name: str) -> FloatArray:
    """Return a path, whose rows are frames of its own time and whose DOFs are the sequences', as float64."""
    return checked_sequence(np.asarray(path), name).astype(np.float64)


def _checked_times(times: ArrayLike, name: str) -> FloatArray:
    array = np.asarray(times)
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}; it needs one time a target frame: (frames,)")
    return _checked_path(array[:, None], name)[:, 0]
