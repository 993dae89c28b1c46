"""DTW-Curves: S-DTW of pairs of clips over the threshold lambda [DC figure 8].

A curve that runs above another tells of clips that are less alike, though both may end at the same distance:
at lambda = 1 stands B-DTW, all that plain time warping knows. Beside the curves stand the two distances that
are made of one: the fuzzy distance, from its least to its greatest value [DC eq. 10], and the weighted one
[DC eq. 7-8]. That is a sum over weights that do not add up to 1, and so may lie outside the fuzzy band.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from motionary.catalog.explanation import Explanation
from motionary.catalog.views.chart_text import full_text, short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.line_styles import line_style

if TYPE_CHECKING:
    import plotly.graph_objects as go


def curve_figure(explanations: Sequence[Explanation]) -> go.Figure:
    """Draw the DTW-Curves of pairs.

    Parameters
    ----------
    explanations : sequence of Explanation
        One a pair, from `Catalog.explain`; they are numbered from 1.

    Returns
    -------
    plotly Figure
        Left the curves, right each pair's fuzzy band with its weighted distance.

    Raises
    ------
    ValueError
        No pair is given.
    """
    import plotly.graph_objects as go

    if not explanations:
        raise ValueError("no pair is given; curve_figure draws one or more")
    figure = go.Figure()
    for number, one in enumerate(explanations, start=1):
        figure.add_traces([_curve(number, one), *_band(number, one)])
    _arrange(figure, explanations)
    return figure


def _curve(number: int, one: Explanation) -> go.Scatter:
    import plotly.graph_objects as go

    style = line_style(number)
    pair = f"{full_text(one.a.name)}<br>{full_text(one.b.name)}"
    return go.Scatter(
        x=[point.threshold for point in one.curve],
        y=[point.distance for point in one.curve],
        name=f"{number}: {short_text(one.a.name)}<br>    {short_text(one.b.name)}",
        legendgroup=str(number),
        mode="lines+markers",
        line={"color": style.colour, "dash": style.dash, "width": 2},
        marker={"symbol": style.symbol, "size": 8},
        cliponaxis=False,
        hoverinfo="text",
        hovertext=[
            f"{pair}<br>λ = {point.threshold:.3g}: S-DTW {point.distance:.4g}, times {point.weight:.3g}"
            f"<br>{sum(zone.chosen for zone in point.zones)} of {len(point.zones)} similar zones"
            for point in one.curve
        ],
    )


def _band(number: int, one: Explanation) -> list[go.Scatter]:
    """Draw the fuzzy distance as an upright bar, the weighted one as the pair's mark on a level line."""
    import plotly.graph_objects as go

    low, high = one.distances["fuzzy_low"], one.distances["fuzzy_high"]
    style, place = line_style(number), str(number)
    beside = {"xaxis": "x2", "legendgroup": place, "showlegend": False, "hoverinfo": "text"}
    fuzzy = go.Scatter(
        x=[place, place],
        y=[low, high],
        mode="lines+markers",
        line={"color": style.colour, "width": 10},
        opacity=0.45,
        marker={"symbol": "line-ew", "size": 18, "line": {"color": style.colour, "width": 2}},
        hovertext=f"pair {number}: fuzzy distance {low:.4g} to {high:.4g}",
        **beside,
    )
    weighted = one.distances["weighted"]
    mark = go.Scatter(
        x=[place],
        y=[weighted],
        mode="markers",
        marker={
            "symbol": style.symbol,
            "color": style.colour,
            "size": 12,
            "line": {"color": GREY, "width": 1.5},
        },
        hovertext=f"pair {number}: weighted distance {weighted:.4g}",
        **beside,
    )
    return [fuzzy, mark]


def _arrange(figure: go.Figure, explanations: Sequence[Explanation]) -> None:
    figure.update_layout(
        **CHART,
        height=430 + 34 * len(explanations),
        margin={"l": 60, "r": 20, "t": 30, "b": 60},
        legend={"orientation": "h", "y": -0.2, "yanchor": "top"},
    )
    figure.add_annotation(
        text="fuzzy band, weighted marked",
        xref="x2 domain",
        yref="paper",
        x=0.5,
        y=1,
        yanchor="bottom",
        showarrow=False,
    )
    figure.update_layout(_axes(explanations))


def _axes(explanations: Sequence[Explanation]) -> dict[str, Any]:
    thresholds = [point.threshold for point in explanations[0].curve]
    greatest = max(max(one.distances.values()) for one in explanations)
    along = {
        "title": "threshold λ",
        "domain": [0, 0.74],
        "range": [min(0.3, *thresholds), 1.02],
        "tickvals": thresholds,
        "tickformat": ".2~f",
    }
    pairs = {
        "title": "pair",
        "domain": [0.78, 1],
        "type": "category",
        "range": [-0.7, len(explanations) - 0.3],
    }
    upwards = {"title": "S-DTW (about leg lengths)", "range": [0, 1.08 * greatest or 1]}
    axes: dict[str, dict[str, Any]] = {"xaxis": along, "xaxis2": pairs, "yaxis": upwards}
    return {name: {**AXIS, **axis, "showline": True} for name, axis in axes.items()}
