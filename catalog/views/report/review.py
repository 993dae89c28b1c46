"""The review queue in a report: clips whose names a person should look at, and what speaks against them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.review import REASONS, review
from motionary.catalog.views.page import Cell, Html, details, isolated, section, table
from motionary.catalog.views.report.footage import Footage

MOST_CLIPS = 3000
"""Of a catalog whose queue is looked for: it goes over all pairs of clips."""
MOST_SEEN = 12
_MOST_ROWS = 50
_NAME, _TITLE, _STAGE = "review", "Review queue", "review-stage"

Row = dict[str, Any]


def review_queue(catalog: Catalog) -> list[Row] | str:
    """Return the queue, most urgent first, or why there is none."""
    if len(catalog.clips) > MOST_CLIPS:
        return (
            f"Left out: of {len(catalog.clips):,} clips it takes minutes; here it is made of {MOST_CLIPS:,} "
            "at most. motionary label review CATALOG lists it."
        )
    try:
        return review(catalog).to_pylist()
    except CatalogError as error:
        return str(error)


def reviewed_clips(queue: list[Row] | str) -> Iterator[str]:
    """List the clips to look at: those first in the queue, each with the one that speaks against its name."""
    for row in _rows(queue)[:MOST_SEEN]:
        yield from reversed(_played(row))


def review_section(queue: list[Row] | str, footage: Footage, less: str | None) -> str:
    """Show the queue; `less` says of what it knows less."""
    if isinstance(queue, str):
        return section(_TITLE, queue, name=_NAME)
    if not queue:
        return section(_TITLE, "Nothing to ask: every name stands to reason.", name=_NAME)
    cells: list[list[Cell]] = [
        [
            _seen(row, footage) if place < MOST_SEEN else Html(""),
            isolated(row["clip_id"]),
            row["reason"],
            f"{row['urgency']:.2f}",
            _named(row["current"]),
            _named(row["suggested"]),
            None if row["other"] is None else isolated(row["other"]),
        ]
        for place, row in enumerate(queue[:_MOST_ROWS])
    ]
    more = f", of which the first {_MOST_ROWS} are here" if len(queue) > _MOST_ROWS else ""
    return section(
        _TITLE,
        f"Clips whose names may be wrong, {len(queue):,} in all, the likeliest first{more}. "
        "Press a picture to see the clip beside the one that speaks against its name. "
        "motionary label set CATALOG CLIP LABEL names a clip, and label review lists them all. "
        + (f"{less}. " if less else "")
        + footage.no_room(_played(row) for row in queue[:MOST_SEEN]),
        f'<div class="stage" id="{_STAGE}"></div>',
        details("What the reasons mean", table(["reason", "the clip is listed because"], [*REASONS.items()])),
        table(["", "clip", "why", "urgency", "called", "perhaps", "because of"], cells),
        name=_NAME,
    )


def _seen(row: Row, footage: Footage) -> Html:
    said = f"Play {row['clip_id']}" + (f" beside {row['other']}" if row["other"] else "")
    return Html(footage.button(_STAGE, said, "<span>Play</span>", *_played(row)))


def _played(row: Row) -> list[str]:
    return [one for one in (row["other"], row["clip_id"]) if one is not None]


def _named(label: str | None) -> Cell:
    return None if label is None else isolated(label)


def _rows(queue: list[Row] | str) -> Sequence[Row]:
    return [] if isinstance(queue, str) else queue
