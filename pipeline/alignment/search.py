"""The segment length and slack of correlation-optimized time warping, searched for [CoTW 4].

    maximise over L, delta:  rho - alpha |h|        (eq. 8; see `whole_output`)

over L = 8 .. m / 2 and delta = 1 .. L - 4, and the single segment that does not warp, so that the result's
correlation is never below length-matching's. Where no DOF varies in both sequences nothing correlates, no
warp is better than that one, and none is tried. Of equal values the shorter segment is taken, then the larger
slack that is used up.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from motionary.pipeline.alignment.coarse_to_fine import refined_warps
from motionary.pipeline.alignment.cotw import CotwWarp, check_spacing, warp_of
from motionary.pipeline.alignment.grid import GridWarp, all_warps
from motionary.pipeline.alignment.matched import matched_pair
from motionary.pipeline.alignment.nodes import LEAST_LENGTH
from motionary.pipeline.alignment.whole_output import WholeOutput
from motionary.pipeline.config import Effort, Spacing
from motionary.pipeline.motion import FloatArray

SHORTEST_SEGMENT = 8
# Up to here the whole grid takes some tens of milliseconds.
_FRAMES_OF_A_FULL_GRID = 96
MOST_GRID_FRAMES = 2000
"""The longest reference for which the whole grid is searched: it takes an hour and some gigabytes."""


def cotw_search(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    alpha: float = 0.5,
    *,
    effort: Effort = "full",
    spacing: Spacing = "equal",
    open_ends: bool = False,
) -> CotwWarp:
    """Warp one sequence to another by the segment length and slack that serve best [CoTW 4, eq. 8].

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    weights : array (dofs,), optional
        Not negative, not all 0; 1 each by default.
    alpha : float
        Weight of distortion against correlation; the paper suggests .5.
    effort : {"full", "fast"}
        The whole grid, whose time grows with the fourth power of m (some seconds for 300 frames, and with
        open ends some ten times that) and its memory with the square; or, above
        96 frames, warps that maximise an additive version of eq. 8, refined (`coarse_to_fine`). Such a warp
        keeps to its L and slack and has the value that is told, but Table 1's optimum at that L and slack
        may be another one.
    spacing : {"equal", "boundaries"}
        As in `cotw`.
    open_ends : bool
        As in `cotw`.

    Returns
    -------
    CotwWarp
        With `.segment_length`, `.slack`, `.correlation` and `.distortion`. A single segment, L = m and slack
        0, where no warp is better than none.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, all weights are 0, an option is unknown, or the whole grid
        is asked for more than `MOST_GRID_FRAMES`.
    """
    if effort not in ("full", "fast"):
        raise ValueError(f"effort is {effort!r}; it must be 'full' or 'fast'")
    check_spacing(spacing)
    if not (np.isfinite(alpha) and alpha >= 0):
        raise ValueError(f"alpha is {alpha}; it must be finite and not negative")
    pair = matched_pair(moving, reference, weights)
    whole = WholeOutput(pair)
    if effort == "full" and pair.frames > MOST_GRID_FRAMES:
        raise ValueError(
            f"the whole grid for a reference of {pair.frames} frames would take hours (at most "
            f"{MOST_GRID_FRAMES}); search with effort='fast'"
        )
    warps: Iterable[GridWarp]
    if not (pair.source_varies & pair.target_varies).any():
        warps = ()
    elif effort == "full" or pair.frames <= _FRAMES_OF_A_FULL_GRID:
        warps = all_warps(
            pair, range(SHORTEST_SEGMENT, pair.frames // 2 + 1), LEAST_LENGTH, spacing, open_ends
        )
    else:
        warps = refined_warps(pair, SHORTEST_SEGMENT, alpha, spacing, open_ends)
    nodes = np.array([0, pair.frames - 1])
    chosen = GridWarp(pair.frames, 0, nodes, nodes)
    correlation, distortion = whole(chosen.nodes, chosen.moved)
    for warp in warps:
        rho, h = whole(warp.nodes, warp.moved)
        if rho - alpha * h > correlation - alpha * distortion + 1e-12:
            chosen, correlation, distortion = warp, rho, h
    return warp_of(pair, whole, chosen.nodes, chosen.moved, chosen.segment_length, chosen.slack)
