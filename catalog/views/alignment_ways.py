"""Chart of an alignment: joints' ways before and after, beside the reference's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from motionary.catalog.views.aligned_pair import DIRECTIONS, STRETCHED, AlignedPair, Take
from motionary.catalog.views.alignment_lines import MOST_SHOWN, PLAIN, legend, method_style
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, COLOURS
from motionary.catalog.views.line_styles import LineStyle
from motionary.catalog.views.trajectory_chart import correlation
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

Way = tuple[str, int]
"""A canonical joint, and one of `DIRECTIONS`."""

_ENDS = ("head", "left_wrist", "right_wrist", "left_toe", "right_toe")
_PANEL, _GAP, _AROUND = 150, 72, 120  # pixels: of a panel, between two, for legend and axis


def ways_figure(pair: AlignedPair, ways: Sequence[Way]) -> go.Figure:
    """Draw joints of a motion before and after its alignment, beside the reference's.

    Parameters
    ----------
    pair : AlignedPair
    ways : sequence of Way
        A panel each; see `liveliest_ways`.

    Returns
    -------
    plotly Figure
        Leg lengths on the seconds of the reference.
    """
    import plotly.graph_objects as go

    figure = go.Figure()
    height = len(ways) * (_PANEL + _GAP)
    for panel, (joint, direction) in enumerate(ways):
        reference, moving = (take.joint(joint)[:, direction] for take in (pair.reference, pair.moving))
        shown = {name: warp.apply(moving) for name, warp in pair.warps.items()}
        before = pair.stretched.apply(moving)
        figure.add_traces(_lines(pair, panel, reference, before, shown))
        top = 1 - panel * (_PANEL + _GAP) / height
        axis = {**AXIS, "domain": [top - (_PANEL + _GAP / 4) / height, top - _GAP * 3 / 4 / height]}
        figure.update_layout({f"yaxis{panel + 1}": {**axis, "title": "leg lengths", "showline": True}})
        figure.add_annotation(
            text=_told(joint, direction, reference, before, shown),
            xref="paper",
            yref="paper",
            x=0,
            y=top,
            xanchor="left",
            yanchor="top",
            align="left",
            showarrow=False,
        )
    figure.update_layout(
        **CHART,
        height=height + _AROUND,
        margin={"l": 60, "r": 20, "t": 10, "b": 60},
        legend=legend(-52 / height),
        xaxis={
            **AXIS,
            "title": f"seconds of {short_text(pair.short_names[1], 24)}",
            "anchor": f"y{len(ways)}",
            "showline": True,
        },
    )
    return figure


def liveliest_ways(take: Take, count: int = 3) -> list[Way]:
    """Choose of head, hands and feet those that move most, each in the direction in which it does."""
    spread = np.array([take.joint(joint).std(axis=0) for joint in _ENDS])
    order = np.argsort(-spread.max(axis=1), kind="stable")[:count]
    return [(_ENDS[one], int(spread[one].argmax())) for one in order]


def _lines(
    pair: AlignedPair, panel: int, reference: FloatArray, before: FloatArray, shown: dict[str, FloatArray]
) -> list[go.Scatter]:
    import plotly.graph_objects as go

    seconds = (np.arange(len(reference)) / pair.rate).astype(np.float32)
    drawn = [
        ("the reference", reference, LineStyle(COLOURS[0], "solid", "circle")),
        (STRETCHED, before, PLAIN),
        *(
            (name, values, method_style(number))
            for number, (name, values) in enumerate(shown.items(), start=1)
        ),
    ]
    return [
        go.Scatter(
            x=seconds,
            y=values.astype(np.float32),
            yaxis=f"y{panel + 1 if panel else ''}",
            name=name,
            legendgroup=name,
            showlegend=panel == 0,
            visible=True if place < 2 + MOST_SHOWN else "legendonly",
            mode="lines" if len(values) > 1 else "markers",
            line={"color": style.colour, "dash": style.dash, "width": 2 if place else 5},
            opacity=1 if place else 0.55,
            hovertemplate="%{y:.3f} leg lengths at %{x:.2f} s",
        )
        for place, (name, values, style) in enumerate(drawn)
    ]


def _told(
    joint: str, direction: int, reference: FloatArray, before: FloatArray, shown: dict[str, FloatArray]
) -> str:
    """Say whose way a panel shows, and how it agrees with the reference's."""
    agreements = {
        name: correlation(values, reference)
        for name, values in ({"stretched": before} | dict([*shown.items()][:MOST_SHOWN])).items()
    }
    known = [f"{name} {round(value, 2) + 0.0:.2f}" for name, value in agreements.items() if value is not None]
    # Two are what fits beside each other on a phone.
    told = "<br>".join("; ".join(known[first : first + 2]) for first in range(0, len(known), 2))
    whose = f"<b>{joint.replace('_', ' ')}, {DIRECTIONS[direction]}</b>"
    return f"{whose}<br>{told or 'still, no correlation'}"
