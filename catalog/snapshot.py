"""Snapshots: which parts make up the catalog at one moment.

A snapshot is a manifest, `snapshots/<id>.json`, that lists the files of every table. `CURRENT` holds the id
of the published one. Publishing writes the manifest and then replaces `CURRENT` in one step, so that a
reader sees the old catalog or the new one, and an interrupted run leaves the old.
"""

from __future__ import annotations

import json
import posixpath
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from motionary.catalog.errors import CatalogError
from motionary.catalog.schema import PUBLISHED, VERSION
from motionary.catalog.store import Store

CURRENT = "CURRENT"
SNAPSHOTS = "snapshots"
OVERVIEW = "overview.html"
"""The page that a run leaves in the catalog's folder."""


@dataclass(frozen=True)
class Snapshot:
    """A published state of a catalog.

    Parameters
    ----------
    snapshot_id : str
        Six digits, rising.
    created_at : str
        ISO time, UTC.
    tables : mapping of str to list of str
        The files of each table, relative to the catalog, in order.
    schema_version : int
        Of the tables.
    """

    snapshot_id: str
    created_at: str
    tables: Mapping[str, Sequence[str]]
    schema_version: int = VERSION


def current_snapshot(store: Store) -> Snapshot | None:
    """Read the published snapshot, None where nothing has been published.

    Raises
    ------
    CatalogError
        The catalog was written by a later version of motionary, or its manifest is gone.
    """
    try:
        snapshot_id = store.read_bytes(CURRENT).decode().strip()
    except FileNotFoundError:
        return None
    try:
        manifest = json.loads(store.read_bytes(_manifest_name(snapshot_id)))
    except (FileNotFoundError, ValueError) as error:
        raise CatalogError(
            f"the manifest of snapshot {snapshot_id!r} of {store.url} is missing or damaged ({error}); "
            f"write the id of another file of {SNAPSHOTS}/ into {CURRENT}, or run into a new folder"
        ) from None
    if manifest["schema_version"] > VERSION:
        raise CatalogError(
            f"catalog {store.url} has schema version {manifest['schema_version']}, "
            f"this motionary reads up to {VERSION}; install a newer motionary"
        )
    return Snapshot(**manifest)


def next_snapshot_id(store: Store) -> str:
    """Return the id that the next snapshot will have: one more than any manifest that was ever written."""
    written = [posixpath.basename(path).removesuffix(".json") for path in store.names(SNAPSHOTS)]
    return f"{1 + max((int(name) for name in written if name.isdigit()), default=0):06d}"


def publish(store: Store, snapshot: Snapshot) -> None:
    """Make a snapshot the one that readers open.

    Raises
    ------
    ValueError
        A table is missing from the snapshot, or names a file that is not there.
    """
    missing = [table for table in PUBLISHED if not snapshot.tables.get(table)]
    if missing:
        raise ValueError(f"snapshot {snapshot.snapshot_id} lacks the tables {', '.join(missing)}")
    absent = [file for files in snapshot.tables.values() for file in files if not _exists(store, file)]
    if absent:
        raise ValueError(
            f"snapshot {snapshot.snapshot_id} names files that are not there: {', '.join(absent)}"
        )
    manifest = json.dumps(asdict(snapshot), indent=1, sort_keys=True)
    store.write(_manifest_name(snapshot.snapshot_id), manifest.encode())
    store.write(CURRENT, snapshot.snapshot_id.encode())


def _manifest_name(snapshot_id: str) -> str:
    return f"{SNAPSHOTS}/{snapshot_id}.json"


def _exists(store: Store, file: str) -> bool:
    return bool(store.filesystem.exists(store.path(file)))
