"""Experiments of [GTW] 5.2 and 4.3 on made-up sequences: who finds a known alignment, and in what time.

**[GTW]** Zhou, De la Torre, *Generalized time warping for multi-modal alignment of human motion*, CVPR 2012.
5.2 aligns sets of three 2-D curves that were turned, scaled and moved, with a dimension of noise, by the
Procrustes baselines and by generalized time warping; 4.3 aligns pairs of 1-D curves of growing length by DTW,
by DTW in two windows and by Gauss-Newton alone. Errors are those of eq. 9 against the path that the sequences
were made by, see `gtw_sequences.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from time import perf_counter

import numpy as np
import pandas as pd
import pyarrow as pa

from motionary.pipeline.evaluation.paths import path_error
from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.gtw_methods import PAIR_METHODS, SET_METHODS, Aligner
from motionary.workflows.reproduce.gtw_sequences import (
    LATENT_FRAMES,
    STRETCHES,
    KnownSequences,
    curve_pair,
    spiral_set,
)

SETS, PAIRS = "sets", "pairs"
LENGTHS = tuple(int(frames) for frames in np.geomspace(100, 6400, 15).round(-1))
"""Latent frames of the pairs: 15 scales, as in the paper, which does not say which."""

_DRAWS_A_PAIR = 10  # a pair of every length for so many sets


@dataclass(frozen=True)
class GtwMeasurement:
    """One method on one set or pair.

    Parameters
    ----------
    part : str
        "sets" (5.2) or "pairs" (4.3).
    columns : str
        How frames of the latent sequence were chosen, see `gtw_sequences.CHOICES`.
    latent_frames, number : int
        Length of the latent sequence, and which set or pair of these.
    method : str
        One of `gtw_methods.SET_METHODS` or `PAIR_METHODS`.
    error : float
        Eq. 9, frames.
    seconds : float
        Of the alignment.
    """

    part: str
    columns: str
    latent_frames: int
    number: int
    method: str
    error: float
    seconds: float


@dataclass(frozen=True, eq=False)
class GtwStudy:
    """All measurements.

    Parameters
    ----------
    rows : list of GtwMeasurement
        In the order of measuring.
    """

    rows: list[GtwMeasurement]

    def of_sets(self, columns: str, measure: str) -> pd.DataFrame:
        """Return "error" or "seconds" of the sets made in one way: a row a set, a column a method."""
        table = self._table[(self._table["part"] == SETS) & (self._table["columns"] == columns)]
        return table.pivot(index="number", columns="method", values=measure)[list(SET_METHODS[columns])]

    def of_pairs(self, measure: str) -> pd.DataFrame:
        """Return "error" or "seconds" of the pairs: rows by length and number, a column a method."""
        table = self._table[self._table["part"] == PAIRS]
        found = table.pivot(index=["latent_frames", "number"], columns="method", values=measure)
        return found[list(PAIR_METHODS)]

    def to_arrow(self) -> pa.Table:
        """Return a row for every method and set or pair."""
        fields = [
            table_field("part", pa.string(), "sets of three curves (5.2) or pairs of 1-D curves (4.3)"),
            table_field("columns", pa.string(), "how frames of the latent sequence were chosen"),
            table_field("latent_frames", pa.int32(), "length of the latent sequence"),
            table_field("number", pa.int32(), "which set or pair of that kind"),
            table_field("method", pa.string(), "what aligned them"),
            table_field("error", pa.float64(), "eq. 9 against the known path", unit="frames"),
            table_field("seconds", pa.float64(), "of the alignment", unit="s"),
        ]
        return pa.Table.from_pylist([asdict(row) for row in self.rows], schema=pa.schema(fields))

    @cached_property
    def _table(self) -> pd.DataFrame:
        return pd.DataFrame([asdict(row) for row in self.rows])


@dataclass(frozen=True, eq=False)
class GtwExperiment:
    """The measurements, and the seed of the draws."""

    study: GtwStudy
    seed: int


def study_gtw(
    draws: int,
    seed: int,
    show: Show,
    lengths: Sequence[int] = LENGTHS,
) -> GtwExperiment:
    """Align sets and pairs of sequences whose alignment is known.

    Parameters
    ----------
    draws : int
        Sets of each choice of columns; of every length there is a pair for every ten of them, at least one.
    seed : int
        Of the sequences. The same seed gives the same result, but for the seconds; more draws keep the first.
    show : callable
        Shows progress, see `motionary.workflows.progress`.
    lengths : sequence of int
        Latent frames of the pairs.
    """
    pairs = max(1, draws // _DRAWS_A_PAIR)
    rows: list[GtwMeasurement] = []
    _load_kernels(seed)
    with show({"sets": len(SET_METHODS) * draws, "pairs": len(lengths) * pairs}) as advance:
        for number in range(draws):
            for columns, methods in SET_METHODS.items():
                known = spiral_set(columns, seed, number)
                rows += measure(SETS, columns, LATENT_FRAMES, number, known, methods)
                advance("sets")
        for number in range(pairs):
            for frames in lengths:  # length by length, a machine that slows down would change the growth
                known = curve_pair(frames, seed, number)
                rows += measure(PAIRS, STRETCHES, frames, number, known, PAIR_METHODS)
                advance("pairs")
    return GtwExperiment(GtwStudy(rows), seed)


def measure(
    part: str,
    columns: str,
    latent_frames: int,
    number: int,
    known: KnownSequences,
    methods: Mapping[str, Aligner],
) -> list[GtwMeasurement]:
    """Align one set or pair by several methods.

    Parameters
    ----------
    part, columns, latent_frames, number
        As of `GtwMeasurement`.
    known : KnownSequences
        The sequences and their path.
    methods : mapping of str to callable
        What aligns them.
    """
    rows = []
    for name, align in methods.items():
        start = perf_counter()
        path = align(known.sequences)
        seconds = perf_counter() - start
        error = path_error(path, known.truth)
        rows.append(GtwMeasurement(part, columns, latent_frames, number, name, error, seconds))
    return rows


def _load_kernels(seed: int) -> None:
    """Align a pair once for nothing: what is compiled takes its time when it is first called."""
    measure(PAIRS, STRETCHES, LENGTHS[0], 0, curve_pair(LENGTHS[0], seed, 0), PAIR_METHODS)
