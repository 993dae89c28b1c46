"""Procrustes baselines of generalized time warping: sequences of one dimension, each warped to their mean.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012, 5.1. All three give every sequence X_i
(n_i, dofs) one frame for each of l common steps, so that the warped sequences agree. In turn, each time to
the minimum of one objective J with the rest held still, they

- for motion warping only, fit every sequence's scales A_i and offsets B_i to the mean, by
  `scale_and_offset.py`;
- warp every sequence to the mean, by a DTW that is slightly modified, the paper does not say how;
- take the mean of the warped sequences again.

    J = m sum over i of |Y_i W_i - mean|^2 + sum over i of lambda_a |A_i'|^2 + lambda_b |B_i'|^2

Y_i is X_i (pDTW), its derivatives (pDDTW), or A_i X_i + B_i (pIMW, which alone has the last two terms, of
first differences). The first term is half the squared distance of two warped sequences, summed over all
ordered pairs. J never rises, and the turns end when the path repeats.

The DTW shows one frame of W_i at every step of the mean and skips none, which needs l >= n_i, see
`steps_to_mean.py`. Costs are squared distances, since J is made of them; elsewhere in this package DTW adds
up distances. pDDTW has a differential operator of first order in the paper, and here the estimate of the
method it extends, `derivatives`.

J of pIMW is 0 where all scales are 0 and all offsets are one constant. Only the start (scales of 1, offsets
of 0) and the smoothness keep it from there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from motionary.pipeline.alignment.dtw import derivatives
from motionary.pipeline.alignment.generalized_time import warp_steps
from motionary.pipeline.alignment.scale_and_offset import checked_smoothness, fit_scale_and_offset
from motionary.pipeline.alignment.steps_to_mean import one_frame_a_step, uniform_path
from motionary.pipeline.alignment.warp import Warp, checked_sequences
from motionary.pipeline.motion import FloatArray

_MOST_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class ProcrustesWarping:
    """Sequences in one time.

    Parameters
    ----------
    path : array (l, m) int64
        The frame of each sequence that is shown at each step.
    mean : array (l, dofs)
        Of what was compared, shown along `path`.
    objectives : array (rounds,)
        J at the end of every round; it never rises.
    """

    path: NDArray[np.int64]
    mean: FloatArray
    objectives: FloatArray

    @property
    def warps(self) -> tuple[Warp, ...]:
        """A warp for each sequence, all of l reference frames."""
        return tuple(Warp(frames, int(frames[-1]) + 1) for frames in self.path.T)


@dataclass(frozen=True, eq=False)
class ProcrustesMotionWarping(ProcrustesWarping):
    """Sequences in one time, and brought to one shape.

    Parameters
    ----------
    scales, offsets : tuple of array (n_i, dofs)
        ``scale * sequence + offset`` is what was compared.
    """

    scales: tuple[FloatArray, ...]
    offsets: tuple[FloatArray, ...]


def procrustes_dtw(sequences: Sequence[FloatArray], steps: int | None = None) -> ProcrustesWarping:
    """Warp sequences to their mean, pDTW [GTW 5.1].

    Parameters
    ----------
    sequences : sequence of array (n_i, dofs)
        Two or more.
    steps : int, optional
        l, at least the longest sequence; by default 1.1 times that, rounded up.

    Returns
    -------
    ProcrustesWarping
        Every sequence runs from its first frame to its last.

    Raises
    ------
    ValueError
        There are fewer than two sequences, their DOFs differ, one is empty or holds a value that is not
        finite, or a sequence is longer than `steps`.
    """
    arrays, steps = _checked(sequences, steps)
    return _warp_to_mean(arrays, steps)


def procrustes_derivative_dtw(sequences: Sequence[FloatArray], steps: int | None = None) -> ProcrustesWarping:
    """Warp sequences such that their derivatives meet their mean, pDDTW [GTW 5.1].

    Parameters
    ----------
    sequences, steps
        As of `procrustes_dtw`.

    Returns
    -------
    ProcrustesWarping
        `mean` is that of the derivatives. An offset of any sequence changes nothing.

    Raises
    ------
    ValueError
        As `procrustes_dtw`.
    """
    arrays, steps = _checked(sequences, steps)
    return _warp_to_mean([derivatives(values) for values in arrays], steps)


def procrustes_motion_warping(
    sequences: Sequence[FloatArray],
    steps: int | None = None,
    scale_smoothness: float = 1.0,
    offset_smoothness: float = 1.0,
) -> ProcrustesMotionWarping:
    """Warp sequences to their mean, with a scale and an offset of every frame and DOF, pIMW [GTW 5.1].

    Parameters
    ----------
    sequences, steps
        As of `procrustes_dtw`.
    scale_smoothness, offset_smoothness : float
        lambda_a, in squared units of the sequences, and lambda_b; not negative. The paper does not give them;
        1 is what its authors' published programs take.

    Returns
    -------
    ProcrustesMotionWarping
        `mean` is that of the scaled sequences.

    Raises
    ------
    ValueError
        As `procrustes_dtw`; or a smoothness is negative or not finite.
    """
    arrays, steps = _checked(sequences, steps)
    smoothness = checked_smoothness(scale_smoothness, offset_smoothness)
    fitted = [(np.ones_like(values), np.zeros_like(values)) for values in arrays]

    def reshape(path: NDArray[np.int64], mean: FloatArray) -> tuple[list[FloatArray], float]:
        weight = [one / len(arrays) for one in smoothness]  # J has m times what the fit minimises
        for i, values in enumerate(arrays):
            fitted[i] = fit_scale_and_offset(values, path[:, i], mean, *weight)
        shaped: list[FloatArray] = [
            scale * values + offset for values, (scale, offset) in zip(arrays, fitted, strict=True)
        ]
        roughness = sum(
            lambda_ * float((np.diff(values, axis=0) ** 2).sum())
            for pair in fitted
            for lambda_, values in zip(smoothness, pair, strict=True)
        )
        return shaped, roughness

    found = _warp_to_mean(arrays, steps, reshape)
    scales, offsets = zip(*fitted, strict=True)
    return ProcrustesMotionWarping(found.path, found.mean, found.objectives, scales, offsets)


def _warp_to_mean(
    sequences: list[FloatArray],
    steps: int,
    reshape: Callable[[NDArray[np.int64], FloatArray], tuple[list[FloatArray], float]] | None = None,
) -> ProcrustesWarping:
    """Take turns from the uniform path until the path repeats."""
    shaped, roughness = sequences, 0.0
    path = uniform_path([len(values) for values in sequences], steps)
    mean = _mean(shaped, path)
    objectives: list[float] = []
    for _ in range(_MOST_ROUNDS):
        before = path
        if reshape is not None:
            shaped, roughness = reshape(path, mean)
        path = np.stack([one_frame_a_step(cdist(values, mean, "sqeuclidean")) for values in shaped], axis=1)
        mean = _mean(shaped, path)
        objectives.append(_disagreement(shaped, path, mean) + roughness)
        if np.array_equal(path, before):
            break
    return ProcrustesWarping(path, mean, np.array(objectives))


def _mean(sequences: list[FloatArray], path: NDArray[np.int64]) -> FloatArray:
    return np.mean([values[frames] for values, frames in zip(sequences, path.T, strict=True)], axis=0)


def _disagreement(sequences: list[FloatArray], path: NDArray[np.int64], mean: FloatArray) -> float:
    apart = [values[frames] - mean for values, frames in zip(sequences, path.T, strict=True)]
    return len(sequences) * float(np.square(apart).sum())


def _checked(sequences: Sequence[FloatArray], steps: int | None) -> tuple[list[FloatArray], int]:
    arrays = checked_sequences(sequences)
    for i, values in enumerate(arrays):
        if values.shape[1] != arrays[0].shape[1]:
            raise ValueError(
                f"sequence 0 has {arrays[0].shape[1]} DOFs and sequence {i} {values.shape[1]}; "
                "a mean needs the same of all: use generalized time warping for sequences of other dimension"
            )
    longest = max(len(values) for values in arrays)
    if steps is None:
        steps = warp_steps([longest])
    if steps < longest:
        raise ValueError(
            f"there are {steps} steps and the longest sequence has {longest} frames; no frame is skipped, "
            f"so it takes {longest} steps or more"
        )
    return arrays, steps
