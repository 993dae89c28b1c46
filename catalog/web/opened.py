"""The published snapshot, as long as it is the published one, and what was made of it.

Every request asks once and works on what it got: a request that runs while another snapshot is published
ends on the one it began with. Whether another is published is looked up once a second at most, for a store
may be far away; what this server itself publishes is looked up at once. What a page needs again (answers,
thumbnails, charts) is made once, by whoever asks first, and the others wait for that. A part of a catalog
never changes under its name, so what was made of some tables alone is still right in a snapshot that names
the same files of them: a new label draws no thumbnail anew, and moves nothing on the map.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from importlib.metadata import version
from time import monotonic
from typing import Any, TypeVar

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.snapshot import current_id
from motionary.catalog.store import Store

T = TypeVar("T")

LOOK_EVERY = 1.0
"""Seconds for which the published snapshot is taken for the published one."""

MOST_KEPT = 256_000_000
"""Bytes of all that is kept, pickled: the thumbnails of ten thousand clips and much more."""

_MADE_OF = {"thumbnail": ("clips", "frames"), "places": ("clips", "pairs", "runs")}
"""Kinds of things that are made of some tables alone; `runs` holds by which distance clips are compared."""


class CatalogGone(CatalogError):
    """What was a catalog when the application started is none now."""


class Kept:
    """Things that are made once each, the most recently asked for; safe from any thread.

    Parameters
    ----------
    most : int
        Bytes that all of them take together with their keys, pickled.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._made: OrderedDict[Hashable, Future] = OrderedDict()
        self._bytes: dict[Hashable, int] = {}
        self._lock = threading.Lock()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is kept under a key; the first to ask makes it, and the others wait for that.

        What cannot be made raises for all who waited, and is tried again by the next.
        """
        with self._lock:
            waiting = self._made.get(key)
            ours = waiting is None
            future: Future = Future() if waiting is None else waiting
            self._made[key] = future
            self._made.move_to_end(key)
        if ours:
            self._fill(key, future, make)
        return future.result()

    def _fill(self, key: Hashable, future: Future, make: Callable[[], Any]) -> None:
        try:
            made = make()
            size = len(pickle.dumps((key, made), pickle.HIGHEST_PROTOCOL))
        except BaseException as error:
            with self._lock:
                del self._made[key]
            future.set_exception(error)
            return
        future.set_result(made)
        with self._lock:
            self._bytes[key] = size
            if size > self._most:
                self._forget(key)
            while sum(self._bytes.values()) > self._most:
                self._forget(next(one for one in self._made if one in self._bytes))

    def _forget(self, key: Hashable) -> None:
        del self._made[key], self._bytes[key]

    def ready(self, key: Hashable) -> bool:
        """Tell whether something is kept already, and not just being made."""
        with self._lock:
            return key in self._made and self._made[key].done()


class Shown:
    """One snapshot, and what was made of it.

    Parameters
    ----------
    catalog : Catalog
    kept : Kept
        What was made of this catalog's snapshots.

    Attributes
    ----------
    catalog : Catalog
    edition, motions_edition : str
        What the whole snapshot is known by, and its motions.
    """

    def __init__(self, catalog: Catalog, kept: Kept) -> None:
        self.catalog = catalog
        tables = catalog.snapshot.tables
        url = catalog.store.url
        self.edition = _digest(url, catalog.snapshot.snapshot_id, catalog.snapshot.created_at)
        self._kept = kept
        self._editions = {
            kind: _digest(url, *(file for name in names for file in tables.get(name, ())))
            for kind, names in _MADE_OF.items()
        }
        self.motions_edition = self._editions["thumbnail"]

    def keep(self, kind: str, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is kept of a kind, made when it is first asked for of this snapshot.

        Kinds of `_MADE_OF` are kept as long as their tables are the same.
        """
        return self._kept.get(self._name(kind, key), make)

    def ready(self, kind: str, key: Hashable) -> bool:
        """Tell whether that needs no making."""
        return self._kept.ready(self._name(kind, key))

    def _name(self, kind: str, key: Hashable) -> Hashable:
        return kind, self._editions.get(kind, self.edition), key


class Opened:
    """A catalog's published snapshot, opened again when another is published.

    Parameters
    ----------
    url : str
        A folder, or any fsspec URL.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self._store = Store(url)
        self._kept = Kept(MOST_KEPT)
        self._lock = threading.Lock()  # for a moment only: the store is asked outside
        self._due = 0.0
        self._looks = self._latest = 0
        self._state: object = None
        self._shown: Shown | None = None

    def shown(self) -> Shown:
        """Return the published snapshot with what was made of it; ask once a request.

        It was the published one within `LOOK_EVERY`; who asks while it is looked up gets the one before.

        Raises
        ------
        CatalogGone
            Nothing is published there, or no longer.
        CatalogError
            It cannot be opened.
        """
        with self._lock:
            shown, now = self._shown, monotonic()
            if shown is not None and now < self._due:
                return shown
            self._due = now + LOOK_EVERY
        return self.look()

    def look(self) -> Shown:
        """Look up which snapshot is published, now, and return it; raises as `shown`."""
        with self._lock:
            self._looks += 1
            look, state, shown = self._looks, self._state, self._shown
        try:
            published = self._published()
            if shown is None or published != state:
                # The one before closes itself when the last request that reads it ends.
                shown = Shown(Catalog.open(self.url), self._kept)
        except BaseException as error:
            self._failed(look, error)
            raise
        with self._lock:
            if look > self._latest:  # one that began later knows better
                self._latest, self._state, self._shown = look, published, shown
            return self._shown or shown

    def _failed(self, look: int, error: BaseException) -> None:
        """Have everybody look until it works, also where one is shown meanwhile."""
        with self._lock:
            self._due = 0.0
            if isinstance(error, CatalogGone) and look > self._latest:
                self._latest, self._state, self._shown = look, None, None

    def _published(self) -> object:
        """Tell which publication is the current one: its id, and when that was written."""
        snapshot_id = current_id(self._store)
        if snapshot_id is None:
            raise CatalogGone(
                f"{self.url} is not a catalog, or no longer; make one with: motionary run LIBRARY {self.url}"
            )
        return snapshot_id, self._store.modified("CURRENT")


def _digest(*texts: str) -> str:
    """Name an edition: the texts, and the version that makes pages of them."""
    told = hashlib.blake2b(version("motionary").encode(), digest_size=8)
    for text in texts:
        told.update(b"\0" + text.encode())
    return told.hexdigest()
