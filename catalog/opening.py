"""Opening a snapshot: which one is meant, and holding it before it is read."""

from __future__ import annotations

import re
import time
from contextlib import suppress

from motionary.catalog.errors import CatalogError
from motionary.catalog.leases import Lease, take_lease
from motionary.catalog.snapshot import (
    Snapshot,
    current_id,
    is_aside,
    lost,
    read_snapshot,
    snapshot_ids,
)
from motionary.catalog.store import Store

_RUN = re.compile(r"\d{8}T\d{6}Z-(\d+)")
_LOOKS, _PAUSE, _MANY = 100, 0.02, 20


def open_snapshot(store: Store, wanted: int | str | None = None) -> tuple[Snapshot, Lease | None]:
    """Read a catalog's current snapshot or another, and hold it against vacuum.

    Parameters
    ----------
    store : Store
    wanted : int or str, optional
        A snapshot's number, or a run's id; the current snapshot by default.

    Raises
    ------
    CatalogError
        Nothing is published, there is no such snapshot, or its manifest is damaged.
    """
    return _open_current(store) if wanted is None else _open_earlier(store, wanted)


def _open_current(store: Store) -> tuple[Snapshot, Lease | None]:
    while (snapshot_id := current_id(store)) is not None:
        lease = take_lease(store, snapshot_id)
        try:
            return read_snapshot(store, snapshot_id), lease
        except FileNotFoundError as error:
            _give_up(lease)
            if current_id(store) == snapshot_id:  # else it was replaced, and vacuumed, since we read its id
                raise lost(store, snapshot_id, error) from None
    raise _not_a_catalog(store)


def _open_earlier(store: Store, wanted: int | str) -> tuple[Snapshot, Lease | None]:
    run = _RUN.fullmatch(str(wanted))
    number = run[1] if run else str(wanted)
    snapshot_id = f"{int(number):06d}" if number.isascii() and number.isdigit() else ""
    for _ in range(_LOOKS):
        aside = is_aside(store, snapshot_id)
        if snapshot_id in snapshot_ids(store):
            lease = take_lease(store, snapshot_id)
            with suppress(FileNotFoundError):
                snapshot = read_snapshot(store, snapshot_id)
                if run is None or _has_run(store, snapshot, str(wanted)):
                    return snapshot, lease
                aside = False
            _give_up(lease)
        if not aside:
            break
        time.sleep(_PAUSE)  # vacuum looks whether anybody holds it, and may put it back
    if current_id(store) is None:
        raise _not_a_catalog(store)
    raise CatalogError(
        f"there is no snapshot {wanted!r} in {store.url}, or no longer; there are {_listed(store)}"
    )


def _has_run(store: Store, snapshot: Snapshot, run_id: str) -> bool:
    return run_id in store.read(snapshot.tables["runs"])["run_id"].to_pylist()


def _give_up(lease: Lease | None) -> None:
    if lease is not None:
        lease.release()


def _listed(store: Store) -> str:
    """Name the snapshots that there are; of many, the first and the last."""
    ids = snapshot_ids(store)
    return ", ".join(ids if len(ids) <= _MANY else [ids[0], "...", *ids[-_MANY:]])


def _not_a_catalog(store: Store) -> CatalogError:
    return CatalogError(f"{store.url} is not a catalog; make one with: motionary run LIBRARY {store.url}")
