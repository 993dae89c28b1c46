"""The mu-kappa chart: how many clusters each threshold leaves, for every distance [DC figure 9].

Below the curves each distance has a row with its threshold strips, so that their widths can be compared: the
paper's argument for its distances.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.query import Catalog
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.line_styles import line_style
from motionary.catalog.views.linkages import linkages_by_distance
from motionary.catalog.views.threshold_band import band_trace, strip_bars
from motionary.pipeline.clustering import threshold_strips

if TYPE_CHECKING:
    import plotly.graph_objects as go

_LAST_MU = 1.05
_ROW_PIXELS = 26
_CURVE_PIXELS = 370
_MARGIN = {"l": 60, "r": 20, "t": 20, "b": 50}


def mu_kappa_figure(catalog: Catalog) -> go.Figure | None:
    """Draw the number of clusters kappa against the threshold mu, with each distance's threshold strips.

    Distances have different units, so that each one's mu is divided by its greatest merge. kappa is drawn
    on a logarithmic scale, the paper's is linear: the few clusters that matter would lie on the axis.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.

    Returns
    -------
    plotly Figure or None
        None where there is nothing to draw: fewer than two clips.
    """
    import plotly.graph_objects as go

    curves = [one for one in linkages_by_distance(catalog) if len(one.Z)]
    if not curves:
        return None
    figure = go.Figure()
    for number, one in enumerate(curves, start=1):
        style = line_style(number)
        metric, unit = one.cut["metric"], one.Z[-1, 2] or 1.0
        mu, kappa = steps(one.Z)
        figure.add_scatter(
            x=mu.astype(np.float32),
            y=kappa.astype(np.float32),
            name=f"{metric} ({one.cut['method']})",
            legendgroup=metric,
            mode="lines",
            line={"color": style.colour, "dash": style.dash, "width": 2, "shape": "hv"},
            hovertemplate=f"{metric}: %{{y}} clusters from μ = %{{x:.3f}}<extra></extra>",
        )
        bars = strip_bars(one.Z, _LAST_MU * unit)
        figure.add_trace(band_trace(bars, metric, unit, style.colour, yaxis="y2", legendgroup=metric))
    published = len(catalog.references)
    figure.add_scatter(
        x=[0, _LAST_MU],
        y=[published] * 2,
        name=f"published: {published} clusters",
        mode="lines",
        line={"color": GREY, "width": 1},
        hoverinfo="skip",
    )
    _arrange(figure, len(curves[0].Z) + 1, len(curves))
    return figure


def steps(Z: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """List where each number of clusters begins, mu divided by the greatest merge.

    Parameters
    ----------
    Z : array (N - 1, 4)
        SciPy linkage matrix.

    Returns
    -------
    mu : array (strips + 1,)
        Rising from 0; the last strip is drawn to a little over the greatest merge.
    kappa : array (strips + 1,)
        Clusters from that mu on.
    """
    strips = threshold_strips(Z)
    mu = strips["mu_low"].to_numpy() / (Z[-1, 2] or 1.0)
    kappa = strips["kappa"].to_numpy().astype(np.float64)
    return np.append(mu, _LAST_MU), np.append(kappa, kappa[-1])


def _arrange(figure: go.Figure, clips: int, rows: int) -> None:
    band = _ROW_PIXELS * rows
    share = band / (band + _CURVE_PIXELS)
    figure.update_layout(
        **CHART,
        height=band + _CURVE_PIXELS + _MARGIN["t"] + _MARGIN["b"],
        margin=_MARGIN,
        legend={"tracegroupgap": 10},
        barmode="overlay",
    )
    figure.update_xaxes(
        **AXIS, title="threshold μ / greatest merge", range=[0, _LAST_MU], showline=True, anchor="y2"
    )
    figure.update_yaxes(
        **AXIS,
        title="clusters κ",
        type="log",
        tickvals=[digit * 10**power for power in range(6) for digit in (1, 2, 5)],
        range=[np.log10(0.9), np.log10(1.1 * clips)],
        showline=True,
        domain=[share + 0.03, 1],
    )
    figure.update_layout(
        yaxis2={"domain": [0, share], "fixedrange": True, "type": "category", "range": [rows - 0.5, -0.5]}
    )
