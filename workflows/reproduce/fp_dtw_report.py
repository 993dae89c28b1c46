"""The FP-DTW experiment in a terminal, beside the paper's figures and what it concludes from them.

**[FP]** Randall, Harvey, Williams, *Online alignment of human motion using forward plotting-DTW*, CAVW 34
(2023): Tables 1 and 2, sections 5 to 7. Its Figures 5 and 6, the medians of all algorithms, are pictures;
what the text says of them is set beside what is computed here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pandas as pd
from rich.console import Group, RenderableType

from motionary.workflows.reproduce.fp_dtw import FpExperiment
from motionary.workflows.reproduce.fp_dtw_measures import (
    ALGORITHMS,
    DTW,
    IMPERCEPTIBLE,
    MATCHING_WINDOW,
    UTW,
    WINDOWS,
    Algorithm,
    FpStudy,
)
from motionary.workflows.tables import text_table

TABLE_1: Mapping[int, Mapping[str, float]] = {
    60: {"Mc w10": 0.133, "Mc w20": 0.281, "Mc w40": 0.178, "Mc w80": 0.068, UTW: 0.242},
    120: {"Mc w10": 0.053, "Mc w20": 0.200, "Mc w40": 0.285, "Mc w80": 0.146, UTW: 0.240},
}
"""Median similarity of method C, by rate."""

TABLE_2: Mapping[str, float] = {
    "Mb w10": 856, "Mb w20": 1654, "Mb w40": 4806, "Mb w80": 16945,
    "Mc w10": 782, "Mc w20": 1583, "Mc w40": 4764, "Mc w80": 10106,
}  # fmt: skip
"""Mean microseconds a frame, on a core of 3.58 to 3.95 GHz."""

IN_THE_PAPER = [str(one) for one in ALGORITHMS if one.method != "A" or one.window == MATCHING_WINDOW]
PASS_BOTH = ("Mc w40", "Ma + Type V", "Mc w80 + Type V")

_LEGEND = (
    "Medians over pairs. Similarity: mean over the coordinates of joint trajectories of Kendall's tau "
    "(eq. 2), better where it is above UTW's.\n"
    "Deviation: mean distance from DTW's path in frames of the prerecorded take (eq. 3), better where it is "
    "under 150 ms; ahead: the same with its\n"
    "sign, below 0 where the warp stays behind DTW (sticks), above 0 where it runs ahead (skips). Ma has a "
    "window of 2; with wider ones it is not in the paper.\n"
    "To Ma under Type V all windows from 3 on are one, and w10 stands for them."
)


def fp_dtw_report(experiment: FpExperiment) -> RenderableType:
    """Lay the experiment out for reading; all its numbers are `FpStudy.to_arrow`."""
    study = experiment.study
    parts: list[RenderableType] = list(experiment.notes)
    for rate in study.rates:
        parts += ["", _algorithms_table(study, rate)]
    parts += [_LEGEND, "", _claims_table(study), "", _table_1(study), "", _table_2(study)]
    return Group(*parts)


def passing(study: FpStudy, rate: int) -> pd.DataFrame:
    """Tell which algorithms pass the paper's marks: a row each, columns `similarity` and `deviation`."""
    medians = study.medians(rate)
    passed = {
        "similarity": medians["similarity"] > medians.loc[UTW, "similarity"],
        "deviation": medians["deviation"] < IMPERCEPTIBLE * rate,
    }
    return pd.DataFrame(passed).drop(index=[UTW, DTW])


def improved(study: FpStudy, rate: int) -> list[str]:
    """List the algorithms that Type V brings nearer to the target and to DTW, both."""
    medians = study.medians(rate)
    similarity, deviation = medians["similarity"].to_dict(), medians["deviation"].to_dict()
    pairs = [(str(one._replace(type_v=False)), str(one)) for one in ALGORITHMS if one.type_v]
    return [
        free
        for free, bound in pairs
        if similarity[bound] > similarity[free] and deviation[bound] < deviation[free]
    ]


def _algorithms_table(study: FpStudy, rate: int) -> RenderableType:
    passed = passing(study, rate).to_dict("index")
    rows = []
    for name, figures in study.medians(rate).to_dict("index").items():
        marks = ["", "", ""]
        if name in passed:
            similar, near = passed[name]["similarity"], passed[name]["deviation"]
            marks = [_yes(similar), _yes(near), _yes(similar and near)]
        rows.append(
            [
                str(name),
                f"{figures['similarity']:.3f}",
                marks[0],
                f"{figures['deviation']:.1f}",
                marks[1],
                f"{figures['ahead']:+.1f}",
                marks[2],
                _paper_says(str(name), rate),
            ]
        )
    limit = f"under {IMPERCEPTIBLE * rate:g}"
    headings = ["algorithm", "similarity", "above UTW", "deviation", limit, "ahead", "both", "both, paper"]
    pairs = len(study.pairs(rate, "similarity"))
    return text_table(headings, rows, f"At {rate} frames a second, {pairs} pairs (Figures 5 and 6)")


