"""What aligns the sequences of the GTW experiments, by name.

**[GTW]** Zhou, De la Torre, *Generalized time warping*, CVPR 2012, 4.3 and 5.2. The paper does not name the
bases of 4.3: here they are half polynomial, half tanh, as in 5.2. It relaxes the ends of its paths by an
inequality, and so does Gauss-Newton in 4.3. In 5.2 that lets a warp leave out the end of a sequence where
fewer frames agree better than all, which no other method may; there `GTW` has its ends joined as theirs are,
and `RELAXED` has the inequality. `COARSE` has the start that the paper names as its future work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.bases import monotone_basis
from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.generalized import generalized_time_warping
from motionary.pipeline.alignment.generalized_time import time_step, warp_steps
from motionary.pipeline.alignment.procrustes import (
    procrustes_derivative_dtw,
    procrustes_dtw,
    procrustes_motion_warping,
)
from motionary.pipeline.alignment.steps_to_mean import uniform_path
from motionary.pipeline.alignment.windows import Itakura, SakoeChiba, Window
from motionary.pipeline.motion import FloatArray
from motionary.workflows.reproduce.gtw_sequences import ANYWHERE, LATENT_FRAMES, STRETCHES

START, GTW, RELAXED, COARSE = "uniform", "GTW", "GTW, ends relaxed", "GTW, coarse start"

Path = FloatArray | NDArray[np.int64]
Aligner = Callable[[Sequence[FloatArray]], Path]


def _gtw(
    sequences: Sequence[FloatArray],
    start: Literal["uniform", "coarse"] = "uniform",
    ends: Literal["relaxed", "fixed"] = "fixed",
) -> Path:
    found = generalized_time_warping(
        sequences,
        bases={"polynomial": 3, "tanh": 3},
        smoothness=0.0,
        regularisation=0.0,
        kept=0.9,
        start=start,
        ends=ends,
        steps=LATENT_FRAMES,
    )
    return found.paths


def _dtw(sequences: Sequence[FloatArray], window: Window | None = None) -> Path:
    return dtw(sequences[0], sequences[1], window=window).path


def _gauss_newton(sequences: Sequence[FloatArray], count: int) -> Path:
    lengths = [len(values) for values in sequences]
    half = {"polynomial": count // 2, "tanh": count - count // 2}
    bases = [monotone_basis(half, frames, warp_steps(lengths)) for frames in lengths]
    return np.stack([warp.source_time for warp in time_step(sequences, bases).warps], axis=1)


def _start_of_pairs(sequences: Sequence[FloatArray]) -> Path:
    lengths = [len(values) for values in sequences]
    return uniform_path(lengths, warp_steps(lengths))


PAPER_METHODS: Mapping[str, Aligner] = {
    START: lambda sequences: uniform_path([len(values) for values in sequences], LATENT_FRAMES),
    "pDTW": lambda sequences: procrustes_dtw(sequences, LATENT_FRAMES).path,
    "pDDTW": lambda sequences: procrustes_derivative_dtw(sequences, LATENT_FRAMES).path,
    "pIMW": lambda sequences: procrustes_motion_warping(sequences, LATENT_FRAMES).path,
    GTW: _gtw,
}
"""Of 5.2, and where all of them start: a set's sequences to its path (l, 3)."""

SET_METHODS: Mapping[str, Mapping[str, Aligner]] = {
    STRETCHES: {
        **PAPER_METHODS,
        RELAXED: partial(_gtw, ends="relaxed"),
        COARSE: partial(_gtw, start="coarse"),
    },
    ANYWHERE: PAPER_METHODS,
}
"""What aligns the sets of each choice of columns."""

PAIR_METHODS: Mapping[str, Aligner] = {
    START: _start_of_pairs,
    "DTW": _dtw,
    "DTW-SC": partial(_dtw, window=SakoeChiba(0.1)),
    "DTW-IP": partial(_dtw, window=Itakura()),
    "GN 6": partial(_gauss_newton, count=6),
    "GN 10": partial(_gauss_newton, count=10),
    "GN 14": partial(_gauss_newton, count=14),
}
"""Of 4.3, and where Gauss-Newton starts: a pair's sequences to its path (l, 2)."""
