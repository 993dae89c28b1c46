"""The CoTW experiment in a terminal, beside the paper's figures.

**[CoTW]** Etemad, Arya, *Correlation-optimized time warping for motion*: section 6.1, Figures 8, 10 and 11,
Table 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from rich.console import Group, RenderableType
from scipy.stats import ttest_ind_from_stats

from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw_measures import (
    ANY_DISTORTION,
    FIXED,
    KNOWN,
    METHODS,
    REFERENCES,
    TABLE_3,
    Measurements,
)
from motionary.workflows.tables import text_table


@dataclass(frozen=True)
class Published:
    """A method in the paper: means and deviations of 6.1 and Table 3, and CoTW's t tests against it."""

    distance: tuple[float, float]
    correlation: tuple[float, float]
    seconds: tuple[float, float]
    distance_test: str = ""
    correlation_test: str = ""


PAPER = {
    "UTW": Published((1, 0), (0.20, 0.23), (0.02, 0.01), "t 5.86, p < .001", "t 5.53, p < .001"),
    "DTW": Published((0.76, 0.16), (0.47, 0.17), (0.08, 0.04), "p > .05", "t 3.46, p < .01"),
    "DDTW": Published((0.73, 0.13), (0.52, 0.22), (0.09, 0.06), "p > .05", "t 2.37, p < .05"),
    "CTW": Published((0.76, 0.16), (0.48, 0.18), (1.25, 0.59), "p > .05", "t 3.45, p < .01"),
    "CoTW": Published((0.65, 0.15), (0.75, 0.08), (10.01, 7.61)),
}
_MISSING = "-"  # such as a test of values that do not vary

_LEGEND = (
    "Distance: absolute difference a frame and DOF, over the largest of the methods' within the action; "
    "correlation: mean over DOFs of Pearson's, whole sequences.\n"
    "± standard deviation over actions, each the mean of its pairs. t test: CoTW's actions against the other "
    "method's, two samples, pooled; t is positive where CoTW is better."
)


def cotw_report(experiment: Conducted[Measurements]) -> RenderableType:
    """Lay the experiment out for reading; all its numbers are `Measurements.to_arrow`."""
    study = experiment.study
    tables = (
        _methods_table, _actions_table, _settings_table, _seconds_table, _distortion_table, _known_table,
        _references_table,
    )  # fmt: skip
    parts: list[RenderableType] = list(experiment.notes)
    for table in tables:
        parts += ["", table(study)]
    return Group(*parts)


def normalised_distance(study: Measurements, part: str) -> pd.DataFrame:
    """Return distances by action and method, divided by the largest of the action's."""
    distance = study.by_action(part, "distance")[list(METHODS)]
    return distance.div(distance.max(axis=1), axis=0)


def t_test(better: pd.Series, worse: pd.Series) -> tuple[float, float]:
    """Compare two methods' values over the actions as the paper does: two samples, pooled variances.

    Returns
    -------
    t, p : float
        t is positive where `better` is the larger, nan where no method's values vary; p of both sides.
    """
    # From means and deviations: UTW's distances are all 1, which `ttest_ind` warns of.
    with np.errstate(divide="ignore", invalid="ignore"):
        found = ttest_ind_from_stats(
            better.mean(), better.std(), len(better), worse.mean(), worse.std(), len(worse)
        )
    return float(found.statistic), float(found.pvalue)


def _methods_table(study: Measurements) -> RenderableType:
    part = study.of_pairs[0]
    distance, correlation = normalised_distance(study, part), study.by_action(part, "correlation")
    rows = []
    for name, paper in PAPER.items():
        ours = [_spread(distance[name]), "", _spread(correlation[name]), ""]
        if name != "CoTW":
            ours[1] = _test(-distance["CoTW"], -distance[name])
            ours[3] = _test(correlation["CoTW"], correlation[name])
        published = [
            _published(paper.distance), paper.distance_test, _published(paper.correlation),
            paper.correlation_test,
        ]  # fmt: skip
        rows.append([name, *(cell for pair in zip(ours, published, strict=True) for cell in pair)])
    headings = [
        heading for what in ("distance", "t test", "correlation", "t test") for heading in (what, "paper")
    ]
    freedom = 2 * len(distance) - 2
    title = f"By {part}, beside section 6.1 of the paper; t has {freedom} degrees of freedom (the paper's 10)"
    return Group(text_table(["method", *headings], rows, title), _LEGEND)


