"""Threshold strips as a band of bars along mu: the ranges that yield one number of clusters [DC figure 9].

The paper cuts in the widest strip that is neither one cluster nor all clips by themselves, since a wide one
says that many thresholds agree; it is marked. Neighbouring strips that are too narrow to see are drawn as one
bar, which tells how many clusters they go through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.views.colours import GREY
from motionary.pipeline.clustering import threshold_strips, widest_strip

if TYPE_CHECKING:
    import plotly.graph_objects as go

_NARROW = 1 / 300  # of the axis: two or three pixels
_ROOM_FOR_CHARACTER = 1 / 90


@dataclass(frozen=True)
class Bar:
    """One strip, or several narrow ones: `low` to `high` of mu, with `most` to `fewest` clusters.

    `widest` marks the dendrogram's widest strip, which is always a bar of its own.
    """

    low: float
    high: float
    most: int
    fewest: int
    widest: bool


def strip_bars(Z: NDArray[np.float64], last_mu: float) -> list[Bar]:
    """List the bars of a dendrogram's strips.

    Parameters
    ----------
    Z : array (N - 1, 4)
        SciPy linkage matrix.
    last_mu : float
        Where the axis ends, and with it the strip of one cluster; in the unit of the heights.

    Returns
    -------
    list of Bar
        From mu = 0 on, without gaps.
    """
    best = widest_strip(Z)
    bars: list[Bar] = []
    narrow = False
    for strip in threshold_strips(Z).to_pylist():
        kappa, low, high = strip["kappa"], strip["mu_low"], min(strip["mu_high"], last_mu)
        widest = best is not None and kappa == best.kappa
        joins = narrow
        narrow = not widest and high - low < _NARROW * last_mu
        if joins and narrow:
            bars[-1] = Bar(bars[-1].low, high, bars[-1].most, kappa, False)
        else:
            bars.append(Bar(low, high, kappa, kappa, widest))
    return bars


def band_trace(bars: Sequence[Bar], row: str, unit: float, colour: str = GREY, **place: object) -> go.Bar:
    """Draw bars as a row of a band; every other one is paler, and the widest strip has a frame and a star.

    Parameters
    ----------
    bars : sequence of Bar
    row : str
        Category of the vertical axis; plain text that is no one's name.
    unit : float
        What mu is divided by where it is drawn.
    colour : str
        Of the row.
    **place
        Axes and further properties of the trace.
    """
    import plotly.graph_objects as go

    low, high = np.array([[bar.low, bar.high] for bar in bars]).T / unit
    return go.Bar(
        base=low,
        x=high - low,
        y=[row] * len(bars),
        orientation="h",
        width=0.8,
        marker={
            "color": colour,
            "opacity": [0.75 if bar.widest else (0.22, 0.42)[turn % 2] for turn, bar in enumerate(bars)],
            "line": {"color": colour, "width": [2.5 if bar.widest else 0 for bar in bars]},
        },
        text=[_written(bar, share) for bar, share in zip(bars, (high - low) / high[-1], strict=True)],
        textposition="inside",
        insidetextanchor="middle",
        textangle=0,
        constraintext="none",
        hoverinfo="text",
        hovertext=[_told(bar, row, start, stop) for bar, start, stop in zip(bars, low, high, strict=True)],
        showlegend=False,
        **place,
    )


def _written(bar: Bar, share: float) -> str:
    """Return what stands in a bar of this share of the axis."""
    text = f"{bar.most}{' ★' if bar.widest else ''}"
    return text if bar.most == bar.fewest and share > _ROOM_FOR_CHARACTER * (len(text) + 1) else ""


def _told(bar: Bar, row: str, low: float, high: float) -> str:
    clusters = f"{bar.most} clusters" if bar.most == bar.fewest else f"{bar.most} to {bar.fewest} clusters"
    kind = ", the widest strip" if bar.widest else ", narrow strips" if bar.most != bar.fewest else ""
    return f"{row}: {clusters if bar.most != 1 else '1 cluster'}{kind}<br>μ {low:.4g} to {high:.4g}"
