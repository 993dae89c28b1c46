"""The mu-kappa chart: how many clusters each threshold leaves, for every distance [DC figure 9]."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.query import Catalog
from motionary.catalog.views.colours import AXIS, CHART, COLOURS, GREY
from motionary.catalog.views.linkages import linkages_by_distance
from motionary.pipeline.clustering import threshold_strips

if TYPE_CHECKING:
    import plotly.graph_objects as go

_DASHES = ("solid", "dash", "dot", "dashdot")
_LAST_MU = 1.05


def mu_kappa_figure(catalog: Catalog) -> go.Figure | None:
    """Draw the number of clusters kappa against the threshold mu, with each distance's widest strip.

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
    for one, colour, dash in zip(curves, COLOURS, _DASHES, strict=False):
        metric, unit = one.cut["metric"], one.Z[-1, 2] or 1.0
        mu, kappa = steps(one.Z)
        figure.add_scatter(
            x=mu,
            y=kappa,
            name=f"{metric} ({one.cut['method']})",
            legendgroup=metric,
            mode="lines",
            line={"color": colour, "dash": dash, "width": 2, "shape": "hv"},
            hovertemplate=f"{metric}: %{{y}} clusters from μ = %{{x:.3f}}<extra></extra>",
        )
        if one.cut["strip_clusters"] is not None:
            figure.add_scatter(
                x=[one.cut["strip_low"] / unit, one.cut["strip_high"] / unit],
                y=[one.cut["strip_clusters"]] * 2,
                name=f"widest strip: {one.cut['strip_clusters']} clusters",
                legendgroup=metric,
                mode="lines+markers",
                line={"color": colour, "width": 6},
                marker={"symbol": "line-ns", "size": 14, "line": {"color": colour, "width": 3}},
                opacity=0.6,
                hovertemplate=f"{metric}, widest strip: %{{y}} clusters<extra></extra>",
            )
    published = len(catalog.references)
    figure.add_scatter(
        x=[0, _LAST_MU],
        y=[published] * 2,
        name=f"published: {published} clusters",
        mode="lines",
        line={"color": GREY, "width": 1},
        hoverinfo="skip",
    )
    _arrange(figure, len(catalog.clips))
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


def _arrange(figure: go.Figure, clips: int) -> None:
    figure.update_layout(
        **CHART,
        height=440,
        margin={"l": 60, "r": 20, "t": 20, "b": 50},
        legend={"tracegroupgap": 10},
    )
    figure.update_xaxes(**AXIS, title="threshold μ / greatest merge", range=[0, _LAST_MU], showline=True)
    figure.update_yaxes(
        **AXIS,
        title="clusters κ",
        type="log",
        tickvals=[digit * 10**power for power in range(6) for digit in (1, 2, 5)],
        range=[np.log10(0.9), np.log10(1.1 * clips)],
        showline=True,
    )
