"""The adaptive DTW experiment in a terminal, beside what the paper says.

**[ADTW]** Heloir, Courty, Gibet, Multon, *Temporal alignment of communicative gesture sequences*: Figure 3
and the section on results. It has curves and words, no number; what it says of them stands beside ours.
"""

from __future__ import annotations

import pandas as pd
from rich.console import Group, RenderableType

from motionary.workflows.reproduce.adaptive_dtw_measures import (
    ADAPTIVE,
    CONSTRAINED,
    LIMITED,
    METHODS,
    SEQUENCES,
    SETTINGS,
    TAKES,
)
from motionary.workflows.reproduce.claims import Claim, claims_table
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw_measures import KNOWN, Measurements
from motionary.workflows.tables import text_table

PAPER = {
    "DTW": "least distance, but jumps and stays",
    LIMITED: "smooth, but cannot follow wide changes of tempo",
    CONSTRAINED: "the recurrence it prints; not shown",
    ADAPTIVE: "smooth, and still accurate",
}
"""The paper's judgements, as Figure 3 shows them."""

_LEGEND = (
    "Means over pairs. Deviation: from the plain DTW's path, in frames of the moving sequence; longest stay: "
    "in frames;\njerk: of the first principal postures as shown, over the reference's own; distance: of what "
    "is shown from the reference;\nseconds: of the path; K and adaptive DTW seek the principal postures of "
    "these once more in them. The paper prints\nno numbers: what it says stands beside ours."
)
_MEASURES = {"deviation": 2, "stay": 1, "jerk": 2, "distance": 3, "seconds": 4}
_MISSING = "-"


def adaptive_dtw_report(experiment: Conducted[Measurements]) -> RenderableType:
    """Lay the experiment out for reading; all its numbers are `Measurements.to_arrow`."""
    study = experiment.study
    parts: list[RenderableType] = [*experiment.notes, _LEGEND]
    titles = {TAKES: "Takes of one action", SEQUENCES: "Sequences: takes of several actions, joined"}
    for part, title in titles.items():
        if not study.of(part, "stay").empty:
            parts += ["", _methods_table(study, part, title)]
    parts += ["", _known_table(study), "", _settings_table(study)]
    if not study.of(SEQUENCES, "stay").empty:
        title = "What the paper says, held against the sequences of takes joined"
        parts += ["", claims_table(claims(study), title)]
    return Group(*parts)


def claims(study: Measurements) -> list[Claim]:
    """Hold what the paper says against the sequences here.

    Means are compared over the sequences that both methods could align.
    """
    return [
        _claim(study, "stay", "stands still for less long than DTW", "DTW"),
        _claim(study, "jerk", "shows the moving sequence less jerkily than DTW", "DTW"),
        *(
            _claim(study, "deviation", f"lies nearer to DTW's path than {name}", name)
            for name in (LIMITED, CONSTRAINED)
        ),
    ]


def _claim(study: Measurements, measure: str, said: str, other: str) -> Claim:
    claim = f"{ADAPTIVE} {said}"
    measured = study.of(SEQUENCES, measure)
    both = measured.reindex(columns=[ADAPTIVE, other]).dropna()
    if both.empty:
        return Claim(claim, None, f"{other} aligns none of the sequences")
    ours, others = both.mean()
    digits = _MEASURES[measure]
    which = f"{len(both)}" if len(both) == len(measured) else f"{len(both)} of {len(measured)}"
    here = f"{measure} {ours:.{digits}f} against {others:.{digits}f}, means over {which} sequences"
    return Claim(claim, bool(ours < others), here)


def _methods_table(study: Measurements, part: str, title: str) -> RenderableType:
    measured = {measure: study.of(part, measure) for measure in _MEASURES}
    rows = [
        [name, *(_mean(measured[one], name, digits) for one, digits in _MEASURES.items()), PAPER[name]]
        for name in METHODS
    ]
    headings = ["deviation", "longest stay", "jerk", "distance", "seconds"]
    pairs = len(measured["stay"])
    missing = int(measured["stay"].get(LIMITED, pd.Series(index=range(pairs), dtype=float)).isna().sum())
    said = f"{title}: {pairs} pairs"
    if missing:
        said += f"; {LIMITED} of {pairs - missing}: the others' lengths are too different or too great"
    return text_table(["method", *headings, "the paper"], rows, said)


def _known_table(study: Measurements) -> RenderableType:
    errors = study.of(KNOWN, "error")
    actions = errors.groupby(level="action").mean()
    rows = [
        [name, *(f"{value:.2f}" for value in [*actions[name], errors[name].mean()])]
        for name in errors.columns
    ]
    title = "Known warps (embedded library): mean error of the times, in frames at 30 a second"
    return text_table(["method", *actions.index, "all takes"], rows, title)


def _settings_table(study: Measurements) -> RenderableType:
    measured = {measure: study.of(SETTINGS, measure) for measure in _MEASURES}
    rows = [
        [name, *(_mean(measured[one], name, digits) for one, digits in _MEASURES.items())]
        for name in measured["stay"].columns
    ]
    title = "Adaptive DTW by radius and K, which the paper does not name, on the takes"
    return text_table(["settings", "deviation", "longest stay", "jerk", "distance", "seconds"], rows, title)


def _mean(table: pd.DataFrame, name: str, digits: int) -> str:
    return f"{table[name].mean():.{digits}f}" if name in table else _MISSING
