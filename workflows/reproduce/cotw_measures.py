"""What the CoTW experiment measures: of a pair of clips, of a known warp, of a way to find a reference.

A measurement is one number with its circumstances, and the experiment is a long table of them. `METHODS` is
the one place that names the methods which are compared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa

from motionary.pipeline.alignment import (
    CotwWarp,
    Warp,
    cotw,
    cotw_search,
    dtw,
    mean_correlation,
    select_reference,
    uniform,
)
from motionary.pipeline.alignment.canonical_time_warping import canonical_time_warping
from motionary.pipeline.alignment.dtw import derivative_dtw
from motionary.pipeline.alignment.trajectories import computed_trajectories, roughness
from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import interpolate
from motionary.pipeline.alignment.weights import varying_dofs
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import POSE_COLUMNS, frame_features, sample_times
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.synthetic import TEMPLATE_FPS, SyntheticTake, template
from motionary.pipeline.tables import table_field

Method = Callable[[FloatArray, FloatArray, FloatArray | None], Warp]

FIXED, KNOWN, REFERENCES = "fixed parameters", "known warps", "references"
"""Parts of the experiment beside those of pairs, which are named by what was compared, of whom."""

METHODS: Mapping[str, Method] = {
    "UTW": lambda moving, reference, weights: uniform(moving, reference),
    "DTW": dtw,
    "DDTW": derivative_dtw,
    "CTW": lambda moving, reference, weights: canonical_time_warping(moving, reference),  # finds its own
    "CoTW": cotw_search,
}
"""The paper's five, in its order; what is added here is in every table."""

ANY_DISTORTION = "CoTW, alpha 0"
WITH_ANY_DISTORTION: Mapping[str, Method] = {
    **METHODS,
    ANY_DISTORTION: lambda moving, reference, weights: cotw_search(moving, reference, weights, alpha=0.0),
}

TABLE_3 = (40, 20)  # segment length and slack of the paper's Table 3

_AS_CAPTURED = FeatureConfig(epsilon=0.0)


class Measurement(NamedTuple):
    """One number: in which part of the experiment, of what, by which method."""

    part: str
    action: str
    moving: str | None
    reference: str | None
    method: str
    measure: str
    value: float


@dataclass(frozen=True, eq=False)
class Measurements:
    """All numbers of an experiment, a row each."""

    rows: Sequence[Measurement]

    def to_arrow(self) -> pa.Table:
        """Return a row for every number."""
        schema = pa.schema(
            [
                table_field("part", pa.string(), "part of the experiment"),
                table_field("action", pa.string(), "class of the clips"),
                table_field("moving", pa.string(), "clip that is aligned", nullable=True),
                table_field("reference", pa.string(), "clip that it is aligned to", nullable=True),
                table_field("method", pa.string(), "method of alignment, or kind of reference"),
                table_field("measure", pa.string(), "what the value is"),
                table_field("value", pa.float64(), "measured value"),
            ]
        )
        return pa.Table.from_pylist([row._asdict() for row in self.rows], schema=schema)

    @property
    def of_pairs(self) -> list[str]:
        """Parts that align pairs of clips; the first is the one that the others vary."""
        parts = dict.fromkeys(row.part for row in self.rows)
        return [part for part in parts if part not in (FIXED, KNOWN, REFERENCES)]

    def of(self, part: str, measure: str) -> pd.DataFrame:
        """Return a measure, rows by action and clips, a column a method in the order of measuring."""
        rows = pd.DataFrame([row for row in self.rows if (row.part, row.measure) == (part, measure)])
        if rows.empty:
            return rows
        table = rows.pivot(index=["action", "moving", "reference"], columns="method", values="value")
        return table[list(dict.fromkeys(rows["method"]))]

    def by_action(self, part: str, measure: str) -> pd.DataFrame:
        """Return the mean of a measure, a row an action and a column a method."""
        return self.of(part, measure).groupby(level="action").mean()


