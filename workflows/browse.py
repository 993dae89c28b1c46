"""The pages of a catalog, served until somebody stops it: the address, the token, the end.

On loopback nobody is asked for a token unless one is given; on any other address everybody is. What that
protects, and what not, is said in `motionary.catalog.web.access`.
"""

from __future__ import annotations

import errno
import ipaddress
import os
import secrets
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.web.access import Guard
from motionary.catalog.web.app import create_app
from motionary.catalog.writer_lock import Writer
from motionary.workflows.errors import UserError
from motionary.workflows.relabel import publish_labels

TOKEN = "MOTIONARY_BROWSE_TOKEN"
"""The environment's name of the token, where no file holds one."""

_PATIENCE = 10
"""Seconds for answers under way when it is stopped: a change of a label is published within."""

_MENDS = {
    errno.EADDRINUSE: "another program has that port; name another by --port, or 0 for any that is free",
    errno.EACCES: "this user may not take that port; name one from 1024, or 0 for any that is free",
    errno.EADDRNOTAVAIL: "this machine has no such address; name one of its own by --host",
}


@dataclass(frozen=True)
class LabelEditor:
    """Publishes labels that are set from the pages."""

    url: str
    user: str
    take_over: Callable[[Writer], object]

    def publish(self, changed: Callable[[Catalog], pa.Table]) -> None:
        """Publish them; see `motionary.workflows.relabel.publish_labels`."""
        publish_labels(self.url, changed, self.take_over).close()


@dataclass(frozen=True)
class Place:
    """Where the pages are served.

    Parameters
    ----------
    socket : socket
        Already listening.
    host, port : str, int
        As they are written in the URL.
    loopback : bool
        Whether only this machine reaches it.
    """

    socket: socket.socket = field(repr=False)
    host: str
    port: int
    loopback: bool

    @property
    def url(self) -> str:
        """Its address, without a token."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}/"


@dataclass(frozen=True)
class Token:
    """What is asked for, if anything.

    Parameters
    ----------
    value : str or None
    made : bool
        Whether it was made just now, so that nobody knows it yet.
    """

    value: str | None = field(repr=False)
    made: bool


def take_place(host: str, port: int) -> Place:
    """Listen on an address.

    Parameters
    ----------
    host : str
        An address of this machine, or its name; `0.0.0.0` is all of them.
    port : int
        0 for any that is free.

    Raises
    ------
    UserError
        There is no such address, or its port is taken.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, _, _, _, address = min(found, key=lambda one: one[0] != socket.AF_INET)
        listening = socket.create_server(address[:2], family=family)
    except (socket.gaierror, UnicodeError):
        raise UserError(f"there is no host {host!r}; name an address of this machine by --host") from None
    except OSError as error:
        why = _MENDS.get(error.errno or 0, (error.strerror or str(error)).lower())
        raise UserError(f"cannot listen on {host} port {port}: {why}") from None
    own = ipaddress.ip_address(address[0])
    shown = socket.gethostname() if own.is_unspecified else host
    return Place(listening, shown, listening.getsockname()[1], own.is_loopback)


def find_token(file: Path | None, loopback: bool) -> Token:
    """Read the token from a file, else from the environment; where it is needed and there is none, make one.

    Raises
    ------
    UserError
        The file cannot be read.
    """
    if file is not None:
        try:
            return Token(file.read_text().strip(), made=False)
        except (OSError, ValueError) as error:
            what = (error.strerror if isinstance(error, OSError) else None) or "it is no text"
            raise UserError(
                f"the token file {file} cannot be read ({what.lower()}); write the token there"
            ) from None
    if given := os.environ.get(TOKEN):
        return Token(given.strip(), made=False)
    return Token(None, made=False) if loopback else Token(secrets.token_urlsafe(32), made=True)


def serve(
    url: str, place: Place, token: Token, editor: LabelEditor | None, ready: Callable[[], None]
) -> None:
    """Serve a catalog until SIGINT or SIGTERM.

    Parameters
    ----------
    url : str
        The catalog.
    place : Place
        Whose socket the caller closes.
    token : Token
    editor : LabelEditor or None
        None where nothing may be changed.
    ready : callable
        Called when requests are answered.

    Raises
    ------
    CatalogError
        There is no catalog, or it cannot be opened.
    UserError
        The token cannot be used.
    """
    import uvicorn

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready()

    try:
        guard = Guard(token.value, frozenset({place.host, f"{socket.gethostname()}.local"}))
    except ValueError as error:
        raise UserError(f"{error}; see --token-file") from None
    app = create_app(url, guard=guard, editor=editor)
    server = Server(
        uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,  # which would hold tokens
            server_header=False,
            proxy_headers=False,
            ws="none",
            timeout_graceful_shutdown=_PATIENCE,
        )
    )

    def stop(*_: object) -> None:
        server.should_exit = True

    # Uvicorn raises a signal that stopped it once more, to whoever listened before: that is this function.
    before = {one: signal.signal(one, stop) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        server.run(sockets=[place.socket])
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
