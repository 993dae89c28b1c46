"""Weights of DOFs: given, 1 each, or 1 of those that move; and two sequences whose distances they weigh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionary.pipeline.alignment.warp import at_a_clear_size, checked_pair
from motionary.pipeline.motion import FloatArray


def checked_weights(weights: FloatArray | None, dofs: int) -> FloatArray:
    """Return weights by DOF as float64 (dofs,), 1 each where none are given.

    Raises
    ------
    ValueError
        There are not `dofs` of them, or one is negative or not finite.
    """
    if weights is None:
        return np.ones(dofs)
    array = np.asarray(weights, dtype=np.float64)
    if array.shape != (dofs,):
        raise ValueError(
            f"weights have shape {array.shape}; the sequences have {dofs} DOFs, so it must be ({dofs},)"
        )
    wrong = np.flatnonzero(~(np.isfinite(array) & (array >= 0)))
    if wrong.size:
        raise ValueError(
            f"DOF {wrong[0]} has weight {array[wrong[0]]}; weights must be finite and not negative"
        )
    return array


def varying_dofs(sequences: Sequence[FloatArray]) -> FloatArray:
    """Weigh DOFs (dofs,): 0 where no sequence moves, as the pelvis does not over its origin, else 1."""
    return np.any([np.ptp(values, axis=0) > 0 for values in sequences], axis=0).astype(np.float64)


def weighted_pair(
    moving: FloatArray, reference: FloatArray, weights: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return two sequences such that the distances of their frames are weighted ones, after checking them.

    Parameters
    ----------
    moving : array (n, dofs)
    reference : array (m, dofs)
    weights : array (dofs,), optional
        Of the squared differences, not negative; 1 each by default.

    Returns
    -------
    moving, reference : array (n, dofs) and (m, dofs)
        Each DOF times the root of its weight, and both `at_a_clear_size`: distances are roots of sums of
        squares, which are 0 of what is below 1e-162. In the dtypes given where there are no weights.

    Raises
    ------
    ValueError
        As `motionary.pipeline.alignment.warp.checked_pair` and `checked_weights`.
    """
    moving, reference = checked_pair(moving, reference)
    if weights is not None:
        scale = np.sqrt(checked_weights(weights, reference.shape[1]))
        moving, reference = moving * scale, reference * scale
    (moving, reference), _ = at_a_clear_size(moving, reference)
    return moving, reference
