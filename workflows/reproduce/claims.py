"""What a paper says in words, held against what is measured here: a sentence, a verdict, the figures."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass

from rich.console import RenderableType

from motionary.workflows.tables import text_table

_WIDTHS = {"the paper says": 44, "here": 13, "measured": 76}


@dataclass(frozen=True)
class Claim:
    """What a paper says, whether that is so here, and by which figures.

    Parameters
    ----------
    claim : str
        A sentence of the paper in other words, without a full stop.
    holds : bool or None
        Whether the figures in `here` are as it says; None where what it speaks of was not measured.
    here : str
        The figures, in words, and what was asked of them where the sentence does not say.
    """

    claim: str
    holds: bool | None
    here: str


def claims_table(claims: Iterable[Claim], title: str) -> RenderableType:
    """Lay claims out in a table that is no wider than a page, also where no terminal folds it."""
    rows = [
        [
            textwrap.fill(cell, width)
            for cell, width in zip((one.claim, _verdict(one), one.here), _WIDTHS.values(), strict=True)
        ]
        for one in claims
    ]
    return text_table(list(_WIDTHS), rows, title)


def _verdict(claim: Claim) -> str:
    if claim.holds is None:
        return "not measured"
    return "holds" if claim.holds else "does NOT hold"
