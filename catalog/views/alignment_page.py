"""One page of one motion aligned to another: the scores, both playing, warps over the costs, joints' ways.

It needs nothing from outside itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
import pyarrow as pa

from motionary.catalog.views.aligned_pair import AlignedPair
from motionary.catalog.views.alignment_chart import warps_figure
from motionary.catalog.views.alignment_lines import MOST_SHOWN
from motionary.catalog.views.alignment_ways import Way, liveliest_ways, ways_figure
from motionary.catalog.views.charts import chart_html, plotly_script
from motionary.catalog.views.figure_body import by_joint, canonical_body, joints_between
from motionary.catalog.views.figure_data import Figure
from motionary.catalog.views.figures import figure_of, scene
from motionary.catalog.views.page import Cell, details, facts, isolated, page, section, table
from motionary.catalog.views.player import player_html, player_script
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.style.residual import pose_differences

_REFERENCE = "reference"
# A wide table is scrolled by keys too, which needs a place that takes the focus.
_STYLE = ".keys { overflow-x: auto; } .keys .wide { overflow: visible; }"


def alignment_page(
    pair: AlignedPair, scores: pa.Table, refused: Mapping[str, str], ways: Sequence[Way] | None = None
) -> str:
    """Show an alignment on one HTML page.

    Parameters
    ----------
    pair : AlignedPair
    scores : pyarrow.Table
        A row a method; fields tell their meaning and unit, see `motionary.pipeline.tables.table_field`.
    refused : mapping of str to str
        Methods that could not align the two, and why.
    ways : sequence of Way, optional
        The joints and directions that are drawn; those that move most where left out.

    Returns
    -------
    str
        HTML with everything it needs inside, Plotly's script included.
    """
    return page(
        " in the time of ".join(pair.short_names),
        [
            _heading(pair),
            _scores_section(scores, refused),
            _player_section(pair),
            _warps_section(pair),
            _ways_section(pair, ways),
            player_script(),
        ],
        head=f"<style>{_STYLE}</style>\n{plotly_script()}",
    )


def _heading(pair: AlignedPair) -> str:
    figures = facts(
        [
            ("seconds", f"{(len(pair.moving.pose) - 1) / pair.rate:.2f}"),
            ("seconds of the reference", f"{(len(pair.reference.pose) - 1) / pair.rate:.2f}"),
            ("frames a second", f"{pair.rate:g}"),
        ]
    )
    names = [isolated(name).text for name in pair.short_names]
    return f'<h1>{names[0]}</h1>\n<p class="quiet">in the time of {names[1]}, the reference</p>\n{figures}'


def _scores_section(scores: pa.Table, refused: Mapping[str, str]) -> str:
    columns: list[str] = []
    meanings: list[list[Cell]] = []
    for field in scores.schema:
        told = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        unit = f", {told['unit']}" if told.get("unit") else ""
        name = field.name.replace("_", " ")
        columns.append(f"{name}{unit}")
        meanings.append([name, told["meaning"]])
    rows = [list(row.values()) for row in scores.to_pylist()]
    return section(
        "Scores",
        "Higher correlation and lower distance say that a method brings the two together; the other columns "
        "say at what cost. The first row is the motion only stretched to the reference's length.",
        f'<div class="keys" tabindex="0" role="region" aria-label="Scores">{table(columns, rows)}</div>',
        details("What the columns are", table(["column", "is"], meanings)),
        details(f"Left out: {len(refused)}", table(["method", "since"], [[*one] for one in refused.items()]))
        if refused
        else "",
        name="scores",
    )


def _player_section(pair: AlignedPair) -> str:
    shown = dict(islice(pair.shown.items(), MOST_SHOWN))
    figures = [_reference_figure(pair), *(_moving_figure(pair, name, warp) for name, warp in shown.items())]
    every = len(shown) == len(pair.shown)
    left_out = "" if every else f" Only the {MOST_SHOWN} of greatest correlation play here."
    return section(
        "Playing",
        "The reference, then the other as each method shows it in the reference's time. Without Aligned each "
        f"plays in its own time; Residual colours the joints by how far they are off.{left_out}",
        player_html(scene(figures, aligned=True), name="player"),
        name="playing",
    )


def _reference_figure(pair: AlignedPair) -> Figure:
    motion = pair.reference.motion
    body = canonical_body(motion.skeleton, pair.conventions)
    figure = figure_of(
        motion,
        name=pair.short_names[1],
        joints=joints_between(motion.skeleton, body),
        conventions=pair.conventions,
    )
    return replace(figure, clip_id=_REFERENCE)


def _moving_figure(pair: AlignedPair, method: str, warp: Warp) -> Figure:
    motion = pair.moving.motion
    body = canonical_body(motion.skeleton, pair.conventions)
    off = np.linalg.norm(pose_differences(warp.apply(pair.moving.pose), pair.reference.pose), axis=2)
    figure = figure_of(
        motion,
        name=method,
        warp=warp,
        warp_rate=pair.rate,
        residual=by_joint(off, motion.skeleton, body),
        joints=joints_between(motion.skeleton, body),
        conventions=pair.conventions,
    )
    return replace(figure, label=pair.short_names[0], reference=_REFERENCE)


def _warps_section(pair: AlignedPair) -> str:
    return section(
        "Warps over the costs",
        "How far the pose at each moment of it is from that at each moment of the reference, dark where they "
        "are alike; over it which moments each method brings together.",
        chart_html(warps_figure(pair), "warps-chart"),
        name="warps",
    )


def _ways_section(pair: AlignedPair, ways: Sequence[Way] | None) -> str:
    more = len(pair.warps) > MOST_SHOWN
    return section(
        "Before and after",
        "Where joints are, seen from the pelvis in the figure's own heading and up from the floor: of the "
        "reference, of the other when it is only stretched to the reference's length, and aligned. Numbers "
        "are correlations with the reference."
        + (" Press a method in the legend to draw it." if more else ""),
        chart_html(ways_figure(pair, ways or liveliest_ways(pair.reference)), "ways-chart"),
        name="ways",
    )
