"""The FP-DTW experiment in a terminal, beside the paper's figures and what it concludes from them.

**[FP]** Randall, Harvey, Williams, *Online alignment of human motion using forward plotting-DTW*, CAVW 34
(2023): Tables 1 and 2. Its Figures 5 and 6, the medians of all algorithms, are pictures; what the text says
of them is in `fp_dtw_claims.py`.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

from rich.console import Group, RenderableType

from motionary.workflows.reproduce.claims import claims_table
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.fp_dtw_claims import IN_THE_PAPER, PASS_BOTH, claims, passing
from motionary.workflows.reproduce.fp_dtw_measures import IMPERCEPTIBLE, UTW, WINDOWS, Algorithm, FpStudy
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

_LEGEND = (
    "Medians over pairs. Similarity: mean over the coordinates of joint trajectories of Kendall's tau\n"
    "(eq. 2), better where it is above UTW's. Deviation: mean distance from DTW's path in frames of the\n"
    "prerecorded take (eq. 3), better where it is under 150 ms; ahead: the same with its sign, below 0\n"
    "where the warp stays behind DTW (sticks), above 0 where it runs ahead (skips). Ma has a window of 2;\n"
    "with wider ones it is not in the paper. To Ma under Type V all windows from 3 on are one, and w10\n"
    "stands for them."
)


def fp_dtw_report(experiment: Conducted[FpStudy]) -> RenderableType:
    """Lay the experiment out for reading; all its numbers are `FpStudy.to_arrow`."""
    study = experiment.study
    parts: list[RenderableType] = list(experiment.notes)
    for rate in study.rates:
        parts += ["", _algorithms_table(study, rate)]
    title = f"What the paper concludes, held against the medians at {study.rates[0]} frames a second"
    parts += [_LEGEND, "", claims_table(claims(study), title), "", _table_1(study), "", _table_2(study)]
    return Group(*parts)


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
    title = f"Mean microseconds a live frame at {rate} a second, without a constraint (Table 2)."
    slower = f"Slower than the {1e6 / rate:.0f} that a frame lasts: {', '.join(late) or 'none'}"
    return text_table(["", *headings], rows, f"{title}\n{textwrap.fill(slower, 110)}")


def _yes(value: object) -> str:
    return "yes" if value else "no"
