"""Sequences whose alignment is known, as the experiments of [GTW] 4.3 and 5.2 are made on.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012. Of a latent sequence Z of l frames,
sequence i holds some frames, in their order: Z M_i, where M_i has n_i <= l columns of I_l. The truth, W_i =
M_i^T, has a column of zeros at each latent frame that i does not hold, and hardly a latent frame is held by
all. So it is read as a curve of l rows, one a latent frame: at a frame that i holds, the row has its place in
i; between two such the time of i passes evenly, before the first and after the last it stands still.

The paper says that columns are chosen at random, not how. Two ways are taken: `STRETCHES`, as its authors'
published programs do (five equal stretches of the latent sequence, each thinned evenly to a random share of
its frames, so that speeds differ), and `ANYWHERE` (each set of n_i columns is as likely as any other, which
leaves speeds almost even). From the same programs are the latent spiral, the ranges of the spatial transforms
and the deviation of the noise, which the paper shows in pictures at most.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

LATENT_FRAMES = 300
SEQUENCES = 3
STRETCHES, ANYWHERE = "by stretches", "anywhere"

_LEAST_KEPT, _MOST_KEPT = 0.3, 0.9  # shares of the latent frames
_STRETCHES = 5
_NOISE = 2.0
_HARMONICS = 6  # of the 1-D curves


@dataclass(frozen=True, eq=False)
class KnownSequences:
    """Sequences that hold frames of one latent sequence.

    Parameters
    ----------
    sequences : tuple of array (n_i, dofs)
        What an aligner is given.
    truth : array (l, m)
        The frame of each sequence, maybe fractional, at each latent frame.
    """

    sequences: tuple[FloatArray, ...]
    truth: FloatArray

    @property
    def lengths(self) -> list[int]:
        """Frames of each sequence."""
        return [len(values) for values in self.sequences]


def spiral_set(choice: str, seed: int, number: int) -> KnownSequences:
    """Make three sequences of a spiral, each transformed in its own way, with a third dimension of noise.

    Parameters
    ----------
    choice : {"by stretches", "anywhere"}
        How columns of I_l are chosen.
    seed, number : int
        The same two give the same sequences.

    Returns
    -------
    KnownSequences
        X_i = [U_i^T (Z + b_i) M_i; e_i], transposed: (n_i, 3).
    """
    rng = np.random.default_rng([seed, number])
    angle = 4 * np.pi * np.sqrt(np.linspace(0, 1, LATENT_FRAMES))
    latent = angle[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    kept = [CHOICES[choice](LATENT_FRAMES, rng) for _ in range(SEQUENCES)]
    sequences = []
    for columns in kept:
        turn, scale = rng.uniform(0, np.pi), rng.uniform(0, 2, size=2)
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        offset = np.ptp(latent, axis=0) * rng.uniform(0, 2, size=2)
        shown = (latent + offset)[columns] @ (rotation * scale).T
        sequences.append(np.column_stack([shown, rng.normal(0, _NOISE, size=len(columns))]))
    return KnownSequences(tuple(sequences), known_path(kept, LATENT_FRAMES))


def curve_pair(latent_frames: int, seed: int, number: int) -> KnownSequences:
    """Make two sequences of one random 1-D curve, by random columns as `STRETCHES` has them.

    Parameters
    ----------
    latent_frames : int
        l: curves of all lengths have as many turns, so a longer one is sampled more closely.
    seed, number : int
        The same two give the same curve.

    Returns
    -------
    KnownSequences
        (n_i, 1), with .3 to .9 of the latent frames; neither more than twice as long as the other, beyond
        which Itakura's window leaves no path.
    """
    rng = np.random.default_rng([seed, latent_frames, number])
    order = np.arange(1, _HARMONICS + 1)
    height, phase = rng.normal(size=_HARMONICS) / order, rng.uniform(0, 2 * np.pi, size=_HARMONICS)
    time = np.linspace(0, 1, latent_frames)
    latent = (height * np.sin(2 * np.pi * order * time[:, None] + phase)).sum(axis=1, keepdims=True)
    kept = [CHOICES[STRETCHES](latent_frames, rng) for _ in range(2)]
    while max(map(len, kept)) - 1 > 2 * (min(map(len, kept)) - 1):
        kept = [CHOICES[STRETCHES](latent_frames, rng) for _ in range(2)]
    return KnownSequences(tuple(latent[columns] for columns in kept), known_path(kept, latent_frames))


def known_path(kept: list[NDArray[np.int64]], latent_frames: int) -> FloatArray:
    """Return the curve of the truth (l, m) from the latent frames that each sequence holds, rising."""
    latent = np.arange(latent_frames)
    return np.stack([np.interp(latent, columns, np.arange(len(columns))) for columns in kept], axis=1)


def _by_stretches(latent_frames: int, rng: np.random.Generator) -> NDArray[np.int64]:
    edges = np.linspace(0, latent_frames, _STRETCHES + 1).round().astype(np.int64)
    columns = []
    for first, end in zip(edges[:-1], edges[1:], strict=True):
        count = max(1, round((end - first) * rng.uniform(_LEAST_KEPT, _MOST_KEPT)))
        columns.append(first - 1 + np.round((end - first) / count * np.arange(1, count + 1)))
    return np.concatenate(columns).astype(np.int64)


def _anywhere(latent_frames: int, rng: np.random.Generator) -> NDArray[np.int64]:
    count = round(latent_frames * rng.uniform(_LEAST_KEPT, _MOST_KEPT))
    return np.sort(rng.choice(latent_frames, size=count, replace=False))


CHOICES: Mapping[str, Callable[[int, np.random.Generator], NDArray[np.int64]]] = {
    STRETCHES: _by_stretches,
    ANYWHERE: _anywhere,
}
"""How columns of I_l are chosen: of l frames those that a sequence holds, rising."""