def measure_pair(
    part: str,
    action: str,
    ids: tuple[str, str],
    moving: FloatArray,
    reference: FloatArray,
    methods: Mapping[str, Method] = METHODS,
) -> list[Measurement]:
    """Align a clip to another by several methods.

    Parameters
    ----------
    part, action : str
        Part of the experiment, and what both clips show.
    ids : tuple of str
        Names of the moving clip and the reference.
    moving, reference : array (frames, dofs)
        The clips.
    methods : mapping of str to callable
        What aligns them.

    Returns
    -------
    list of Measurement
        For every method the mean correlation over DOFs, the mean absolute difference a frame and DOF, and the
        seconds it took to find the warp and apply it; for CoTW also what it chose. DOFs that move in neither
        clip are left out.
    """
    rows = []
    weights = varying_dofs([moving, reference])
    for name, align in methods.items():
        start = perf_counter()
        warp = align(moving, reference, weights)
        warped = warp.apply(moving)
        values = {
            "seconds": perf_counter() - start,
            "correlation": mean_correlation(warped, reference, weights),
            "distance": np.average(np.abs(warped - reference).mean(axis=0), weights=weights),
        }
        if isinstance(warp, CotwWarp):
            values |= {one: getattr(warp, one) for one in ("segment_length", "slack", "distortion")}
        rows += [
            Measurement(part, action, *ids, name, measure, float(value)) for measure, value in values.items()
        ]
    return rows


def measure_fixed(
    action: str, ids: tuple[str, str], moving: FloatArray, reference: FloatArray
) -> list[Measurement]:
    """Align a pair with Table 3's parameters for CoTW, unless they make a single segment of the reference."""
    if len(reference) < 2 * TABLE_3[0]:
        return []
    methods = {**METHODS, "CoTW": lambda one, other, weights: cotw(one, other, *TABLE_3, weights)}
    return measure_pair(FIXED, action, ids, moving, reference, methods)


def known_takes(takes: Sequence[SyntheticTake]) -> list[SyntheticTake]:
    """Leave out the mirrored takes, whose template is mirrored as well."""
    return [take for take in takes if not take.is_mirrored]


def measure_known(take: SyntheticTake) -> list[Measurement]:
    """Find the warp of an embedded take again by every method.

    The reference is the part of the action's template that the take shows: all of it, but for gaits, of which
    takes show some cycles.

    Returns
    -------
    list of Measurement
        For every method the mean absolute error of its times, in frames of the take at 30 a second.
    """
    samples = sample_times(take.motion.frames, take.motion.fps, TEMPLATE_FPS)
    shown = np.interp(samples, np.arange(take.motion.frames), take.warp)
    first, last = int(np.ceil(shown[0] - 1e-6)), int(np.floor(shown[-1] + 1e-6))
    truth = np.interp(np.arange(first, last + 1), shown, np.arange(len(samples)))
    moving, reference = _pose(take.motion), _pose(template(take.action))[first : last + 1]
    weights = varying_dofs([moving, reference])
    return [
        Measurement(
            KNOWN, take.action, take.path, f"{take.action} template", name, "error",
            float(np.abs(align(moving, reference, weights).source_time - truth).mean()),
        )
        for name, align in WITH_ANY_DISTORTION.items()
    ]  # fmt: skip


def measure_references(action: str, ids: Sequence[str], clips: Sequence[FloatArray]) -> list[Measurement]:
    """Compare the reference of several clips with trajectories computed from them [CoTW 5, Figure 10].

    Parameters
    ----------
    action : str
        What all show.
    ids : sequence of N str
        Their names.
    clips : sequence of N arrays (frames, dofs)
        The clips; length-matched here to the median length.

    Returns
    -------
    list of Measurement
        For every kind of reference its roughness, and the mean correlation with it of all clips but the one
        that the similarity index chooses.
    """
    weights = varying_dofs(clips)
    frames = max(3, round(float(np.median([len(clip) for clip in clips]))))
    matched = np.stack([interpolate(clip, uniform_times(len(clip), frames)) for clip in clips])
    chosen = select_reference(clips, weights)
    others = np.delete(matched, chosen, axis=0)
    rows = []
    for kind, trajectory in {
        "similarity index": matched[chosen],
        **computed_trajectories(matched),
    }.items():
        name = ids[chosen] if kind == "similarity index" else None
        correlation = float(np.mean([mean_correlation(other, trajectory, weights) for other in others]))
        for measure, value in (("roughness", roughness(trajectory, weights)), ("correlation", correlation)):
            rows.append(Measurement(REFERENCES, action, None, name, kind, measure, value))
    return rows


def _pose(motion: Motion) -> FloatArray:
    return frame_features(motion, _AS_CAPTURED).values[:, :POSE_COLUMNS]
