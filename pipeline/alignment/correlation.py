"""How well two sequences of one length agree in shape: the mean Pearson correlation [CoTW 3.2]."""

from __future__ import annotations

import numpy as np

from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray


def mean_correlation(values: FloatArray, reference: FloatArray, weights: FloatArray | None = None) -> float:
    """Average over the DOFs the Pearson correlation of the whole sequences [CoTW eq. 3, 5].

    Parameters
    ----------
    values, reference : array (frames, dofs)
        Sequences of one length.
    weights : array (dofs,), optional
        Not negative; 1 each by default.

    Returns
    -------
    float
        Weighted mean, divided by the sum of the weights. A DOF without variance in either counts 0.

    Raises
    ------
    ValueError
        Shapes disagree, or all weights are 0.
    """
    values, reference = np.asarray(values), np.asarray(reference)
    if values.shape != reference.shape or values.ndim != 2:
        raise ValueError(
            f"values have shape {values.shape} and reference {reference.shape}; (frames, dofs) both"
        )
    weights = checked_weights(weights, values.shape[1])
    if not weights.any():
        raise ValueError("all weights are 0; the mean correlation needs one that is not")
    centred, norms = zip(*(_centred(sequence) for sequence in (values, reference)), strict=True)
    moves = (norms[0] > 0) & (norms[1] > 0)
    products = (centred[0] * centred[1]).sum(axis=0)
    correlation = np.divide(products, norms[0] * norms[1], out=np.zeros(len(weights)), where=moves)
    return float((weights * correlation).sum() / weights.sum())


def _centred(sequence: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Subtract the means; the norm of a DOF that only rounds is 0."""
    wide = sequence.astype(np.float64)
    centred = wide - wide.mean(axis=0)
    norms = np.linalg.norm(centred, axis=0)
    return centred, np.where(norms > rounding_level(sequence) * np.sqrt(len(sequence)), norms, 0.0)
