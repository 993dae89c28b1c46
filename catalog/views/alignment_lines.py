"""How the methods' lines look in all charts of an alignment, one legend for each."""

from __future__ import annotations

from typing import Any

from motionary.catalog.views.colours import COLOURS, GREY
from motionary.catalog.views.line_styles import LineStyle, line_style

MOST_SHOWN = 3
"""Methods whose lines are drawn at first, and who play; the others' wait in the legend."""

PLAIN = LineStyle(GREY, "dot", "circle")
"""Of the moving motion when it is only stretched."""


def method_style(number: int) -> LineStyle:
    """Return the style of a method's line, from 1; the player gives the first ones the same colours."""
    others = COLOURS[1:]  # the first, which is the reference's, does not show on dark costs
    turn, place = divmod(number - 1, len(others))
    usual = line_style(number + turn)  # the next time round another dash
    return LineStyle(others[place], usual.dash, usual.symbol)


def legend(y: float) -> dict[str, Any]:
    """Lay the legend out in a row below the chart, its top at `y` in shares of the chart's height."""
    return {"orientation": "h", "y": y, "yanchor": "top", "bgcolor": "rgba(0,0,0,0)"}
