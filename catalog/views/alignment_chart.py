"""Charts of one motion aligned to another: warps over the costs, and joints' ways before and after.

Time runs to the right in the reference and up in the moving motion, so that motions that keep pace follow a
rising diagonal. Of a method that makes a path that is drawn, of another the moment shown at each reference
frame. Costs are distances of poses, whatever a method reads. A matrix of more than `cost_matrix.MOST_FRAMES`
frames a side is drawn in blocks, each in its mean; warps are drawn frame by frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.views.aligned_pair import DIRECTIONS, STRETCHED, AlignedPair, Take
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, COLOURS, GREY
from motionary.catalog.views.cost_matrix import MOST_FRAMES, mean_of_blocks
from motionary.catalog.views.line_styles import LineStyle, line_style
from motionary.catalog.views.trajectory_chart import correlation
from motionary.pipeline.alignment.path_warp import PathWarp
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.distances import cost_matrix
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

Way = tuple[str, int]
"""A canonical joint, and one of `DIRECTIONS`."""

MOST_SHOWN = 3
"""Methods whose lines are drawn at first, and who play; the others' wait in the legend."""

_ENDS = ("head", "left_wrist", "right_wrist", "left_toe", "right_toe")
_COSTS = [(0.0, "#16202e"), (0.5, "#4d7ea8"), (1.0, "#f5f3ee")]
_DARK = "#10151c"
_PLAIN = LineStyle(GREY, "dot", "circle")
_PANEL, _GAP, _AROUND = 150, 72, 120  # pixels: of a panel, between two, for legend and axis


def warps_figure(pair: AlignedPair) -> go.Figure:
    """Draw the warps of a pair over the costs of its poses, and the diagonal of one only stretched.

    Parameters
    ----------
    pair : AlignedPair

    Returns
    -------
    plotly Figure
        Seconds on both axes.
    """
    import plotly.graph_objects as go

    costs = cost_matrix(pair.moving.pose, pair.reference.pose)
    rows, columns = (-(-length // MOST_FRAMES) for length in costs.shape)
    blocks = f"leg lengths, mean of {rows} × {columns} frames"
    costs_are = "distance of poses, leg lengths" if rows == columns == 1 else blocks
    heat = go.Heatmap(
        x=_edges(pair.reference, columns, pair.rate),
        y=_edges(pair.moving, rows, pair.rate),
        z=mean_of_blocks(costs, rows, columns),
        zmin=float(costs.min()),
        zmax=float(costs.max()),
        colorscale=_COSTS,
        colorbar={
            "title": {"text": costs_are, "side": "top"},
            "orientation": "h",
            "thickness": 10,
            "len": 0.7,
            "y": 1.02,
            "yanchor": "bottom",
            "outlinecolor": GREY,
            "outlinewidth": 1,
        },
        hovertemplate="%{y:.2f} s with %{x:.2f} s of the reference: %{z:.4f}<extra></extra>",
    )
    figure = go.Figure(heat)
    figure.add_traces(_over_costs(STRETCHED, pair.stretched, pair.rate, _PLAIN))
    for number, (name, warp) in enumerate(pair.warps.items(), start=1):
        figure.add_traces(_over_costs(name, warp, pair.rate, _style(number)))
    figure.update_layout(
        **CHART,
        height=680,
        margin={"l": 60, "r": 20, "t": 70, "b": 60},
        legend=_legend(-0.11),
        xaxis=_within(heat.x),
        yaxis=_within(heat.y) | {"title": f"seconds of {short_text(pair.short_names[0])}"},
    )
    # Not the axis' title, which Plotly misplaces below colours when a page gives the chart more room.
    figure.add_annotation(
        text=f"seconds of {short_text(pair.short_names[1], 24)}",
        xref="paper",
        yref="paper",
        x=0.5,
        y=0,
        yshift=-24,
        yanchor="top",
        showarrow=False,
        font={"size": 14},
    )
    return figure


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
        legend=_legend(-52 / height),
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


def _within(edges: FloatArray) -> dict[str, Any]:
    return {**AXIS, "showgrid": False, "range": [edges[0], edges[-1]]}


def _edges(take: Take, block: int, rate: float) -> FloatArray:
    """When every block of frames begins, and when the last one ends (blocks + 1,)."""
    return (np.append(np.arange(0, len(take.pose), block), len(take.pose)) - 0.5) / rate


def _style(number: int) -> LineStyle:
    """Return the style of a method's line, from 1; the player gives the first ones the same colours."""
    others = COLOURS[1:]  # the first, which is the reference's, does not show on dark costs
    turn, place = divmod(number - 1, len(others))
    usual = line_style(number + turn)  # the next time round another dash
    return LineStyle(others[place], usual.dash, usual.symbol)


def _over_costs(name: str, warp: Warp, rate: float, style: LineStyle) -> list[go.Scatter]:
    """Draw a warp, bright over dark, so that it shows on any cost; the plain one is white there."""
    import plotly.graph_objects as go

    if isinstance(warp, PathWarp):
        shown, at = warp.path.T / rate
    else:
        shown, at = warp.source_time / rate, np.arange(warp.reference_frames) / rate
    shared: dict[str, Any] = {
        "x": at.astype(np.float32),
        "y": shown.astype(np.float32),
        "mode": "lines" if len(at) > 1 else "markers",
        "legendgroup": name,
    }
    line = {"color": style.colour, "dash": style.dash, "width": 2.5}
    hover = "%{y:.2f} s of it at %{x:.2f} s of the reference"
    marker = {"color": style.colour, "symbol": style.symbol, "size": 9}
    return [
        go.Scatter(**shared, line={"color": _DARK, "width": 5}, hoverinfo="skip", showlegend=False),
        go.Scatter(
            **shared,
            name=name,
            line=line | ({"color": "#ffffff"} if style is _PLAIN else {}),
            marker=marker,
            hovertemplate=hover,
            showlegend=False,
        ),
        # A white line does not show in the legend of a white page: a grey one stands for it there.
        go.Scatter(x=[None], y=[None], name=name, legendgroup=name, mode="lines", line=line),
    ]


def _lines(
    pair: AlignedPair, panel: int, reference: FloatArray, before: FloatArray, shown: dict[str, FloatArray]
) -> list[go.Scatter]:
    import plotly.graph_objects as go

    seconds = (np.arange(len(reference)) / pair.rate).astype(np.float32)
    drawn = [
        ("the reference", reference, LineStyle(COLOURS[0], "solid", "circle")),
        (STRETCHED, before, _PLAIN),
        *((name, values, _style(number)) for number, (name, values) in enumerate(shown.items(), start=1)),
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


def _legend(y: float) -> dict[str, Any]:
    return {"orientation": "h", "y": y, "yanchor": "top", "bgcolor": "rgba(0,0,0,0)"}
