"""Which of several sequences the others are aligned to [CoTW 5].

The similarity index (eq. 9) of sequence r is p times the sum over DOFs i of w_i times the product, over all
other sequences j, of |rho(D_i,r , D_i,j)|. A product of hundreds of numbers under 1 leaves the range of
floats, so it is computed as a logarithm, with p = 1:

    log P_r = logsumexp over i of ( log w_i + sum over j != r of log |rho_i(r, j)| )

A DOF that is constant in a sequence has no correlation with any other; |rho| is then 0, as in `cotw`, and so
is its product for every r. A DOF thus counts only where all sequences move. If none counts, every index is
-inf and the medoid is taken instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import checked_sequence, checked_stack, interpolate
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray

_BLOCK = 512  # clips whose correlations with all others are held at a time,
_BLOCK_VALUES = 2**22  # fewer where they are more than 32 MB
_TIE = 1e-9


@dataclass(frozen=True, eq=False)
class ReferenceScores:
    """The sequence that the others are aligned to, and how similar each is to all others.

    Parameters
    ----------
    index : int
        The place of the chosen sequence.
    similarity : array (N,)
        `similarity_index` of the length-matched sequences.
    """

    index: int
    similarity: FloatArray


def similarity_index(clips: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """Compute how similar each clip is to all others: the natural logarithm of eq. 9 with p = 1.

    Parameters
    ----------
    clips : array (N, frames, dofs)
        Length-matched sequences.
    weights : array (dofs,), optional
        Not negative; 1 each by default.

    Returns
    -------
    array (N,) float64
        -inf where every weighted DOF has a correlation of 0. A single clip has the weights' sum, eq. 9's
        empty product being 1.

    Raises
    ------
    ValueError
        Shapes disagree or a value is not finite.
    """
    clips = checked_stack(clips)
    weights = checked_weights(weights, clips.shape[2])
    levels = np.array([rounding_level(clip) for clip in clips])
    total = np.full(len(clips), -np.inf)
    for dof in np.flatnonzero(weights):
        product = _log_products(clips[:, :, dof].astype(np.float64), levels[:, dof])
        total = np.logaddexp(total, np.log(weights[dof]) + product)
    return total


def select_reference(
    sequences: Sequence[FloatArray],
    weights: FloatArray | None = None,
    distances: FloatArray | None = None,
) -> int:
    """Choose the sequence that all others are aligned to; see `score_references`.

    Returns
    -------
    int
        Its place in `sequences`.
    """
    return score_references(sequences, weights, distances).index


def score_references(
    sequences: Sequence[FloatArray],
    weights: FloatArray | None = None,
    distances: FloatArray | None = None,
) -> ReferenceScores:
    """Choose the sequence that all others are aligned to, and keep every sequence's similarity index.

    Parameters
    ----------
    sequences : sequence of N arrays (frames, dofs)
        Of any lengths; for the index they are length-matched linearly to the median length (rounded, halves
        to even).
    weights : array (dofs,), optional
        Not negative; 1 each by default.
    distances : array (N, N), optional
        Where every index is -inf the medoid is chosen, the sequence of the least sum of these distances. Left
        out, the distance is the Euclidean one of the length-matched sequences, squares weighted.

    Returns
    -------
    ReferenceScores
        Ties go to the lowest place. Indices within 1e-9 (relative) are ties, so that two sequences, which
        are always equally similar to each other, give 0 whatever the rounding.

    Raises
    ------
    ValueError
        There is no sequence, shapes disagree, or a value is not finite.
    """
    arrays = [checked_sequence(values, f"sequence {i}") for i, values in enumerate(sequences)]
    if not arrays:
        raise ValueError("there is no sequence to select a reference from")
    for i, array in enumerate(arrays):
        if array.shape[1] != arrays[0].shape[1]:
            raise ValueError(
                f"sequence {i} has {array.shape[1]} DOFs and sequence 0 {arrays[0].shape[1]}; "
                "they must have the same"
            )
    weights = checked_weights(weights, arrays[0].shape[1])
    distances = _checked_distances(distances, len(arrays))
    frames = median_length([len(array) for array in arrays])
    matched = np.stack([length_matched(array, frames) for array in arrays])
    similarity = similarity_index(matched, weights)
    if np.isfinite(similarity).any():
        return ReferenceScores(first_of_least(-similarity), similarity)
    sums = distances.sum(axis=1) if distances is not None else _distance_sums(matched, weights)
    return ReferenceScores(first_of_least(sums), similarity)


def median_length(lengths: Sequence[int]) -> int:
    """Return the length that sequences are brought to: their median, rounded, halves to even."""
    return round(float(np.median(lengths)))


def length_matched(values: FloatArray, frames: int) -> FloatArray:
    """Bring a sequence (n, dofs) to a length, linearly; the dtype stays."""
    return interpolate(values, uniform_times(len(values), frames))


def first_of_least(values: FloatArray) -> int:
    """Return the place of the least value, of those within 1e-9 of it (relative) the first."""
    least = values.min()
    return int(np.argmax(values <= least + _TIE * max(1.0, abs(least))))


def _log_products(values: FloatArray, levels: FloatArray) -> FloatArray:
    """Sum of log |rho| of each row with every other row; -inf where a row is constant."""
    centred = values - values.mean(axis=1, keepdims=True)
    norms = np.linalg.norm(centred, axis=1)
    if len(values) > 1 and not (norms > levels * np.sqrt(values.shape[1])).all():
        return np.full(len(values), -np.inf)
    unit = centred / np.where(norms > 0, norms, 1.0)[:, None]
    sums = np.empty(len(values))
    block = max(1, min(_BLOCK, _BLOCK_VALUES // len(values)))
    for start in range(0, len(values), block):
        rho = unit[start : start + block] @ unit.T
        np.minimum(np.abs(rho, out=rho), 1.0, out=rho)
        rows = np.arange(len(rho))
        rho[rows, start + rows] = 1.0
        with np.errstate(divide="ignore"):
            sums[start : start + block] = np.log(rho, out=rho).sum(axis=1)
    return sums


def _distance_sums(matched: FloatArray, weights: FloatArray) -> FloatArray:
    flat = (matched * np.sqrt(weights)).reshape(len(matched), -1)
    blocks = [cdist(flat[start : start + _BLOCK], flat) for start in range(0, len(flat), _BLOCK)]
    return np.concatenate([block.sum(axis=1) for block in blocks])


def _checked_distances(distances: FloatArray | None, clips: int) -> FloatArray | None:
    if distances is None:
        return None
    array = np.asarray(distances, dtype=np.float64)
    if array.shape != (clips, clips):
        raise ValueError(f"distances have shape {array.shape}; {clips} sequences need ({clips}, {clips})")
    if not np.isfinite(array).all():
        raise ValueError("distances hold a value that is not finite; the medoid needs all of them")
    return array
