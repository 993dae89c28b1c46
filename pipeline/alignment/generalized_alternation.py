"""Generalized time warping's two steps in turn, at one rate of the sequences [GTW 4.3, 4.4].

The embedding step finds, at fixed warps, the projections of greatest trace (eq. 8); the time step, at fixed
projections, warps of less distance (eq. 3). The paper holds that the two together descend. They need not: the
constraint on the projections holds the warped sequences, so that what eq. 3 is measured in changes with the
warps. Each is held to its own aim in `Round`, and of all rounds the one of greatest trace is returned.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from motionary.pipeline.alignment.bases import Basis, monotone_basis
from motionary.pipeline.alignment.generalized_time import time_step, uniform_weights
from motionary.pipeline.alignment.multiset_cca import Embedding, embedding_trace, multiset_cca
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.warp_weights import (
    Ends,
    WeightLimits,
    ends_of_each,
    nearest_weights,
    weight_limits,
)
from motionary.pipeline.motion import FloatArray

_ITERATIONS = 10  # of Gauss-Newton before the embedding is looked at again
# At rest: where the paths move by less, frames in the mean, or the trace by a smaller share.
_STILL, _NO_GAIN = 0.01, 1e-6


@dataclass(frozen=True, eq=False)
class Round:
    """A time step and the embedding step after it.

    Parameters
    ----------
    errors : array (iterations + 1,)
        Eq. 3 over the time step; never rising.
    ended : str
        Why the time step ended; see `TimeStep`.
    trace_before, trace : float
        Eq. 8's trace at the new warps: of the projections that the time step worked with, and of as many
        that the embedding step found. The second is never less.
    """

    errors: FloatArray
    ended: str
    trace_before: float
    trace: float


@dataclass(frozen=True, eq=False)
class GeneralizedWarping:
    """Sequences brought together.

    Parameters
    ----------
    warps : tuple of Warp
        One a sequence, all of the same l steps; `in_time_of` brings them to the frames of one sequence.
    embedding : Embedding
        The projections at these warps.
    weights : tuple of array (k_i,)
        a_i.
    correlation : float
        How well the projected sequences agree, from -1 / (m - 1) to 1, which is everywhere; of two sequences
        the mean of their correlations by direction.
    rounds : tuple of Round
        All turns of the alternation that led here; those of a coarse start are not among them.
    """

    warps: tuple[Warp, ...]
    embedding: Embedding
    weights: tuple[FloatArray, ...]
    correlation: float
    rounds: tuple[Round, ...]

    @property
    def paths(self) -> FloatArray:
        """The frame of each sequence that is shown at each step, (l, m)."""
        return np.stack([warp.source_time for warp in self.warps], axis=1)


@dataclass(frozen=True)
class Alternation:
    """Both steps with their settings; what they mean is said at `generalized_time_warping`."""

    bases: Mapping[str, int]
    smoothness: float
    regularisation: float
    kept: float
    ends: Ends | Sequence[Ends]
    least_share: float
    rounds: int

    def __call__(
        self, sequences: Sequence[FloatArray], steps: int, weights: Sequence[FloatArray] | None = None
    ) -> GeneralizedWarping:
        """Take turns from weights, or from uniform warps, until the paths come to rest; return the best."""
        bases = self.bases_of(sequences, steps)
        if weights is None:
            weights = [uniform_weights(*one) for one in zip(bases, self._limits(bases), strict=True)]
        paths = [basis.path(own) for basis, own in zip(bases, weights, strict=True)]
        warps: Sequence[Warp] = [
            Warp(path, len(values)) for path, values in zip(paths, sequences, strict=True)
        ]
        embedding = self._embedding(_warped(warps, sequences))
        rounds, reached, trace = [], [], embedding.trace
        for _ in range(self.rounds):
            step = time_step(
                embedding.project(sequences), bases, weights, self.smoothness, self.ends, self.least_share,
                _ITERATIONS,
            )  # fmt: skip
            warped = _warped(step.warps, sequences)
            before = embedding_trace(warped, embedding.projections, self.regularisation)
            dimensions = len(embedding.correlations)
            embedding = self._embedding(warped)
            after = float(embedding.spectrum[:dimensions].sum())
            rounds.append(Round(step.errors, step.ended, before, after))
            reached.append((step, embedding))
            moved = _moved(warps, step.warps)
            warps, weights = step.warps, step.weights
            if moved < _STILL or abs(embedding.trace - trace) < _NO_GAIN * abs(trace):
                break
            trace = embedding.trace
        step, embedding = reached[greatest_trace([one for _, one in reached])]
        together = embedding_trace(_warped(step.warps, sequences), embedding.projections)
        correlation = together / (len(embedding.correlations) * (len(sequences) - 1))
        return GeneralizedWarping(step.warps, embedding, step.weights, correlation, tuple(rounds))

    def bases_of(self, sequences: Sequence[FloatArray], steps: int) -> list[Basis]:
        """Return the basis of every sequence."""
        return [monotone_basis(self.bases, len(values), steps) for values in sequences]

    def weights_near(
        self, sequences: Sequence[FloatArray], steps: int, paths: Sequence[FloatArray]
    ) -> list[FloatArray]:
        """Return the weights that come nearest to a path (l,) for every sequence."""
        if len(paths) != len(sequences):
            raise ValueError(f"start has {len(paths)} paths; there are {len(sequences)} sequences")
        bases = self.bases_of(sequences, steps)
        return [nearest_weights(*one) for one in zip(bases, paths, self._limits(bases), strict=True)]

    def _limits(self, bases: Sequence[Basis]) -> list[WeightLimits]:
        each = zip(bases, ends_of_each(self.ends, len(bases)), strict=True)
        return [weight_limits(basis, ends, self.least_share) for basis, ends in each]

    def _embedding(self, warped: Sequence[FloatArray]) -> Embedding:
        return multiset_cca(warped, self.regularisation, self.kept)


def greatest_trace(embeddings: Sequence[Embedding]) -> int:
    """Return the place of the greatest trace, over as many dimensions as all embeddings have kept."""
    dimensions = min(len(one.correlations) for one in embeddings)
    return int(np.argmax([one.spectrum[:dimensions].sum() for one in embeddings]))


def _warped(warps: Sequence[Warp], sequences: Sequence[FloatArray]) -> list[FloatArray]:
    return [warp.apply(values) for warp, values in zip(warps, sequences, strict=True)]


def _moved(before: Sequence[Warp], after: Sequence[Warp]) -> float:
    """Return the mean change of the paths, in frames."""
    pairs = zip(before, after, strict=True)
    return float(np.mean([np.abs(new.source_time - old.source_time).mean() for old, new in pairs]))
