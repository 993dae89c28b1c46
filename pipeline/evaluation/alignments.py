"""The scores of one warp: how alike two sequences are in one time, and what the warp does to get them there.

A warp that follows noise brings two sequences as close as any; it pays by standing still, by a rough ride or
by lying far from others, and no one number tells both. So these stand together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionary.pipeline.alignment.correlation import mean_correlation
from motionary.pipeline.alignment.trajectories import roughness
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.weights import varying_dofs
from motionary.pipeline.evaluation.paths import longest_stay, path_deviation
from motionary.pipeline.evaluation.trajectories import mean_distance
from motionary.pipeline.motion import FloatArray

_LEAST_ROUGH = 3  # frames that a trajectory needs to turn
_SAME_TIME = 6  # decimals of a frame that tell two times apart


@dataclass(frozen=True)
class AlignmentScores:
    """How good a warp is.

    Parameters
    ----------
    correlation : float or None
        Mean Pearson correlation of the warped sequence with the reference, over the DOFs that move in the
        moving sequence or in the reference; None where none does.
    distance : float
        `mean_distance` of the warped sequence from the reference.
    from_dtw : float
        `path_deviation` from the plain DTW's warp, in seconds.
    longest_still : float
        The longest that the warp shows one and the same moment, in seconds: 0 where it never stands still.
    longest_leap : float
        The most of the moving sequence that passes between two frames of the reference, in seconds.
    roughness : float or None
        Of the warped sequence; None of fewer than 3 frames.
    """

    correlation: float | None
    distance: float
    from_dtw: float
    longest_still: float
    longest_leap: float
    roughness: float | None


def alignment_scores(
    moving: FloatArray, reference: FloatArray, warp: Warp, plain: Warp, rate: float
) -> AlignmentScores:
    """Score a warp of two sequences.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence that is warped.
    reference : array (m, dofs)
        The sequence whose time it takes.
    warp, plain : Warp
        Of these two: the one that is scored, and that of DTW.
    rate : float
        Frames a second of both.

    Raises
    ------
    ValueError
        Shapes disagree or a value is not finite, or a warp is of other lengths.
    """
    warped = warp.apply(moving)
    moves = varying_dofs([moving, reference])
    shown = np.stack([warp.source_time.round(_SAME_TIME), np.arange(len(reference))], axis=1)
    return AlignmentScores(
        correlation=mean_correlation(warped, reference, moves) if moves.any() else None,
        distance=mean_distance(warped, reference),
        from_dtw=path_deviation(warp.source_time, plain.source_time) / rate,
        longest_still=longest_stay(shown) / rate,
        longest_leap=float(np.diff(warp.source_time).max(initial=0.0)) / rate,
        roughness=roughness(warped) if len(reference) >= _LEAST_ROUGH else None,
    )
