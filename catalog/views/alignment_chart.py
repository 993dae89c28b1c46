"""Chart of an alignment: the warps over the costs.

Time runs to the right in the reference and up in the moving motion, so that motions that keep pace follow a
rising diagonal. Of a method that makes a path that is drawn, of another the moment shown at each reference
frame. Costs are distances of poses, whatever a method reads. A matrix of more than `cost_matrix.MOST_FRAMES`
frames a side is drawn in blocks, each in its mean; warps are drawn frame by frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.views.aligned_pair import STRETCHED, AlignedPair, Take
from motionary.catalog.views.alignment_lines import PLAIN, legend, method_style
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.cost_matrix import MOST_FRAMES, mean_of_blocks
from motionary.catalog.views.line_styles import LineStyle
from motionary.pipeline.alignment.path_warp import PathWarp
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.distances import cost_matrix
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

_COSTS = [(0.0, "#16202e"), (0.5, "#4d7ea8"), (1.0, "#f5f3ee")]
_DARK = "#10151c"


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

    heat = _costs(pair)
    figure = go.Figure(heat)
    figure.add_traces(_over_costs(STRETCHED, pair.stretched, pair.rate, PLAIN))
    for number, (name, warp) in enumerate(pair.warps.items(), start=1):
        figure.add_traces(_over_costs(name, warp, pair.rate, method_style(number)))
    figure.update_layout(
        **CHART,
        height=680,
        margin={"l": 60, "r": 20, "t": 70, "b": 60},
        legend=legend(-0.11),
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


def _costs(pair: AlignedPair) -> go.Heatmap:
    """Draw the distances of all poses of one from all of the other, long motions in blocks."""
    import plotly.graph_objects as go

    costs = cost_matrix(pair.moving.pose, pair.reference.pose)
    rows, columns = (-(-length // MOST_FRAMES) for length in costs.shape)
    blocks = f"leg lengths, mean of {rows} × {columns} frames"
    costs_are = "distance of poses, leg lengths" if rows == columns == 1 else blocks
    return go.Heatmap(
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


def _within(edges: FloatArray) -> dict[str, Any]:
    return {**AXIS, "showgrid": False, "range": [edges[0], edges[-1]]}


def _edges(take: Take, block: int, rate: float) -> FloatArray:
    """When every block of frames begins, and when the last one ends (blocks + 1,)."""
    return (np.append(np.arange(0, len(take.pose), block), len(take.pose)) - 0.5) / rate


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
            line=line | ({"color": "#ffffff"} if style is PLAIN else {}),
            marker=marker,
            hovertemplate=hover,
            showlegend=False,
        ),
        # A white line does not show in the legend of a white page: a grey one stands for it there.
        go.Scatter(x=[None], y=[None], name=name, legendgroup=name, mode="lines", line=line),
    ]
