"""What the FP-DTW experiment measures of a pair: similarity and deviation of every algorithm.

The algorithms are those of Figures 5 and 6, and `Ma` with the others' windows beside its own of 2. The costs
of DTW are the online methods' own, distances of rotations summed over joints [FP eq. 1]; the frame that a
path shows at a target frame is the mean of those it joins with it, see `path_warp`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa

from motionary.pipeline.alignment import Warp, uniform
from motionary.pipeline.alignment.online import online_warp
from motionary.pipeline.alignment.path_warp import path_warp
from motionary.pipeline.alignment.rotation_costs import rotation_costs
from motionary.pipeline.distances import dtw_path
from motionary.pipeline.evaluation import joint_trajectories, kendall_tau_similarity, path_deviation
from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.fp_dtw_clips import TurningClip
from motionary.workflows.reproduce.pairs import Pair

WINDOWS = (10, 20, 40, 80)
MATCHING_WINDOW = 2
"""The paper's for method A."""

UTW, DTW = "UTW", "DTW"

IMPERCEPTIBLE = 0.150
"""Seconds by which two characters may be mistimed unnoticed, as the paper has it."""


class Algorithm(NamedTuple):
    """An online method, its window in frames, and whether Type V constrains it."""

    method: Literal["A", "B", "C"]
    window: int
    type_v: bool

    def __str__(self) -> str:
        window = "" if self.window == MATCHING_WINDOW else f" w{self.window}"
        return f"M{self.method.lower()}{window}{' + Type V' if self.type_v else ''}"


def _windows(method: str, type_v: bool) -> tuple[int, ...]:
    if method != "A":
        return WINDOWS
    # Type V allows an advance of 3 at most, so that to method A all windows from 3 on are one.
    return (MATCHING_WINDOW, *WINDOWS[:1]) if type_v else (MATCHING_WINDOW, *WINDOWS)


ALGORITHMS: tuple[Algorithm, ...] = tuple(
    Algorithm(method, window, type_v)
    for type_v in (False, True)
    for method in ("A", "B", "C")
    for window in _windows(method, type_v)
)
"""Those of [FP], and method A with wider windows than its 2."""


class Alignment(NamedTuple):
    """How one algorithm aligned one pair at one rate."""

    rate: int
    action: str
    moving: str
    reference: str
    algorithm: str
    similarity: float
    deviation: float
    ahead: float
    microseconds: float | None


@dataclass(frozen=True, eq=False)
class FpStudy:
    """All alignments, and their medians."""

    rows: Sequence[Alignment]

    def to_arrow(self) -> pa.Table:
        """Return a row for every alignment."""
        schema = pa.schema(
            [
                table_field("rate", pa.int32(), "at which both clips were shown", "1/s"),
                table_field("action", pa.string(), "class of the clips"),
                table_field("moving", pa.string(), "prerecorded clip"),
                table_field("reference", pa.string(), "clip that plays the live one"),
                table_field("algorithm", pa.string(), "method, window in frames, constraint"),
                table_field("similarity", pa.float64(), "mean of Kendall's tau over joint trajectories"),
                table_field("deviation", pa.float64(), "mean distance from DTW's path", "frames"),
                table_field("ahead", pa.float64(), "mean of how far before DTW's path", "frames"),
                table_field("microseconds", pa.float64(), "a live frame; online only", "us", nullable=True),
            ]
        )
        return pa.Table.from_pylist([row._asdict() for row in self.rows], schema=schema)

    @property
    def rates(self) -> list[int]:
        """Rates that were tested, the highest first."""
        return sorted({row.rate for row in self.rows}, reverse=True)

    def pairs(self, rate: int, measure: str) -> pd.DataFrame:
        """Return a measure at a rate: a row a pair, a column an algorithm."""
        some = pd.DataFrame([row for row in self.rows if row.rate == rate])
        return some.pivot(index=["action", "moving", "reference"], columns="algorithm", values=measure)

    def medians(self, rate: int) -> pd.DataFrame:
        """Return medians over pairs at a rate, by algorithm; of the microseconds the mean, as Table 2 has."""
        some = pd.DataFrame([row for row in self.rows if row.rate == rate])
        grouped = some.groupby("algorithm", sort=False)
        found = grouped[["similarity", "deviation", "ahead"]].median()
        return found.assign(microseconds=grouped["microseconds"].mean())


def measure_pair(
    rate: int,
    action: str,
    ids: Pair,
    moving: TurningClip,
    reference: TurningClip,
    algorithms: Sequence[Algorithm] = ALGORITHMS,
) -> list[Alignment]:
    """Align a clip to another by UTW, DTW and every online algorithm.

    Parameters
    ----------
    rate : int
        Frames a second of both.
    action : str
        What both show.
    ids : Pair
        Names of the moving clip and the reference.
    moving, reference : TurningClip
        The clips.
    algorithms : sequence of Algorithm
        Beside UTW and DTW.

    Returns
    -------
    list of Alignment
        UTW, DTW, then the algorithms in their order.
    """
    frames = len(moving.rotations)
    values = joint_trajectories(moving.rotations, moving.directions)
    target = joint_trajectories(reference.rotations, reference.directions)
    along = path_warp(dtw_path(rotation_costs(moving.rotations, reference.rotations)), frames)

    def measured(name: str, warp: Warp, seconds: float | None = None) -> Alignment:
        return Alignment(
            rate, action, *ids, name,
            similarity=kendall_tau_similarity(warp.apply(values), target),
            deviation=path_deviation(along.source_time, warp.source_time),
            ahead=float(np.mean(warp.source_time - along.source_time)),
            microseconds=None if seconds is None else 1e6 * seconds / len(target),
        )  # fmt: skip

    rows = [measured(UTW, uniform(values, target)), measured(DTW, along)]
    for one in algorithms:
        start = perf_counter()
        warp = online_warp(
            moving.rotations,
            reference.rotations,
            one.method,
            one.window,
            "type-v" if one.type_v else None,
        )
        rows.append(measured(str(one), warp, perf_counter() - start))
    return rows
