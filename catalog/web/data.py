"""What the pages' scripts ask for: scenes to play, thumbnails, suggestions while one types."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from motionary.catalog.errors import UnknownClip
from motionary.catalog.explanation import Explanation
from motionary.catalog.views.figures import Figure, Layout, clip_figure, scene
from motionary.catalog.views.thumbnail import thumbnail_svg
from motionary.catalog.web.caching import cached_response
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import shown_to
from motionary.catalog.web.search import TooManyWords, find

_MOST_FIGURES = 8
_SUGGESTED = 10


def send_figure(request: Request) -> Response:
    """Answer /data/figure?clip=: one motion as the player takes it."""
    shown = shown_to(request)
    clip_id = wanted_clip(request, "clip")
    return cached_response(
        request, shown.edition, "application/json", lambda: _json(figure(shown, clip_id).to_dict())
    )


def send_scene(request: Request) -> Response:
    """Answer /data/scene?clip=&clip=: several, side by side or overlaid (`layout=overlaid`)."""
    shown = shown_to(request)
    clip_ids = request.query_params.getlist("clip")
    if not 1 <= len(clip_ids) <= _MOST_FIGURES:
        raise HTTPException(400, f"{len(clip_ids)} clips are asked for; name 1 to {_MOST_FIGURES} by clip=")
    layout: Layout = "overlaid" if request.query_params.get("layout") == "overlaid" else "side"

    def make() -> bytes:
        figures = [figure(shown, one) for one in dict.fromkeys(clip_ids)]
        return _json(scene(figures, layout=layout))

    require(shown, *clip_ids)
    return cached_response(request, shown.edition, "application/json", make)


def send_pair(request: Request) -> Response:
    """Answer /data/pair?a=&b=: two clips, the second with its warp to the first."""
    shown = shown_to(request)
    a, b = wanted_clip(request, "a"), wanted_clip(request, "b")

    def make() -> bytes:
        return _json(scene(_on_each_other(figure(shown, a), figure(shown, b), explanation(shown, a, b))))

    return cached_response(request, shown.edition, "application/json", make)


def send_thumbnail(request: Request) -> Response:
    """Answer /data/thumbnail?clip=."""
    shown = shown_to(request)
    clip_id = wanted_clip(request, "clip")

    def make() -> bytes:
        return shown.keep("thumbnail", clip_id, lambda: thumbnail_svg(shown.catalog, clip_id).encode())

    return cached_response(request, shown.motions_edition, "image/svg+xml", make)


def suggest(request: Request) -> Response:
    """Answer /data/search?q=: the first clips that have these words."""
    try:
        found = find(shown_to(request), request.query_params.get("q", ""))
    except TooManyWords:
        found = ()  # the page of the search says so
    return JSONResponse({"clips": list(found[:_SUGGESTED]), "total": len(found)})


def wanted_clip(request: Request, name: str) -> str:
    """Read a clip_id from the query."""
    clip_id = request.query_params.get(name, "")
    if not clip_id:
        raise HTTPException(400, f"no clip is named; give one by {name}=")
    require(shown_to(request), clip_id)
    return clip_id


def require(shown: Shown, *clip_ids: str) -> None:
    """Refuse what is no clip; the message tells the nearest names."""
    try:
        shown.catalog.require(*clip_ids)
    except UnknownClip as error:
        raise HTTPException(404, str(error)) from error


def figure(shown: Shown, clip_id: str) -> Figure:
    """Return a clip as the player takes it."""
    return shown.keep("figure", clip_id, lambda: clip_figure(shown.catalog, clip_id))


def explanation(shown: Shown, a: str, b: str) -> Explanation:
    """Return why two clips are as far apart as they are."""
    return shown.keep("answer", ("explain", a, b), lambda: shown.catalog.explain(a, b))


def _on_each_other(a: Figure, b: Figure, why: Explanation) -> Sequence[Figure]:
    """Give two figures the warp of the second to the first, instead of those to their references."""
    times = np.arange(int(why.a.seconds * why.frame_rate + 1e-6) + 1) / why.frame_rate
    shown = np.interp(times, why.warp.seconds_a, why.warp.seconds_b)
    return [
        replace(one, warp_times=own, warp_fps=why.frame_rate, reference=a.clip_id, residual=None)
        for one, own in ((a, times), (b, shown))
    ]


def _json(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()
