"""The published snapshot, as long as it is the published one, and what was made of it.

Every request asks once and works on what it got: a request that runs while another snapshot is published
ends on the one it began with. What a page needs again (answers, thumbnails, charts) is made once, by
whoever asks first, and the others wait for that. A part of a catalog never changes under its name, so what
was made of motions alone is still right in a snapshot that names the same files: a new label draws no
thumbnail anew.
"""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import replace
from importlib.metadata import version
from typing import Any, TypeVar

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.snapshot import current_id
from motionary.catalog.store import Store

T = TypeVar("T")

_MOTION_TABLES = ("clips", "frames")
_LARGE = ("frames", "features", "resampled", "aligned", "pairs", "quarantine")
_MOST = {"thumbnail": 12_000, "figure": 200, "chart": 60, "search": 40, "answer": 300}
"""How many of a kind are kept; a thumbnail is of some 3 kB, a search of as many clip_ids as it found."""


class CatalogGone(CatalogError):
    """What was a catalog when the application started is none now."""


class Kept:
    """Things that are made once each, the most recently asked for; safe from any thread."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._made: OrderedDict[Hashable, Future] = OrderedDict()
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
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        if ours:
            self._fill(key, future, make)
        return future.result()

    def _fill(self, key: Hashable, future: Future, make: Callable[[], Any]) -> None:
        try:
            future.set_result(make())
        except BaseException as error:
            with self._lock:
                if self._made.get(key) is future:
                    del self._made[key]
            future.set_exception(error)

    def ready(self, key: Hashable) -> bool:
        """Tell whether something is kept already, and not just being made."""
        with self._lock:
            return key in self._made and self._made[key].done()


class Shown:
    """One snapshot, and what was made of it.

    Parameters
    ----------
    catalog : Catalog
    before : Shown, optional
        What was shown until now; thumbnails of the same motions are taken over.

    Attributes
    ----------
    catalog : Catalog
    facts : Catalog
        The same without the tables of many files, frames and pairs: what a condition from a page is asked of.
        So it can neither read for minutes nor, where it is wrong, have ten thousands of files looked at for
        damage.
    edition, motions_edition : str
        What the whole snapshot is known by, and its motions.
    """

    def __init__(self, catalog: Catalog, before: Shown | None = None) -> None:
        self.catalog = catalog
        tables = catalog.snapshot.tables
        few = {name: files for name, files in tables.items() if name not in _LARGE}
        self.facts = Catalog(catalog.store, replace(catalog.snapshot, tables=few), catalog.lease)
        url = catalog.store.url
        self.motions_edition = _digest(url, *(file for name in _MOTION_TABLES for file in tables[name]))
        self.edition = _digest(url, catalog.snapshot.snapshot_id, catalog.snapshot.created_at)
        self._kept = {kind: Kept(most) for kind, most in _MOST.items()}
        if before is not None and before.motions_edition == self.motions_edition:
            self._kept["thumbnail"] = before._kept["thumbnail"]

    def keep(self, kind: str, key: Hashable, make: Callable[[], T]) -> T:
        """Return what is kept of a kind (see `_MOST`), made when it is first asked for."""
        return self._kept[kind].get(key, make)

    def ready(self, kind: str, key: Hashable) -> bool:
        """Tell whether that needs no making."""
        return self._kept[kind].ready(key)


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
        self._lock = threading.Lock()
        self._state: object = None
        self._shown: Shown | None = None

    @property
    def catalog(self) -> Catalog:
        """The published snapshot."""
        return self.shown().catalog

    def shown(self) -> Shown:
        """Return the published snapshot with what was made of it; ask once a request.

        Raises
        ------
        CatalogGone
            Nothing is published there, or no longer.
        CatalogError
            It cannot be opened.
        """
        with self._lock:
            state = self._published()
            if self._shown is None or state != self._state:
                # The one before closes itself when the last request that reads it ends.
                self._shown, self._state = Shown(Catalog.open(self.url), self._shown), state
            return self._shown

    def _published(self) -> object:
        """Tell which publication is the current one: its id, and when that was written."""
        snapshot_id = current_id(self._store)
        if snapshot_id is None:
            self._shown = self._state = None
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
