"""Names as text of a chart, where nothing of them is taken for markup.

Plotly reads a subset of HTML in every text, and of entities only a few: quotes stay as they are. It replaces
`%{...}` in templates, and in the names of traces that have `meta`, so that no name of ours may stand in one:
names go into `hovertext`, `customdata` and traces without `meta`. Unicode's isolates do for a right-to-left
name what `<bdi>` does on a page.
"""

from __future__ import annotations

from html import escape

_ISOLATE, _RELEASE = "\u2068", "\u2069"
_LINE = 60


def short_text(name: str, most: int = 44) -> str:
    """Show a name on one line of at most `most` characters; the middle of a longer one is left out."""
    if len(name) > most:
        name = f"{name[: most // 3]}…{name[len(name) - (most - most // 3 - 1) :]}"
    return f"{_ISOLATE}{escape(name, quote=False)}{_RELEASE}"


def full_text(name: str) -> str:
    """Show all of a name, broken into lines, for a label that hovers."""
    lines = [name[begin : begin + _LINE] for begin in range(0, len(name), _LINE)]
    return "<br>".join(f"{_ISOLATE}{escape(line, quote=False)}{_RELEASE}" for line in lines)