def _paper_says(name: str, rate: int) -> str:
    """Say whether the paper has an algorithm pass both marks; it tells that at its own rate only."""
    return _yes(name in PASS_BOTH) if rate == max(TABLE_1) and name in IN_THE_PAPER else ""


def _claims_table(study: FpStudy) -> RenderableType:
    rate = study.rates[0]
    medians, passed = study.medians(rate), passing(study, rate)
    passed = passed.loc[[name for name in IN_THE_PAPER if name in passed.index]]
    free = passed[~passed.index.str.contains("Type V")]
    better = improved(study, rate)
    of_a_b = [name for name in IN_THE_PAPER if name[:2] in ("Ma", "Mb") and "Type" not in name]
    ahead = medians["ahead"]
    online = medians.loc[passed.index, "similarity"]
    rows = [
        ["passes one mark, unconstrained", "Mc w40", _names(free.index[free.any(axis=1)])],
        ["passes both marks", _names(PASS_BOTH), _names(passed.index[passed.all(axis=1)])],
        ["best window of C at 120 a second", "w40", _best_window(study, 120)],
        ["best window of C at 60 a second", "w20", _best_window(study, 60)],
        ["B improves with its window", "yes", _yes(_improves_with_window(medians, "B"))],
        ["Type V improves all of A and B", "yes", _all_but(of_a_b, better)],
        ["Type V improves of C", "Mc w80", _names(name for name in better if name.startswith("Mc"))],
        ["stick (below 0)", "Mb w10, Mb w80, Mc w10", _leaning(ahead, ("Mb w10", "Mb w80", "Mc w10"))],
        ["skips (above 0)", "Mc w80", _leaning(ahead, ("Mc w80",))],
        ["DTW is above all online", "expected", _yes(medians.loc[DTW, "similarity"] > online.max())],
    ]  # fmt: skip
    title = f"What the paper concludes, and what is found here at {rate} frames a second"
    return text_table(["claim", "paper", "here"], rows, title)


def _table_1(study: FpStudy) -> RenderableType:
    rows = []
    for rate, paper in TABLE_1.items():
        ours = study.medians(rate)["similarity"] if rate in study.rates else None
        cells = []
        for name, published in paper.items():
            cells += ["-" if ours is None else f"{ours[name]:.3f}", f"{published:.3f}"]
        rows.append([str(rate), *cells])
    headings = [heading for name in TABLE_1[60] for heading in (name, "paper")]
    return text_table(["rate", *headings], rows, "Median similarity of method C by rate (Table 1)")


def _table_2(study: FpStudy) -> RenderableType:
    rate = study.rates[0]
    took = study.medians(rate)["microseconds"]
    rows = []
    for method in ("B", "C"):
        names = [str(Algorithm(method, window, False)) for window in WINDOWS]
        cells = [cell for name in names for cell in (f"{took[name]:.0f}", f"{TABLE_2[name]:.0f}")]
        rows.append([f"Method {method}", *cells])
    headings = [heading for window in WINDOWS for heading in (f"w{window}", "paper")]
    late = [str(name) for name in took.index[took >= 1e6 / rate]]
    title = (
        f"Mean microseconds a live frame at {rate} a second, without a constraint (Table 2). "
        f"Slower than the {1e6 / rate:.0f} that a frame lasts: {_names(late)}"
    )
    return text_table(["", *headings], rows, title)


def _best_window(study: FpStudy, rate: int) -> str:
    if rate not in study.rates:
        return "not tested"
    names = [f"Mc w{window}" for window in WINDOWS]
    return str(study.medians(rate).loc[names, "similarity"].idxmax()).removeprefix("Mc ")


def _improves_with_window(medians: pd.DataFrame, method: str) -> bool:
    """Tell whether every wider window is at least as near to the target and to DTW as the one before."""
    some = medians.loc[[f"M{method.lower()} w{window}" for window in WINDOWS]]
    nearer = some["similarity"].is_monotonic_increasing and some["deviation"].is_monotonic_decreasing
    return bool(nearer)


def _all_but(names: Iterable[str], better: Iterable[str]) -> str:
    missing = [name for name in names if name not in set(better)]
    return f"no: not {_names(missing)}" if missing else "yes"


def _leaning(ahead: pd.Series, names: Iterable[str]) -> str:
    """Say of algorithms how far ahead of DTW they are, in the median."""
    return ", ".join(f"{name} {ahead[name]:+.1f}" for name in names)


def _names(names: Iterable[str]) -> str:
    return ", ".join(map(str, names)) or "none"


def _yes(value: object) -> str:
    return "yes" if value else "no"
