"""Lines that are told apart in any colour vision and in grey: colour, dash and mark change together.

Their numbers of kinds have no common divisor, so that the three together repeat after 210 lines.
"""

from __future__ import annotations

from dataclasses import dataclass

from motionary.catalog.views.colours import COLOURS

_DASHES = ("solid", "dash", "dot", "dashdot", "longdash")
_SYMBOLS = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "cross")


@dataclass(frozen=True)
class LineStyle:
    """How a line is drawn, in Plotly's words."""

    colour: str
    dash: str
    symbol: str


def line_style(number: int) -> LineStyle:
    """Return the style of the line of a number, from 1."""
    place = number - 1
    return LineStyle(
        COLOURS[place % len(COLOURS)], _DASHES[place % len(_DASHES)], _SYMBOLS[place % len(_SYMBOLS)]
    )
