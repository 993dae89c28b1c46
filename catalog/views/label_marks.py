"""How labels and sources are told apart on charts of clips: colour and filling, and shape.

Six colours with four fillings make 24 labels, the most frequent ones; the others share one mark, and whoever
points at a clip is told its label. Nothing is told by colour alone: of one colour, fillings differ, and the
chart bears the names.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

from motionary.catalog.views.colours import COLOURS, GREY

SHAPES = ("circle", "square", "diamond", "triangle-up", "triangle-down", "star")
_FILLINGS = ("", "-open", "-open-dot", "-dot")
MOST_LABELS = len(COLOURS) * len(_FILLINGS)

HALO = ", ".join(["0 0 3px var(--ground, transparent)"] * 3)
"""Shadow of text that stands among marks."""


@dataclass(frozen=True)
class LabelMark:
    """Colour and filling of a label; `filling` is appended to the name of a shape."""

    colour: str
    filling: str

    def symbol(self, shape: str) -> str:
        """Return the mark as Plotly names it."""
        return f"{shape}{self.filling}"


OTHER = LabelMark(GREY, "-open")
"""Of labels beyond the most frequent, and of clips without one."""


def label_marks(labels: Iterable[str | None]) -> dict[str, LabelMark]:
    """Give the most frequent labels their marks, the most frequent first, of equal ones by alphabet.

    Parameters
    ----------
    labels : iterable of str or None
        One a clip; None has no mark.
    """
    return {
        label: LabelMark(COLOURS[place % len(COLOURS)], _FILLINGS[place // len(COLOURS)])
        for place, label in enumerate(_frequent(labels)[:MOST_LABELS])
    }


def source_shapes(sources: Iterable[str]) -> dict[str, str]:
    """Give every source its shape, the most frequent first; from the sixth on they share the last."""
    return {source: SHAPES[min(place, len(SHAPES) - 1)] for place, source in enumerate(_frequent(sources))}


def legend_key(name: str, mark: dict[str, Any], **layout: Any) -> Any:
    """Make a trace that shows nothing but a line of the legend."""
    import plotly.graph_objects as go

    return go.Scatter(
        x=[None], y=[None], mode="markers", name=name, marker={"size": 9, **mark}, hoverinfo="skip", **layout
    )


def _frequent(values: Iterable[Any]) -> list[Any]:
    counts: Counter[Hashable] = Counter(one for one in values if one is not None)
    return sorted(counts, key=lambda one: (-counts[one], str(one)))
