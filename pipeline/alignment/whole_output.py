"""What a warp is worth as a whole: correlation of the output less its distortion [CoTW 4, eq. 7-8].

    value = rho - alpha |h|
    rho   = weighted mean over DOFs of Pearson's correlation of the whole output with the reference
    h     = weighted mean over DOFs of (|dD_out| - |dD_in|) / |dD_in|,    dD the differences frame to frame

with |.| the Euclidean norm over time and D_in the length-matched input. Weighted means divide by the sum of
the weights. A DOF without variance in either sequence counts 0 in rho, one without variance in the input
counts 0 in h.

The dynamic programme of Table 1 maximises a sum over segments, which is something else: that sum can rise
while rho falls. So the search asks this function of every warp it finds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.matched import MatchedPair
from motionary.pipeline.alignment.nodes import Segments


class WholeOutput:
    """Correlation and distortion of any warp of one pair.

    Parameters
    ----------
    pair : MatchedPair

    Raises
    ------
    ValueError
        All weights are 0, so that there is no mean.
    """

    def __init__(self, pair: MatchedPair) -> None:
        if not pair.total_weight > 0:
            raise ValueError("all weights are 0; the mean correlation needs one that is not")
        norms = np.linalg.norm(pair.target[: pair.frames], axis=0)
        inverse_target = np.divide(1.0, norms, out=np.zeros_like(norms), where=pair.target_varies)
        slopes = np.where(pair.source_varies, np.linalg.norm(np.diff(pair.source, axis=0), axis=0), 0.0)

        self._arguments = (
            pair.source, pair.target, pair.weights / pair.total_weight, pair.source_floor,
            inverse_target, slopes,
        )  # fmt: skip

    def __call__(self, nodes: NDArray[np.int64], moved: NDArray[np.int64]) -> tuple[float, float]:
        """Return rho and |h| of the output in which the nodes of the length-matched input lie at `moved`.

        Parameters
        ----------
        nodes, moved : array (c + 1,)
        """
        from motionary.pipeline.alignment.whole_output_kernels import correlation_and_distortion

        return correlation_and_distortion(nodes, moved, *self._arguments)

    def climb(self, segments: Segments, moved: NDArray[np.int64], alpha: float, step: int) -> float:
        """Move inner nodes one at a time while that raises rho - alpha |h|; return it.

        Parameters
        ----------
        segments : Segments
            Nodes, and bounds that the moves keep.
        moved : array (c + 1,)
            Within those bounds; changed in place.
        alpha : float
        step : int
            Frames of the first moves; they are halved down to 1.
        """
        from motionary.pipeline.alignment.whole_output_kernels import climb

        return climb(
            segments.nodes, moved, segments.slacks, segments.low, segments.high, alpha, step, *self._arguments
        )
