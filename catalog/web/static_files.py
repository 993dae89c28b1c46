"""Scripts and styles: those of this package, those of the views, and Plotly's script from its own package."""

from __future__ import annotations

import hashlib
import mimetypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.views.assets import asset
from motionary.catalog.web.caching import cached_response

_OF_VIEWS = ("player.js", "style.css")


@dataclass(frozen=True)
class StaticFile:
    """A file as it is sent, and the digest that its URL carries so that it need not be asked for again."""

    content: bytes
    media_type: str
    edition: str


def static_file(name: str) -> StaticFile | None:
    """Return a file by its name in the URL, None where there is none."""
    return _read(name) if name in _CONTENTS else None


@cache
def _read(name: str) -> StaticFile:
    content = _CONTENTS[name]()
    media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
    return StaticFile(content, media_type, hashlib.blake2b(content, digest_size=8).hexdigest())


def static_url(name: str) -> str:
    """Return the URL of a file, with its edition."""
    file = static_file(name)
    if file is None:
        raise LookupError(f"there is no static file {name!r}")
    return f"/static/{name}?of={file.edition}"


def send_static(request: Request) -> Response:
    """Answer /static/NAME."""
    file = static_file(request.path_params["name"])
    if file is None:
        raise HTTPException(404, f"there is no file {request.path_params['name']}")
    return cached_response(request, file.edition, file.media_type, lambda: file.content)


def _plotly() -> bytes:
    from plotly.offline import get_plotlyjs

    return get_plotlyjs().encode()


def _of_views(name: str) -> bytes:
    return asset(name).encode()


_CONTENTS: dict[str, Callable[[], bytes]] = {
    "plotly.js": _plotly,
    **{name: partial(_of_views, name) for name in _OF_VIEWS},
    **{one.name: one.read_bytes for one in files(__package__).joinpath("static").iterdir() if one.is_file()},
}
"""Every file there is: what is not among them is never kept."""
