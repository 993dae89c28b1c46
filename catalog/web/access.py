"""Who may ask the application, and from where: every request passes here before anything else looks at it.

What is guarded against, and by what:

Another machine
    The server listens on loopback unless told otherwise, and on any other address asks for a token.
Another user of this machine
    Loopback does *not* keep them out: whoever has an account here can connect to it, read what the catalog
    holds and, where editing is on, relabel. A token does; one that is given counts on loopback too.
A page of another site in the same browser
    It may point its own name at this machine and so read answers as its own (DNS rebinding): a request must
    call this server by an IP address, `localhost`, or a name it was told. It may send forms or use `fetch`:
    whatever changes something must come from a page of this very host *and port*, by its `Origin`; for
    cookies, other ports of a host are the same site. It may show these pages in a frame, or read scripts and
    pictures into its own: the headers of every answer forbid both.
Text of the catalog that is script
    It is escaped where it is shown; should that fail somewhere, the content security policy runs no script
    but this server's own files, and lets none send anything elsewhere.

A condition of a search that takes all of the machine
    It may compare columns and nothing else: `condition.py`.

What is not: the connection is not encrypted, so that on another address whoever can listen on the network
reads the token and the pages (`ssh -L` or a proxy with TLS helps). Cookies know no ports: another server on
this host that the same browser visits is sent the cookie, which is not the token but opens this server as
well.

A token is asked for once: in the address (`?token=`), which is then replaced by one without it, or on a page.
It is kept in a cookie that scripts cannot read and that no other site's page makes the browser send.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import re
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from urllib.parse import parse_qs, parse_qsl, quote, urlencode

from jinja2 import Environment, Template
from starlette.datastructures import MutableHeaders
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

SHORTEST_TOKEN = 16
"""Characters; one is made of 43, which are 256 random bits."""

_HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
        "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "same-origin",  # with no-referrer, forms would come from Origin "null"
}
_HOST = re.compile(r"([a-z0-9._-]+|\[[0-9a-f:.]+\])(:\d{1,5})?", re.ASCII)
_READING = ("GET", "HEAD")
_LONGEST_FORM = 4096


@dataclass(frozen=True)
class Guard:
    """What a request must show to be answered.

    Parameters
    ----------
    token : str, optional
        What everybody who asks must know; at least `SHORTEST_TOKEN` characters of ASCII that can be printed,
        without blanks. Without one everybody who can connect is answered.
    hosts : frozenset of str
        Names this server is called by, beside `localhost` and every IP address; without ports.

    Raises
    ------
    ValueError
        The token is too short, or cannot be sent.
    """

    token: str | None = field(default=None, repr=False)
    hosts: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if self.token is None:
            return
        if len(self.token) < SHORTEST_TOKEN:
            raise ValueError(f"the token has {len(self.token)} characters; give {SHORTEST_TOKEN} or more")
        if not (self.token.isascii() and self.token.isprintable()) or " " in self.token:
            raise ValueError("the token has blanks, or characters other than ASCII; write it without")

    def knows(self, host: str) -> bool:
        """Tell whether a `Host` header calls this server by a name that nobody else can have."""
        named = _HOST.fullmatch(host.lower())
        name = named[1].strip("[]") if named else ""
        if name == "localhost" or name in {one.lower() for one in self.hosts}:
            return True
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return False
        return True

    def accepts(self, token: str) -> bool:
        """Tell whether this is the token, in the same time whatever it is."""
        return self.token is not None and hmac.compare_digest(token.encode(), self.token.encode())

    @property
    def pass_value(self) -> str:
        """What the cookie holds: made from the token, which cannot be made from it."""
        return hmac.new((self.token or "").encode(), b"motionary browse", hashlib.sha256).hexdigest()


def middleware(guard: Guard) -> list[Middleware]:
    """Return what an application puts before its routes."""
    return [Middleware(_Gate, guard=guard)]


class _Gate:
    """Refuses what the guard does not let in, and puts the headers on every answer."""

    def __init__(self, app: ASGIApp, guard: Guard) -> None:
        self.app, self.guard = app, guard

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            request = Request(scope, receive)
            answer = _refusal(request, self.guard) or await _token_answer(request, self.guard)
            if answer is not None:
                await answer(scope, receive, _with_headers(send))
            else:
                await self._answered(request, receive, _with_headers(send))
        else:
            await send({"type": "websocket.close", "code": 1008})

    async def _answered(self, request: Request, receive: Receive, send: Send) -> None:
        """Have the application answer; a fault is told from here, for Starlette tells it outside."""
        started = False

        async def noted(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            await self.app(request.scope, receive, noted)
        except Exception as error:
            tell = request.app.exception_handlers.get(Exception)
            if not started and tell is not None:
                await tell(request, error)(request.scope, receive, send)
            raise


def _with_headers(send: Send) -> Send:
    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in _HEADERS.items():
                headers[name] = value
            headers.setdefault("Cache-Control", "private, no-cache")
        await send(message)

    return sent


def _refusal(request: Request, guard: Guard) -> Response | None:
    """Refuse a name that is not this server's, and a change that another site's page asks for."""
    host = request.headers.get("host", "")
    if not guard.knows(host):
        return PlainTextResponse(
            "This server is not known by that name. Open it by its IP address or as localhost.\n", 421
        )
    if request.method in _READING:
        return None
    origin = request.headers.get("origin", "").lower()
    if origin not in (f"http://{host}".lower(), f"https://{host}".lower()):
        return PlainTextResponse(
            "Only this server's own pages may ask for that (the Origin header names another, or none).\n", 403
        )
    return None


async def _token_answer(request: Request, guard: Guard) -> Response | None:
    """Answer who has no pass yet; None for who has, and where none is asked for."""
    if guard.token is None:
        return None
    given = request.query_params.get("token")
    if given is not None and request.method in _READING:
        return (
            _let_in(request, guard, _without_token(request)) if guard.accepts(given) else _ask(request, True)
        )
    if hmac.compare_digest(request.cookies.get(_cookie(request), "").encode(), guard.pass_value.encode()):
        return None
    if request.method == "POST" and request.url.path == "/token":
        form = parse_qs(await _form(request))
        given, onward = (form.get(name, [""])[0] for name in ("token", "onward"))
        return (
            _let_in(request, guard, onward) if guard.accepts(given.strip()) else _ask(request, True, onward)
        )
    return _ask(request, False)


def _let_in(request: Request, guard: Guard, onward: str) -> Response:
    response = RedirectResponse(_here(onward), 303)
    response.set_cookie(_cookie(request), guard.pass_value, path="/", httponly=True, samesite="strict")
    return response


def _ask(request: Request, wrong: bool, onward: str | None = None) -> Response:
    """Ask for the token: by a page where a page was asked for, else in a line."""
    if "text/html" not in request.headers.get("accept", ""):
        return PlainTextResponse("This server asks for a token: open its page, and give it there.\n", 401)
    page = _token_page().render(onward=_here(onward or _without_token(request)), wrong=wrong)
    return HTMLResponse(page, 401)


@cache
def _token_page() -> Template:
    source = files(__package__).joinpath("templates", "token.html").read_text(encoding="utf-8")
    return Environment(autoescape=True).from_string(source)


def _cookie(request: Request) -> str:
    """Name the cookie by the port, for the ports of a host share their cookies."""
    return f"motionary_{(request.scope.get('server') or ('', 0))[1]}"


def _without_token(request: Request) -> str:
    """Return the path and query that were asked for, less the token; the start where it was no page."""
    if request.method not in _READING:
        return "/"
    query = urlencode([pair for pair in parse_qsl(request.url.query) if pair[0] != "token"])
    return quote(request.url.path) + (f"?{query}" if query else "")


def _here(onward: str) -> str:
    """Return a path of this server, whatever is given; browsers take two slashes for another host."""
    inside = onward.startswith("/") and onward[1:2] not in ("/", "\\") and onward.isprintable()
    return onward if inside else "/"


async def _form(request: Request) -> str:
    """Read a short form; nothing of one that is long or breaks off."""
    body = b""
    try:
        async for piece in request.stream():
            body += piece
            if len(body) > _LONGEST_FORM:
                return ""
    except ClientDisconnect:
        return ""
    return body.decode("ascii", "replace")
