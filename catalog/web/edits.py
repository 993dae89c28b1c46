"""Labels set from the pages and taken back, over HTTP: `POST /edit/relabel`, `POST /edit/undo`."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Route

from motionary.catalog.web.desk import Desk, Refused, Relabel, Undo

READ_ONLY = "this server is read-only; to change labels, start it with: motionary browse CATALOG --edit"

_LONGEST_BODY, _LONGEST_LABEL = 1 << 16, 300


async def _relabel(request: Request) -> JSONResponse:
    """Answer {"clip": clip_id, "label": text or null}."""
    return await _answer(request, _wished_label)


async def _undo(request: Request) -> JSONResponse:
    """Answer {"edit": number}."""
    return await _answer(request, _wished_undo)


async def _answer(request: Request, wished: Callable[[dict[str, Any]], Relabel | Undo]) -> JSONResponse:
    desk: Desk | None = request.app.state.desk
    try:
        if desk is None:
            raise Refused(403, READ_ONLY)
        made = await desk.ask(wished(await _json(request)))
    except Refused as refusal:
        last = None if desk is None else desk.last
        return JSONResponse({"error": str(refusal), "undo": last}, refusal.status)
    return JSONResponse({**made.to_dict(), "undo": desk.last})


def _wished_label(given: dict[str, Any]) -> Relabel:
    clip_id, label = given.get("clip"), given.get("label", "")
    if not isinstance(clip_id, str) or not (label is None or isinstance(label, str)):
        raise Refused(400, 'send {"clip": clip_id, "label": text, or null for none}')
    if label is not None and len(label) > _LONGEST_LABEL:
        raise Refused(400, f"the label has {len(label)} characters; give {_LONGEST_LABEL} at most")
    return Relabel(clip_id, label and label.strip())


def _wished_undo(given: dict[str, Any]) -> Undo:
    number = given.get("edit")
    if not isinstance(number, int):
        raise Refused(400, 'send {"edit": the number of the change}')
    return Undo(number)


async def _json(request: Request) -> dict[str, Any]:
    """Read a small JSON object; what a form of another page can send is none."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise Refused(415, "send JSON, as application/json")
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > _LONGEST_BODY:
            raise Refused(413, f"more than {_LONGEST_BODY} bytes were sent; that is no change of a label")
    try:
        given = json.loads(body)
    except (ValueError, RecursionError):
        given = None
    if not isinstance(given, dict):
        raise Refused(400, "what was sent is no JSON object")
    return given


edit_routes = [
    Route("/edit/relabel", _relabel, methods=["POST"]),
    Route("/edit/undo", _undo, methods=["POST"]),
]
