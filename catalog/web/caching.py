"""Responses that a browser keeps: for good where the URL names the edition, else asked about again."""

from __future__ import annotations

from collections.abc import Callable

from starlette.requests import Request
from starlette.responses import Response


def cached_response(
    request: Request, edition: str, media_type: str, content: Callable[[], bytes]
) -> Response:
    """Send something that is the same as long as its edition is, or say that it is.

    Parameters
    ----------
    request : Request
        `?of=` of its URL is the edition that a page linked to.
    edition : str
        What the content depends on: another one may mean other content.
    media_type : str
    content : callable
        Makes it, where the browser does not have it.
    """
    asked = request.query_params.get("of")
    kept = "private, max-age=31536000, immutable" if asked == edition else "private, no-cache"
    tag = f'"{edition}"'
    headers = {"Cache-Control": kept, "ETag": tag}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(content(), media_type=media_type, headers=headers)
