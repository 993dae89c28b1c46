"""Colours and marks of clusters, and the ground that every chart shares.

The colours are those of Okabe and Ito (2008) that show on light and on dark ground, told apart with any
colour vision. There are six, so that clusters are also told apart by their marks, and by name.
"""

from __future__ import annotations

from typing import Any

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7")
GREY = "#888888"

_MARKS = (
    ("circle", "●"),
    ("square", "■"),
    ("diamond", "◆"),
    ("triangle-up", "▲"),
    ("triangle-down", "▼"),
)

CHART: dict[str, Any] = {
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "font": {"family": "system-ui, sans-serif", "size": 12, "color": "#808080"},
    "hoverlabel": {"align": "left"},
    "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": GREY},
}
"""Layout of a chart that is read on light and on dark ground."""

AXIS: dict[str, Any] = {
    "gridcolor": "rgba(128,128,128,0.25)",
    "zeroline": False,
    "linecolor": GREY,
    "tickcolor": GREY,
}


def cluster_colour(cluster_id: int) -> str:
    """Return the colour of a cluster, counted from 1."""
    return COLOURS[(cluster_id - 1) % len(COLOURS)]


def cluster_symbol(cluster_id: int) -> str:
    """Return the mark of a cluster, as Plotly names it; colour and mark together repeat after thirty."""
    return _MARKS[(cluster_id - 1) // len(COLOURS) % len(_MARKS)][0]


def cluster_character(cluster_id: int) -> str:
    """Return the mark of a cluster as text."""
    return _MARKS[(cluster_id - 1) // len(COLOURS) % len(_MARKS)][1]
