"""Generalized time warping (GTW): any number of sequences, of any dimension, in one time and space [GTW 4].

Each sequence X_i (n_i, d_i) gets a warp over l common steps, made of monotone functions, and a projection
V_i; `generalized_alternation` finds both in turn. Cost is linear in the length of the sequences, where DTW's
grows with the product of two lengths and is not to be had for more than two.

Two choices are not the paper's:

- First and last frames meet (``ends="fixed"``) unless one asks otherwise. The paper's relaxed ends let a warp
  show a part of its sequence, which finds a motion within a longer one; but eq. 3 is less where less is
  shown, so that with whole sequences they give frames up for nothing. Where a motion is looked for, several
  starts are needed, and the greatest correlation tells which of them reached it.
- Uniform warps (the paper's start) lead to local minima; a coarse-to-fine start is what the paper names
  against them. Sequences are smoothed and thinned to half their frames again and again, while the longest
  keeps `COARSE_FRAMES`; the alternation goes over the shortest first, and the weights that it ends with,
  which have no unit, begin the next. The uniform start is tried too, and the greater trace of eq. 8 wins.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d

from motionary.pipeline.alignment.bases import MORE_BASES, USUAL_BASES
from motionary.pipeline.alignment.composed import in_time_of
from motionary.pipeline.alignment.generalized_alternation import (
    Alternation,
    GeneralizedWarping,
    greatest_trace,
)
from motionary.pipeline.alignment.generalized_time import warp_steps
from motionary.pipeline.alignment.warp import Warp, checked_sequence, checked_sequences, interpolate
from motionary.pipeline.alignment.warp_weights import LEAST_SHARE, Ends
from motionary.pipeline.motion import FloatArray

Start = Literal["coarse", "uniform"] | Sequence[FloatArray]

COARSE_FRAMES = 40
ROUNDS = 40


def generalized_time_warping(
    sequences: Sequence[FloatArray],
    bases: Mapping[str, int] = USUAL_BASES,
    smoothness: float = 0.0,
    regularisation: float = 0.6,
    kept: float = 0.9,
    start: Start = "coarse",
    ends: Ends | Sequence[Ends] = "fixed",
    least_share: float = LEAST_SHARE,
    steps: int | None = None,
    rounds: int = ROUNDS,
) -> GeneralizedWarping:
    """Align sequences of different kinds in time and space [GTW].

    Parameters
    ----------
    sequences : sequence of array (n_i, d_i)
        At least two, of two frames or more.
    bases : mapping of str to int
        How many functions of each family make a warp, as in `monotone_basis`.
    smoothness : float
        eta: price of squared frames a step.
    regularisation, kept : float
        lambda, and the share of correlation that is kept, as in `multiset_cca`. Where sequences have about as
        many dimensions as frames, as takes of motion capture do, a small lambda (the paper's .1) finds
        agreement at any warps, and more functions a warp follow it; with few dimensions a small one sees
        through more noise.
    start : {"coarse", "uniform"} or sequence of array (l,)
        Where to begin: at the better of uniform warps and those of thinned sequences, at uniform warps, or at
        a path of frames for every sequence.
    ends : {"fixed", "relaxed"} or sequence of them
        Whether first and last frames are shown first and last, or a part of the sequence may be shown; for
        all, or one a sequence: a motion is found within a longer sequence where that one alone is relaxed.
    least_share : float
        Share of its sequence that a warp covers at least where ends are relaxed; see `weight_limits`.
    steps : int, optional
        l; by default 1.1 times the frames of the longest sequence.
    rounds : int
        At most so many turns of both steps, at each rate.

    Returns
    -------
    GeneralizedWarping

    Raises
    ------
    ValueError
        There are fewer than two sequences, one has a single frame, does not vary or holds a value that is not
        finite, a start does not fit, or a setting lies outside its range.
    UnsolvedError
        No weights were found near a start.
    """
    arrays = _checked(sequences)
    if rounds < 1:
        raise ValueError(f"rounds is {rounds}; at least 1 is needed")
    steps = warp_steps([len(values) for values in arrays]) if steps is None else steps
    if steps < 2:
        raise ValueError(f"steps is {steps}; a warp needs at least 2")
    alternate = Alternation(bases, smoothness, regularisation, kept, ends, least_share, rounds)
    if not isinstance(start, str):
        return alternate(arrays, steps, alternate.weights_near(arrays, steps, start))
    if start not in ("coarse", "uniform"):
        raise ValueError(f"start is {start!r}; it must be 'coarse', 'uniform' or a path for every sequence")
    results = [alternate(arrays, steps)]
    levels = list(_levels(arrays, steps)) if start == "coarse" else []
    if levels:
        weights = None
        for thinned, thinned_steps in levels:
            weights = alternate(thinned, thinned_steps, weights).weights
        results.append(alternate(arrays, steps, weights))
    return results[greatest_trace([one.embedding for one in results])]


def generalized_pair(moving: FloatArray, reference: FloatArray) -> Warp:
    """Warp one sequence to another by GTW at lambda = 1, of five functions of each family.

    A pose has about as many columns as a short clip has frames, and nearly uniform warps already correlate at
    less. Two clips of one kind come nearer to each other by covariance, on what moves most; several kinds at
    once do not.

    Parameters
    ----------
    moving : array (n, dofs)
    reference : array (m, any dofs)

    Returns
    -------
    Warp
        As `in_time_of` makes it of both sequences' warps.

    Raises
    ------
    ValueError
        As `generalized_time_warping`.
    """
    pair = [checked_sequence(moving, "moving"), checked_sequence(reference, "reference")]
    return in_time_of(generalized_time_warping(pair, MORE_BASES, regularisation=1.0).warps, 1)[0]


def _checked(sequences: Sequence[FloatArray]) -> list[FloatArray]:
    """Return sequences as float64 arrays, after checking that there is something to align."""
    arrays = checked_sequences(sequences)
    for place, values in enumerate(arrays):
        if len(values) < 2:
            raise ValueError(f"sequence {place} has one frame; a warp needs two to run through")
        if not np.ptp(values, axis=0).any():
            raise ValueError(
                f"sequence {place} does not vary over its {len(values)} frames; "
                "nothing can be aligned with it"
            )
    return arrays


def _levels(arrays: list[FloatArray], steps: int) -> Iterator[tuple[list[FloatArray], int]]:
    """Yield the thinned sequences and their steps, the shortest first, without the sequences themselves."""
    halvings = 0
    while max(map(len, arrays)) / 2 ** (halvings + 1) >= COARSE_FRAMES:
        halvings += 1
    for level in range(halvings, 0, -1):
        yield [_thinned(values, 2**level) for values in arrays], max(2, round(steps / 2**level))


def _thinned(values: FloatArray, factor: int) -> FloatArray:
    """Smooth a sequence and keep one frame of `factor`, first and last among them."""
    smooth = gaussian_filter1d(values, factor / 2, axis=0, mode="nearest")
    return interpolate(smooth, np.linspace(0, len(values) - 1, max(2, round(len(values) / factor))))
