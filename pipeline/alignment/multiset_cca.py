"""Multi-set canonical correlation analysis: several sequences of other dimension in one space [GTW 4.4].

Sequences X_i (l, d_i), step by step in time with each other, are projected to the d dimensions in which they
agree best (eq. 8):

    greatest tr(V^T C V) where V^T D V = I,    C = [X_i^T X_j] for i != j, 0 for i = j,
                                               D = diag((1 - lambda) X_i^T X_i + lambda I)

a generalised eigenproblem, C V = D V Lambda. At lambda = 0 its eigenvalues lie between -1 and m - 1 for m
sequences; for two they are the canonical correlations. Eq. 7 put into eq. 2 would leave the sequences' own
products in C; at lambda = 0 they add the same to any V, else C as it is printed, without them, is what counts
here. Three things that the paper leaves open:

- every sequence is centred first; eq. 2 compares them as they are, which would make a common offset the
  first thing that they agree in;
- before lambda is added, every sequence is scaled so that its dimensions' sums of squares are 1 in the mean,
  so that lambda means the same in metres and in radians; its rival, lambda on the sums as they come, means
  less the longer a sequence is. Projections apply to the sequences as they were given;
- directions in which a sequence does not vary (constant or collinear dimensions) are left out of it: D need
  not be invertible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from motionary.pipeline.alignment.warp import checked_sequences
from motionary.pipeline.motion import FloatArray

_NO_VARIANCE = 1e-10  # of a direction's share of its sequence's greatest singular value


@dataclass(frozen=True, eq=False)
class Embedding:
    """Where sequences agree.

    Parameters
    ----------
    projections : tuple of array (d_i, d)
        V_i: ``(X_i - mean_i) @ V_i`` is sequence i in the common space.
    means : tuple of array (d_i,)
        What was taken from each sequence first.
    correlations : array (d,)
        The eigenvalues that are kept, falling.
    spectrum : array (directions,)
        All eigenvalues, falling; as many as the sequences have directions in which they vary.
    """

    projections: tuple[FloatArray, ...]
    means: tuple[FloatArray, ...]
    correlations: FloatArray
    spectrum: FloatArray

    @property
    def trace(self) -> float:
        """Eq. 8's trace, tr(V^T C V)."""
        return float(self.correlations.sum())

    def project(self, sequences: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        """Return sequences, each (any frames, d_i), in the common space: (those frames, d)."""
        return tuple(
            (np.asarray(values) - mean) @ projection
            for values, mean, projection in zip(sequences, self.means, self.projections, strict=True)
        )


def multiset_cca(
    sequences: Sequence[FloatArray], regularisation: float = 0.0, kept: float = 0.9
) -> Embedding:
    """Project sequences that run step by step together to where they agree best [GTW eq. 8].

    Parameters
    ----------
    sequences : sequence of array (l, d_i)
        At least two, of one number of steps.
    regularisation : float
        lambda, from 0 (correlation) to 1 (covariance: partial least squares). Where the dimensions together
        come near the number of steps, 0 finds agreement in anything.
    kept : float
        Share of the total correlation, the sum of the positive eigenvalues, that d dimensions hold: the
        fewest that do.

    Returns
    -------
    Embedding
        Of each direction the largest entry over all V_i is positive.

    Raises
    ------
    ValueError
        There are fewer than two sequences, they have other numbers of steps, one does not vary or holds a
        value that is not finite, or a setting lies outside its range.
    """
    _check_settings(regularisation, kept)
    arrays = checked_steps(sequences)
    means = tuple(values.mean(axis=0) for values in arrays)
    whitened = [_whitened(_centred(values), regularisation, place) for place, values in enumerate(arrays)]
    ends = np.cumsum([0, *(scores.shape[1] for _, scores in whitened)])
    joined = np.concatenate([scores for _, scores in whitened], axis=1)
    common = joined.T @ joined
    for first, last in zip(ends[:-1], ends[1:], strict=True):
        common[first:last, first:last] = 0
    values, vectors = np.linalg.eigh(common)
    values, vectors = values[::-1], vectors[:, ::-1]
    vectors = vectors[:, : _dimensions(values, kept)]
    projections = _positive(
        [map_ @ vectors[a:b] for (map_, _), a, b in zip(whitened, ends[:-1], ends[1:], strict=True)]
    )
    return Embedding(projections, means, values[: vectors.shape[1]].copy(), values.copy())


def embedding_trace(
    sequences: Sequence[FloatArray], projections: Sequence[FloatArray], regularisation: float = 0.0
) -> float:
    """Return eq. 8's trace for projections that were made for other steps.

    They are first brought to V^T D V = I within the space they span: tr((V^T D V)^+ V^T C V).

    Parameters
    ----------
    sequences : sequence of array (l, d_i)
        As for `multiset_cca`.
    projections : sequence of array (d_i, d)
        V_i.
    regularisation : float
        lambda.

    Returns
    -------
    float
        At most the sum of the d greatest eigenvalues that `multiset_cca` finds on these sequences.
    """
    size = projections[0].shape[1]
    agreement: FloatArray = np.zeros((size, size))
    constraint: FloatArray = np.zeros((size, size))
    together: FloatArray = np.zeros((len(sequences[0]), size))
    for values, projection in zip(checked_steps(sequences), projections, strict=True):
        centred = _centred(values)
        scale = _scale(centred)
        embedded = centred @ projection
        own = embedded.T @ embedded
        constraint = (
            constraint + (1 - regularisation) * own + regularisation * scale**2 * (projection.T @ projection)
        )
        agreement = agreement - own
        together = together + embedded
    agreement = agreement + together.T @ together
    return float(np.trace(np.linalg.pinv(constraint, rcond=_NO_VARIANCE, hermitian=True) @ agreement))


def checked_steps(sequences: Sequence[FloatArray]) -> list[FloatArray]:
    """Return sequences as float64 arrays (l, d_i), after checking that they run together.

    Raises
    ------
    ValueError
        As `multiset_cca`.
    """
    arrays = checked_sequences(sequences)
    for place, values in enumerate(arrays):
        if len(values) != len(arrays[0]):
            raise ValueError(
                f"sequence {place} has {len(values)} steps and sequence 0 {len(arrays[0])}; warp them first"
            )
    return arrays


def _check_settings(regularisation: float, kept: float) -> None:
    if not 0 <= regularisation <= 1:
        raise ValueError(f"regularisation is {regularisation}; it must lie between 0 and 1")
    if not 0 < kept <= 1:
        raise ValueError(f"kept is {kept}; it must be above 0 and at most 1")


def _centred(values: FloatArray) -> FloatArray:
    """Return values less their means; exactly 0 where they are constant, which a mean may round off."""
    return np.where(np.ptp(values, axis=0) == 0, 0.0, values - values.mean(axis=0))


def _scale(centred: FloatArray) -> float:
    """Return the root of the mean over dimensions of the sums of squares; 1 where nothing varies."""
    return float(np.sqrt((centred**2).sum() / centred.shape[1])) or 1.0


def _whitened(centred: FloatArray, regularisation: float, place: int) -> tuple[FloatArray, FloatArray]:
    """Return B (d_i, r) with B^T D_i B = I over the directions that vary, and ``centred @ B`` (l, r)."""
    scale = _scale(centred)
    scaled = centred / scale
    if regularisation and len(scaled) > scaled.shape[1]:
        # Squares lose what is small beside the greatest, and lambda outweighs it; long sequences gain by it.
        squares, axes = np.linalg.eigh(scaled.T @ scaled)
        singular = np.sqrt(np.maximum(squares, 0))
        scores = scaled @ axes
    else:
        left, singular, right = np.linalg.svd(scaled, full_matrices=False)
        axes, scores = right.T, left * singular
    varies = singular > _NO_VARIANCE * max(singular.max(), 1.0)
    if not varies.any():
        raise ValueError(
            f"sequence {place} does not vary over its {len(centred)} steps; nothing correlates with it"
        )
    weight = 1 / np.sqrt((1 - regularisation) * singular[varies] ** 2 + regularisation)
    return axes[:, varies] * (weight / scale), scores[:, varies] * weight


def _dimensions(falling: FloatArray, kept: float) -> int:
    """Return the fewest dimensions that hold a share of the sum of the positive eigenvalues, at least one."""
    positive = np.maximum(falling, 0)
    return 1 + int(np.count_nonzero(np.cumsum(positive)[:-1] < kept * positive.sum() * (1 - 1e-12)))


def _positive(projections: list[FloatArray]) -> tuple[FloatArray, ...]:
    """Turn every direction so that its largest entry is positive."""
    stacked = np.concatenate(projections)
    largest = np.abs(stacked).argmax(axis=0)
    signs = np.where(stacked[largest, np.arange(stacked.shape[1])] < 0, -1.0, 1.0)
    return tuple(one * signs for one in projections)
