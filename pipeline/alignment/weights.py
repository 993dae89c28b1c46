"""Weights of DOFs: given, or 1 each."""

from __future__ import annotations

import numpy as np

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