def _actions_table(study: Measurements) -> RenderableType:
    part = study.of_pairs[0]
    distance, correlation = normalised_distance(study, part), study.by_action(part, "correlation")
    rows = [
        [
            action,
            *(f"{distance.loc[action, name]:.2f}" for name in METHODS),
            *(f"{correlation.loc[action, name]:.2f}" for name in METHODS),
        ]
        for action in distance.index
    ]
    headings = [f"{what}, {name}" for what in ("distance", "correlation") for name in METHODS]
    return text_table(["action", *headings], rows, "By action (Figure 11)")


def _settings_table(study: Measurements) -> RenderableType:
    rows = []
    for part in study.of_pairs:
        distance, correlation = normalised_distance(study, part), study.by_action(part, "correlation")
        pairs = len(study.of(part, "distance"))
        values = [*(distance[name] for name in METHODS), *(correlation[name] for name in METHODS)]
        rows.append([part, str(pairs), *(_spread(value) for value in values)])
    headings = [f"{what}, {name}" for what in ("distance", "correlation") for name in METHODS]
    return text_table(["DOFs, pairs of", "pairs", *headings], rows, "By DOFs and people")


def _seconds_table(study: Measurements) -> RenderableType:
    found, fixed = study.of(study.of_pairs[0], "seconds"), study.of(FIXED, "seconds")
    rows = [
        [
            name,
            _spread(found[name], digits=4),
            _spread(fixed[name], digits=4) if len(fixed) else _MISSING,
            _published(paper.seconds),
        ]
        for name, paper in PAPER.items()
    ]
    length, slack = TABLE_3
    title = (
        "Seconds an alignment, ± deviation over pairs; CoTW with its search, and with segments of "
        f"{length} and slack {slack} as in Table 3, on the {len(fixed)} pairs whose reference has "
        f"{2 * length} frames or more"
    )
    headings = ["method", "as above", f"CoTW with {length}, {slack}", "paper (Table 3)"]
    return text_table(headings, rows, title)


def _distortion_table(study: Measurements) -> RenderableType:
    rows = []
    for shown, name in {"0": ANY_DISTORTION, "0.5": "CoTW"}.items():
        values = {
            what: study.of(study.of_pairs[0], what)[name]
            for what in ("distortion", "correlation", "segment_length", "slack")
        }
        rows.append(
            [
                shown,
                f"{values['distortion'].abs().mean():.3f}",
                f"{values['correlation'].mean():.3f}",
                _spread(values["segment_length"], digits=1),
                _spread(values["slack"], digits=1),
            ]
        )
    headings = ["alpha", "|distortion|", "correlation", "segment length", "slack"]
    title = (
        "What alpha does (Figure 8): means over pairs, ± deviation; "
        "the paper's segments have 25 ± 13 frames, its slack is the most there is"
    )
    return text_table(headings, rows, title)


def _known_table(study: Measurements) -> RenderableType:
    takes = study.of(KNOWN, "error")
    actions = takes.groupby(level="action").mean()
    every = [*actions.index, "all takes"]
    rows = [
        [name, *(f"{value:.2f}" for value in [*actions[name], takes[name].mean()])] for name in takes.columns
    ]
    title = "Known warps (embedded library): mean error of the times, in frames at 30 a second"
    return text_table(["method", *every], rows, title)


def _references_table(study: Measurements) -> RenderableType:
    rough, close = study.by_action(REFERENCES, "roughness"), study.by_action(REFERENCES, "correlation")
    rows = [
        [
            kind,
            f"{rough[kind].mean():.3f}",
            f"{close[kind].mean():.2f}",
            *(f"{rough.loc[action, kind]:.3f}" for action in rough.index),
        ]
        for kind in rough.columns
    ]
    title = (
        "References (Figure 10): roughness (turning over moving, 0 is a straight line), and mean correlation "
        "of the clips with them, the chosen one left out; means over actions, then the roughness by action"
    )
    return text_table(["reference", "roughness", "correlation", *rough.index], rows, title)


def _test(better: pd.Series, worse: pd.Series) -> str:
    t, p = t_test(better, worse)
    if np.isnan(t):
        return _MISSING
    level = next((level for level in (".001", ".01", ".05") if p < float(level)), None)
    return f"t {t:.2f}, p {f'< {level}' if level else '> .05'}"


def _spread(values: pd.Series, digits: int = 2) -> str:
    if len(values) < 2:
        return f"{values.mean():.{digits}f}"
    return f"{values.mean():.{digits}f} ± {values.std():.{digits}f}"


def _published(figure: tuple[float, float]) -> str:
    return f"{figure[0]:.2f} ± {figure[1]:.2f}"
