"""One HTML page that needs nothing from outside itself; every text put into it is escaped."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from motionary.catalog.views.assets import asset


@dataclass(frozen=True)
class Html:
    """Text that is HTML already; whoever makes one has escaped what is in it."""

    text: str


_BREAKS = re.compile("(?<=[/_])")

Cell = str | int | float | Html | None


def page(
    title: str, body: Sequence[str], head: str = "", before: Sequence[str] = (), after: Sequence[str] = ()
) -> str:
    """Put a page together.

    Parameters
    ----------
    title : str
        Plain text.
    body : sequence of str
        HTML of the page's main part, from top to bottom.
    head : str
        Further HTML for the page's head.
    before, after : sequence of str
        HTML that stands before and after the main part, such as a table of contents, and data.
    """
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{asset('style.css')}</style>\n{head}\n</head>\n<body>\n"
        + "\n".join([*before, '<main id="main">', *body, "</main>", *after])
        + "\n</body>\n</html>\n"
    )


def section(title: str, intro: str, *body: str, name: str | None = None) -> str:
    """Write a heading, a sentence or two in plain text, and what follows; a link leads to its `name`."""
    at = "" if name is None else f' id="{escape(name)}"'
    return f'<section{at}>\n<h2>{escape(title)}</h2>\n<p class="quiet">{escape(intro)}</p>\n' + "\n".join(
        [*body, "</section>"]
    )


def isolated(name: str) -> Html:
    """Write a name from the data: one that is written from right to left does not turn what is beside it.

    A line may end after its slashes and underscores.
    """
    return Html(f"<bdi>{_BREAKS.sub('<wbr>', escape(name))}</bdi>")


def table(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """Write a table; a column whose first value is a number stands to the right, and None is a dash."""
    right = [isinstance(cell, int | float) for cell in rows[0]] if rows else [False] * len(columns)
    head = "".join(_cell("th", name, side) for name, side in zip(columns, right, strict=True))
    lines = [
        "<tr>" + "".join(_cell("td", cell, side) for cell, side in zip(row, right, strict=True)) + "</tr>"
        for row in rows
    ]
    return (
        f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(lines)
        + "\n</tbody>\n</table></div>"
    )


def facts(values: Sequence[tuple[str, str | int]]) -> str:
    """Write a few figures large, each over its name."""
    cells = [f"<div><dt>{escape(name)}</dt><dd>{escape(str(value))}</dd></div>" for name, value in values]
    return '<dl class="facts">' + "".join(cells) + "</dl>"


def details(summary: str, body: str) -> str:
    """Write something that opens at a click."""
    return f"<details><summary>{escape(summary)}</summary>\n{body}\n</details>"


def _cell(tag: str, cell: Cell, right: bool) -> str:
    side = ' class="number"' if right else ""
    return f"<{tag}{side}>{_text(cell)}</{tag}>"


def _text(cell: Cell) -> str:
    if cell is None:
        return "-"
    if isinstance(cell, Html):
        return cell.text
    return escape(f"{cell:.3f}" if isinstance(cell, float) else str(cell))
