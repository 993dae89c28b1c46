"""One writer a catalog: who publishes holds a lock, and who comes second is told who that is.

The lock is the operating system's, on a file of the catalog's folder, so that it ends with the process that
holds it, however that ends. A record beside it says who writes; it is removed at the end, good or bad. A
record without a lock was left by a writer that died, whose place the next one takes.

Readers need no lock: they keep the snapshot that they opened. Folders that are not local have no such lock;
there one writer at a time is the caller's promise.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from filelock import FileLock, Timeout
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.errors import CatalogError
from motionary.catalog.store import Store

LOCK, RECORD = ".writer.lock", ".writer.json"


@dataclass(frozen=True)
class Writer:
    """A process that writes a catalog.

    Parameters
    ----------
    host : str
    process : int
        Its number on that host.
    started : str
        When it took the lock, ISO 8601.
    """

    host: str
    process: int
    started: str

    def __str__(self) -> str:
        return f"process {self.process} on {self.host}, since {self.started}"


@contextmanager
def the_only_writer(store: Store, take_over: Callable[[Writer], object]) -> Iterator[None]:
    """Hold a catalog's lock.

    Parameters
    ----------
    store : Store
        Its folder exists.
    take_over : callable
        Told of a writer that died without an end.

    Raises
    ------
    CatalogError
        Another process holds it; the message names its host, number and start.
    """
    if not isinstance(store.filesystem, LocalFileSystem):
        yield
        return
    record = Path(store.path(RECORD))
    lock = FileLock(store.path(LOCK), timeout=0)
    try:
        lock.acquire()
    except Timeout:
        writer = _recorded(record)
        raise CatalogError(
            f"catalog {store.url} is being written by {writer or 'another process'}; "
            "wait for its end, or stop it"
        ) from None
    try:
        if dead := _recorded(record):
            take_over(dead)
        mine = Writer(platform.node(), os.getpid(), datetime.now(UTC).isoformat(timespec="seconds"))
        store.write(RECORD, json.dumps(asdict(mine)).encode())
        yield
    finally:
        # Only a process that dies leaves its record; a fault or an interruption is told where it happens.
        record.unlink(missing_ok=True)
        lock.release()


def _recorded(record: Path) -> Writer | None:
    """Read who wrote the record; None where there is none, or one that was cut short."""
    try:
        return Writer(**json.loads(record.read_text()))
    except (FileNotFoundError, ValueError, TypeError):
        return None
