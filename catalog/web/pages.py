"""The start page, the search and the lists of clusters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.errors import CatalogError
from motionary.catalog.landmarks import route_note
from motionary.catalog.query import Catalog
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import link, render, shown_to
from motionary.catalog.web.search import clip_rows, find, label_columns, page_of

_FIRST = 12


def start(request: Request) -> Response:
    """Answer /: what the catalog holds, and its largest clusters."""
    shown = shown_to(request)
    clusters = clusters_of(shown)
    return render(
        request,
        "start.html",
        about=shown.keep("answer", "description", shown.catalog.describe),
        clusters=clusters[:_FIRST],
        many=len(clusters),
        note=_note(shown),
        quarantined=shown.keep("answer", "quarantine", lambda: _quarantined(shown.catalog)),
    )


def search(request: Request) -> Response:
    """Answer /search: clips by words and a condition in SQL; `with` is a clip to compare the found with."""
    shown = shown_to(request)
    asked = request.query_params
    words, condition, other = asked.get("q", ""), asked.get("where", ""), asked.get("with", "")
    wrong: str | None = None
    clip_ids: Sequence[str] = ()
    try:
        clip_ids = find(shown, words, condition)
    except CatalogError as error:
        wrong = str(error)
    found = page_of(clip_ids, page_number(request))
    return render(
        request,
        "search.html",
        words=words,
        condition=condition,
        other=other,
        wrong=wrong,
        like_sql=not condition and any(sign in words for sign in "=<>"),
        columns=["clip_id", "label", "cluster_id", "seconds", *label_columns(shown.catalog)],
        found=found,
        rows=clip_rows(shown.catalog, found.rows) if found.rows else [],
        page_link=lambda number: link("/search", q=words, where=condition, page=number, **{"with": other}),
    )


def clusters(request: Request) -> Response:
    """Answer /clusters: all of them, the largest first."""
    shown = shown_to(request)
    return render(
        request,
        "clusters.html",
        found=page_of(clusters_of(shown), page_number(request)),
        note=_note(shown),
        page_link=lambda number: link("/clusters", page=number),
    )


def clusters_of(shown: Shown) -> list[dict[str, Any]]:
    """Return the published clusters, the largest first: see `motionary.catalog.views.cluster_table`."""
    return shown.keep("answer", "clusters", lambda: cluster_table(shown.catalog).to_pylist())


def _note(shown: Shown) -> str | None:
    return shown.keep("answer", "route", lambda: route_note(shown.catalog))


def page_number(request: Request) -> int:
    """Read which page is asked for."""
    asked = request.query_params.get("page", "1")
    if not (asked.isascii() and asked.isdigit() and len(asked) < 9):
        raise HTTPException(400, f"page is {asked[:40]!r}; give a number from 1")
    return int(asked)


def _quarantined(catalog: Catalog) -> list[dict[str, Any]]:
    query = "select path, line, reason, mend from quarantine order by path, line limit 100"
    return catalog.sql(query).to_pylist()
