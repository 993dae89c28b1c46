"""Plotly charts in a page that needs nothing from outside itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import plotly.graph_objects as go

CONFIG: dict[str, Any] = {"displaylogo": False, "responsive": True, "showSendToCloud": False}
"""How charts are shown; without the button that would upload one, and the names of its clips, to a server."""


def plotly_script() -> str:
    """Return Plotly's script as an element for a page's head."""
    from plotly.offline import get_plotlyjs

    return f"<script>{get_plotlyjs()}</script>"


def chart_html(figure: go.Figure, name: str) -> str:
    """Return a chart as an element called `name`, for a page that has Plotly's script."""
    return figure.to_html(
        full_html=False, include_plotlyjs=False, include_mathjax=False, div_id=name, config=CONFIG
    )
