"""The time step of generalized time warping: warps of several sequences at fixed embeddings [GTW 4.3].

Sequence i, already in the space that all share, is shown along p_i = Q_i a_i. Eq. 3 is what is made small:

    J(a) = sum over pairs i < j of |Z_i(Q_i a_i) - Z_j(Q_j a_j)|^2 + eta sum over i of |F Q_i a_i|^2

(eq. 3 sums over ordered pairs, halved), with F the differences of neighbouring steps: the paper calls its
penalty one of curvature, but prints first differences. It is linearised in a (eq. 4), Z_i(p + dp) ~ Z_i(p) +
Z_i'(p) dp, which leaves the quadratic programme of eq. 6 under L a <= b; its solution is a direction, and the
first of 1, 1/2, 1/4, ... of it that lowers J is taken. So J never rises.

The paper's W replicates frames, 0 or 1; J would then have no slope. Here Z_i(p) is interpolated linearly
between frames, Z_i' is its slope, and the mean of the slopes on either side of a frame at the frame itself.
The rival, rounding p to frames with slopes from central differences, has a direction that need not lead down.
Weights are scaled by n_i (the paper's R) before the programme is solved. A programme that is not solved ends
the step where it stands, and `TimeStep.ended` says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

import numpy as np

from motionary.pipeline.alignment.bases import Basis
from motionary.pipeline.alignment.quadratic_programme import UnsolvedError, solve_programme
from motionary.pipeline.alignment.warp import Warp, checked_sequences, interpolate
from motionary.pipeline.alignment.warp_weights import (
    LEAST_SHARE,
    Ends,
    WeightLimits,
    ends_of_each,
    joined_limits,
    nearest_weights,
    weight_limits,
)
from motionary.pipeline.motion import FloatArray

ITERATIONS = 50
_HALVINGS = 12
_TOLERANCE = 1e-6  # of J: less than this share won, and the step has converged


@dataclass(frozen=True, eq=False)
class TimeStep:
    """Warps at fixed embeddings.

    Parameters
    ----------
    weights : tuple of array (k_i,)
        a_i.
    warps : tuple of Warp
        One a sequence, all of l steps.
    errors : array (iterations + 1,)
        J of eq. 3 at the start and after each iteration; it never rises.
    ended : str
        Why there is no further iteration: "converged", "no descent", "iterations", or what the solver said.
    """

    weights: tuple[FloatArray, ...]
    warps: tuple[Warp, ...]
    errors: FloatArray
    ended: str


def time_step(
    sequences: Sequence[FloatArray],
    bases: Sequence[Basis],
    weights: Sequence[FloatArray] | None = None,
    smoothness: float = 0.0,
    ends: Ends | Sequence[Ends] = "fixed",
    least_share: float = LEAST_SHARE,
    iterations: int = ITERATIONS,
) -> TimeStep:
    """Warp sequences of one dimension towards each other by Gauss-Newton [GTW eq. 3 to 6].

    Parameters
    ----------
    sequences : sequence of array (n_i, d)
        At least two, of two frames or more, embedded in one space (or of one kind from the start).
    bases : sequence of Basis
        One a sequence, made for its length by `monotone_basis`, all with l steps.
    weights : sequence of array (k_i,), optional
        Where to begin; by default as near to uniform warps as the bases come.
    smoothness : float
        eta, of squared frames a step.
    ends : {"fixed", "relaxed"} or sequence of them
        Whether first and last frames are shown first and last, or a part of the sequence may be shown.
    least_share : float
        Share of its sequence that a warp of relaxed ends covers at least; see `warp_weights`.
    iterations : int
        At most so many.

    Returns
    -------
    TimeStep

    Raises
    ------
    ValueError
        Sequences and bases do not fit each other, a value is not finite, or a setting lies outside its range.
    """
    arrays = _checked(sequences, bases)
    if not (np.isfinite(smoothness) and smoothness >= 0):
        raise ValueError(f"smoothness is {smoothness}; it must be finite and not negative")
    limits = [
        weight_limits(basis, own, least_share)
        for basis, own in zip(bases, ends_of_each(ends, len(bases)), strict=True)
    ]
    if weights is None:
        weights = [uniform_weights(basis, one) for basis, one in zip(bases, limits, strict=True)]
    step = _GaussNewton(arrays, bases, joined_limits(limits), smoothness)
    at = step.at(np.concatenate(weights))
    errors, ended = [at.error], "iterations"
    for _ in range(iterations):
        try:
            direction = step.direction(at)
        except UnsolvedError as problem:
            ended = str(problem)
            break
        found = step.descent(at, direction)
        if found is None:
            ended = "no descent"
            break
        at = found
        errors.append(at.error)
        if errors[-2] - at.error <= _TOLERANCE * errors[-2]:
            ended = "converged"
            break
    warps = [Warp(path, basis.frames) for basis, path in zip(bases, at.paths, strict=True)]
    return TimeStep(tuple(step.split(at.weights)), tuple(warps), np.array(errors), ended)


def warp_steps(frames: Sequence[int]) -> int:
    """Return l, the steps of warps of sequences of so many frames: 1.1 times the longest [GTW 4.3]."""
    return ceil(1.1 * max(frames))


def uniform_weights(basis: Basis, limits: WeightLimits) -> FloatArray:
    """Return the weights (k,) that come nearest to showing the sequence evenly from first to last frame."""
    return nearest_weights(basis, np.linspace(0, basis.frames - 1, len(basis.values)), limits)


@dataclass(frozen=True, eq=False)
class _Place:
    """Weights of all sequences one after the other, their paths, what these show (m, l, d), and J there."""

    weights: FloatArray
    paths: list[FloatArray]
    shown: FloatArray
    error: float


class _GaussNewton:
    """Eq. 3, its linearisation and the line search, on the weights of all sequences one after the other."""

    def __init__(
        self, sequences: list[FloatArray], bases: Sequence[Basis], limits: WeightLimits, smoothness: float
    ) -> None:
        self._sequences, self._bases, self._limits = sequences, bases, limits
        self._slopes = [np.diff(values, axis=0) for values in sequences]
        self._ends = np.cumsum([0, *(basis.values.shape[1] for basis in bases)])
        self._scale = np.repeat([float(basis.frames) for basis in bases], np.diff(self._ends))  # R
        rises = [np.diff(basis.values, axis=0) for basis in bases]
        self._smoothness = smoothness
        self._penalty = [smoothness * one.T @ one for one in rises]

    def split(self, weights: FloatArray) -> list[FloatArray]:
        return [weights[first:last] for first, last in pairwise(self._ends)]

    def at(self, weights: FloatArray) -> _Place:
        """Return what weights lead to."""
        each = self.split(weights)
        paths = [basis.path(own) for basis, own in zip(self._bases, each, strict=True)]
        shown = np.stack(
            [interpolate(values, path) for values, path in zip(self._sequences, paths, strict=True)]
        )
        apart = shown - shown.mean(axis=0)
        smooth = sum(own @ penalty @ own for own, penalty in zip(each, self._penalty, strict=True))
        return _Place(weights, paths, shown, float(len(shown) * (apart**2).sum() + smooth))

    def programme(self, at: _Place) -> tuple[FloatArray, FloatArray]:
        """Return H and f of eq. 6: half of J's second and first derivatives where Z' is constant.

        Written with the l values of Z_i' . Z_j' rather than the d l rows of G, so linear in l d.
        """
        slopes = [self._slope(place, path) for place, path in enumerate(at.paths)]
        sequences = len(slopes)
        apart = sequences * (at.shown - at.shown.mean(axis=0))
        hessian = np.empty((self._ends[-1], self._ends[-1]))
        slope = np.empty(self._ends[-1])
        own = self.split(at.weights)
        for i, basis in enumerate(self._bases):
            rows = slice(self._ends[i], self._ends[i + 1])
            slope[rows] = basis.values.T @ _dots(slopes[i], apart[i]) + self._penalty[i] @ own[i]
            for j, other in enumerate(self._bases[: i + 1]):
                columns = slice(self._ends[j], self._ends[j + 1])
                both = _dots(slopes[i], slopes[j]) * (sequences - 1 if i == j else -1)
                block = basis.values.T @ (both[:, None] * other.values)
                hessian[rows, columns] = block + self._penalty[i] if i == j else block
                hessian[columns, rows] = hessian[rows, columns].T
        return hessian, slope

    def direction(self, at: _Place) -> FloatArray:
        """Return the weights' change that solves eq. 6."""
        hessian, slope = self.programme(at)
        limits, scale = self._limits, self._scale
        return (
            solve_programme(
                hessian / np.outer(scale, scale),
                slope / scale,
                limits.rows / scale,
                np.maximum(limits.bounds - limits.rows @ at.weights, 0),  # rounding apart it is
                limits.equal / scale,
                limits.exact - limits.equal @ at.weights,
            )
            / scale
        )

    def descent(self, at: _Place, direction: FloatArray) -> _Place | None:
        """Return the first place along a direction, of 1, 1/2, 1/4, ... of it, where J is less."""
        for halvings in range(_HALVINGS + 1):
            ahead = self.at(at.weights + direction * 0.5**halvings)
            if ahead.error < at.error:
                return ahead
        return None

    def _slope(self, place: int, path: FloatArray) -> FloatArray:
        """Return Z' along a path, (l, d): of the piece, or the mean of both pieces that meet at a frame."""
        slopes = self._slopes[place]
        after = slopes[np.minimum(path.astype(np.intp), len(slopes) - 1)]
        before = slopes[np.maximum(np.ceil(path).astype(np.intp) - 1, 0)]
        return (after + before) / 2


def _dots(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the products of vectors (l, d) step by step, (l,)."""
    products: FloatArray = np.einsum("ld,ld->l", one, other)
    return products


def _checked(sequences: Sequence[FloatArray], bases: Sequence[Basis]) -> list[FloatArray]:
    """Return the sequences as float64 arrays, after checking that they fit each other and their bases."""
    arrays = checked_sequences(sequences)
    if len(arrays) != len(bases):
        raise ValueError(f"there are {len(arrays)} sequences and {len(bases)} bases; it takes a basis each")
    for place, (values, basis) in enumerate(zip(arrays, bases, strict=True)):
        if len(values) < 2:
            raise ValueError(f"sequence {place} has one frame; a warp needs two to run through")
        if len(values) != basis.frames or len(basis.values) != len(bases[0].values):
            raise ValueError(
                f"sequence {place} has {len(values)} frames, its basis is for {basis.frames} "
                f"and {len(basis.values)} steps; basis 0 has {len(bases[0].values)} steps"
            )
        if values.shape[1] != arrays[0].shape[1]:
            raise ValueError(
                f"sequence {place} has {values.shape[1]} dimensions and sequence 0 {arrays[0].shape[1]}; "
                "embed them in one space first"
            )
    return arrays
