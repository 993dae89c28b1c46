"""The list of what to review, made in the background and kept while labels change.

`motionary.catalog.review` asks all pairs, which takes a minute for 10,000 clips, and a label that somebody
sets publishes a snapshot: made anew for each, the list would never be there. So it stays until a run has
published or it is asked for again, and what was decided meanwhile is looked up when it is shown.
"""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from motionary.catalog.query import Catalog
from motionary.catalog.review import review

PATIENCE = 2.0
"""Seconds that a page waits for a list before it says that one is being made."""


@dataclass(frozen=True)
class Listed:
    """A list of what to review.

    Parameters
    ----------
    snapshot : str
        What it was made of.
    rows : list of dict
        As `motionary.catalog.review.REVIEW` has them, the most urgent first.
    """

    snapshot: str
    rows: list[dict[str, Any]]


class ReviewQueue:
    """Keeps the list of one catalog; safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._run: object = None
        self._listed: Future[Listed] | None = None

    def listed(self, catalog: Catalog, again: bool = False) -> Listed | None:
        """Return the list of a catalog's last run; None where it takes longer than `PATIENCE`.

        Parameters
        ----------
        catalog : Catalog
            The published snapshot.
        again : bool
            Make it anew, where it is not of this snapshot.

        Raises
        ------
        CatalogError
            It cannot be made.
        """
        with self._lock:
            run = tuple(catalog.files("runs"))
            made = self._listed is not None and self._listed.done() and self._run == run
            stale = again and made and self._snapshot() != catalog.snapshot.snapshot_id
            if self._listed is None or self._run != run or stale or (made and self._listed.exception()):
                self._run, self._listed = run, Future()
                # Not of a pool, whose threads the interpreter waits for when it ends.
                threading.Thread(target=_make, args=(catalog, self._listed), daemon=True).start()
            future = self._listed
        try:
            return future.result(timeout=PATIENCE)
        except TimeoutError:
            return None

    def _snapshot(self) -> str | None:
        failed = self._listed is None or self._listed.exception() is not None
        return None if failed or self._listed is None else self._listed.result().snapshot


def _make(catalog: Catalog, future: Future[Listed]) -> None:
    try:
        future.set_result(Listed(catalog.snapshot.snapshot_id, review(catalog).to_pylist()))
    except Exception as error:  # for whoever waits
        future.set_exception(error)
