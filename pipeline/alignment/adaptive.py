"""Adaptive DTW: coarse to fine, and the finer the dearer is standing still.

**[ADTW]** Heloir, Courty, Gibet, Multon, *Temporal alignment of communicative gesture sequences*. Postures
are compared by their place among the reference's principal ones: the weighted reference, centred, is U S V^T,
and a posture's coordinates are the first r of S^+ U^T; along each the reference varies alike, whatever the
coordinate explains. A component that does not vary is left out.

The path is sought at levels, as FastDTW does [Salvador & Chan 2004, 2007]. Each level has half the frames of
the finer one, means of two neighbours (an odd last one stands alone), until the shorter sequence has no more
than radius + 2. There it is a plain constrained DTW; every finer level keeps to the path of the coarser one,
each of its cells four of these, widened by `radius` frames in all directions. The slope weight K belongs to
the finest level and is less by one at each coarser one, never under 1: the coarse path may stand still where
whole passages demand it, the fine one then shall not. Time and memory are linear in the frames.

The paper names neither radius nor K. Here the radius is FastDTW's own, 1, and K is 2, the most that leaves
all levels but the finest free. Both are small for one reason: K multiplies all that has been accumulated, so
within its window a path puts what it must stand still at the beginning, and a wide window, or a K above 1 at
the coarse levels, lets the whole difference in length go there, as in `constrained_dtw`. How far it goes is
printed by `motionary reproduce adaptive-dtw`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.warp import at_a_clear_size, checked_pair
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.alignment.windows import Limits
from motionary.pipeline.motion import FloatArray

COMPONENTS = 4
"""r of the paper, which found that it carries the meaning of a gesture."""
RADIUS = 1
SLOPE_WEIGHT = 2.0


def adaptive_dtw(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    components: int = COMPONENTS,
    radius: int = RADIUS,
    slope_weight: float = SLOPE_WEIGHT,
) -> PathWarp:
    """Warp one sequence along a path that is free at large and straight in detail [ADTW].

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped: linearised rotations of joints in the paper, see
        `motionary.pipeline.alignment.postures`.
    reference : array (m, dofs)
        The sequence whose timing it takes, and whose postures span what is compared.
    weights : array (dofs,), optional
        Of the squared differences, not negative; 1 each by default.
    components : int
        r, the principal postures that count, at least 1; fewer where the reference has not as many.
    radius : int
        Frames by which the path of a coarser level is widened, 0 or more.
    slope_weight : float
        K at the finest level, from 1 to 2^256.

    Returns
    -------
    PathWarp
        Steps (1, 1), (1, 0) and (0, 1), both ends joined. Along a reference that does not move the path of
        fewest cells, since nothing tells its frames apart.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, or a setting is out of its range.
    """
    from motionary.pipeline.alignment.banded import banded_path

    if radius < 0 or radius != int(radius):
        raise ValueError(f"radius is {radius}; it is a number of frames, 0 or more")
    levels = [eigenposture_coordinates(moving, reference, weights, components)]
    while min(map(len, levels[-1])) > radius + 2:
        levels.append((_halved(levels[-1][0]), _halved(levels[-1][1])))
    limits = _all_columns(*map(len, levels[-1]))
    for level in range(len(levels) - 1, -1, -1):
        one, other = levels[level]
        # At the finest level K is as it was given, so that `banded_path` refuses what is out of its range.
        path = banded_path(one, other, *limits, max(1.0, slope_weight - level) if level else slope_weight)
        if level:
            limits = _widened(path, radius, *map(len, levels[level - 1]))
    return path_warp(path, len(levels[0][0]))


def constrained_dtw(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    components: int = COMPONENTS,
    slope_weight: float = SLOPE_WEIGHT,
) -> PathWarp:
    """Warp one sequence along a path that pays for standing still, at a single level [ADTW].

    Parameters
    ----------
    moving, reference, weights, components
        As of `adaptive_dtw`.
    slope_weight : float
        K, from 1 to 2^256; at 1 it is DTW.

    Returns
    -------
    PathWarp
        As `adaptive_dtw`; time and memory grow with n m.

    Raises
    ------
    ValueError
        As `adaptive_dtw`.
    """
    from motionary.pipeline.alignment.banded import banded_path

    one, other = eigenposture_coordinates(moving, reference, weights, components)
    path = banded_path(one, other, *_all_columns(len(one), len(other)), slope_weight)
    return path_warp(path, len(one))


def eigenposture_coordinates(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    components: int = COMPONENTS,
) -> tuple[FloatArray, FloatArray]:
    """Describe postures by their place among the principal ones of the reference.

    Parameters
    ----------
    moving, reference, weights, components
        As of `adaptive_dtw`.

    Returns
    -------
    moving, reference : array (n, r) and (m, r) float64
        The reference's columns have mean 0 and mean square 1; a single column of zeros where the reference
        does not move.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, or `components` is under 1.
    """
    moving, reference = checked_pair(moving, reference)
    if components < 1 or components != int(components):
        raise ValueError(f"components is {components}; it is a number of principal postures, 1 or more")
    rounding = np.finfo(reference.dtype).eps if reference.dtype.kind == "f" else np.finfo(np.float64).eps
    (moving, reference), _ = at_a_clear_size(moving.astype(np.float64), reference.astype(np.float64))
    scale = np.sqrt(checked_weights(weights, reference.shape[1]))
    mean = reference.mean(axis=0, dtype=np.float64)
    centred = (reference - mean) * scale
    _, spread, directions = np.linalg.svd(centred, full_matrices=False)
    # What rounding the values has made of something constant is no component.
    least = max(centred.shape) * rounding * np.linalg.norm(reference * scale)
    kept = spread[:components] > least
    if not kept.any():
        return np.zeros((len(moving), 1)), np.zeros((len(reference), 1))
    basis = directions[: len(kept)][kept].T * (np.sqrt(len(reference)) / spread[: len(kept)][kept])
    return ((moving - mean) * scale) @ basis, centred @ basis


def _halved(values: FloatArray) -> FloatArray:
    """Return the means of neighbours (ceil(frames / 2), dofs)."""
    pairs = values[: len(values) // 2 * 2].reshape(-1, 2, values.shape[1]).mean(axis=1)
    return np.concatenate([pairs, values[len(pairs) * 2 :]])


def _all_columns(m: int, n: int) -> Limits:
    return np.zeros(m, dtype=np.int64), np.full(m, n - 1)


def _widened(path: NDArray[np.int64], radius: int, m: int, n: int) -> Limits:
    """Return the window that a path of half as many frames leaves."""
    frames = np.arange(path[-1, 0] + 1)
    lowest = path[np.searchsorted(path[:, 0], frames), 1]
    highest = path[np.searchsorted(path[:, 0], frames, side="right") - 1, 1]
    rows = np.arange(m)
    first = 2 * lowest[np.maximum(rows - radius, 0) // 2] - radius
    last = 2 * highest[np.minimum(rows + radius, m - 1) // 2] + 1 + radius
    return np.maximum(first, 0), np.minimum(last, n - 1)
