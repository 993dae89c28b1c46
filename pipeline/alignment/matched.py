"""Two sequences as correlation-optimized time warping reads them: of one length, weighted DOFs only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import checked_pair, interpolate
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray

PLACES = 4
"""Output places that the kernels take together; so the target is followed by as many frames less one."""


@dataclass(frozen=True, eq=False)
class MatchedPair:
    """A moving sequence brought to its reference's length [CoTW 3.1].

    Parameters
    ----------
    source : array (m, dofs) float64
        The moving sequence, length-matched; centred.
    target : array (m + PLACES - 1, dofs) float64
        The reference, centred, followed by zeros that kernels may read.
    weights : array (dofs,)
        Of the DOFs that are left, all above 0.
    total_weight : float
        Their sum.
    source_floor, target_floor : array (dofs,)
        Mean squares up to which a DOF counts as constant.
    frames, moving_frames : int
        m, and the frames of the moving sequence.
    """

    source: FloatArray
    target: FloatArray
    weights: FloatArray
    total_weight: float
    source_floor: FloatArray
    target_floor: FloatArray
    frames: int
    moving_frames: int

    @cached_property
    def source_varies(self) -> NDArray[np.bool_]:
        """Which DOFs of the moving sequence are not constant (dofs,)."""
        return (self.source**2).mean(axis=0) > self.source_floor

    @cached_property
    def target_varies(self) -> NDArray[np.bool_]:
        """Which DOFs of the reference are not constant (dofs,)."""
        return (self.target[: self.frames] ** 2).mean(axis=0) > self.target_floor

    def at_length(self, frames: int) -> MatchedPair:
        """Return the same pair at another number of frames, both sequences sampled evenly."""
        times = uniform_times(self.frames, frames)
        source, target = (interpolate(one, times) for one in (self.source, self.target[: self.frames]))
        return replace(self, source=source, target=_with_room(target), frames=frames)


def matched_pair(moving: FloatArray, reference: FloatArray, weights: FloatArray | None) -> MatchedPair:
    """Check two sequences and length-match the first to the second.

    Raises
    ------
    ValueError
        Shapes disagree, or a value or a weight is not finite or a weight negative.
    """
    moving, reference = checked_pair(moving, reference)
    weights = checked_weights(weights, reference.shape[1])
    kept = np.flatnonzero(weights)
    matched = interpolate(moving[:, kept].astype(np.float64), uniform_times(len(moving), len(reference)))
    target = reference[:, kept].astype(np.float64)
    return MatchedPair(
        source=matched - matched.mean(axis=0),
        target=_with_room(target - target.mean(axis=0)),
        weights=weights[kept],
        total_weight=float(weights.sum()),
        source_floor=rounding_level(moving)[kept] ** 2,
        target_floor=rounding_level(reference)[kept] ** 2,
        frames=len(reference),
        moving_frames=len(moving),
    )


def _with_room(target: FloatArray) -> FloatArray:
    return np.concatenate([target, np.zeros((PLACES - 1, target.shape[1]))])
