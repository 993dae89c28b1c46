"""Snapshots: which parts make up the catalog at one moment.

A snapshot is a manifest, `snapshots/<id>.json`, that lists the files of every table with their rows, sizes
and digests. `CURRENT` holds the id of the published one. Publishing writes the manifest, when everything it
names is on disk, and then replaces `CURRENT` in one step: a reader sees the old catalog or the new one, and
an interrupted run leaves the old.
"""

from __future__ import annotations

import json
import posixpath
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime

from motionary.catalog.errors import CatalogError
from motionary.catalog.schema import PUBLISHED, VERSION
from motionary.catalog.store import PartFacts, Store

CURRENT = "CURRENT"
SNAPSHOTS = "snapshots"
ASIDE = ".going"
OVERVIEW = "overview.html"
"""The page that a run leaves in the catalog's folder."""

_LONGEST_ID = 18
_PART = re.compile(r"tables/\w+/[\w.-]+\.parquet", re.ASCII)


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
        The files of every table, relative to the catalog, in order.
    parts : mapping of str to PartFacts
        What each of those files is known by.
    stages : mapping of str to str
        The digest of each stage's version and settings.
    versions : mapping of str to str
        Of motionary, Python and the libraries that computed it.
    schema_version : int
        Of the tables.
    after : str, optional
        Id of the snapshot that was current before; publishing fills it in.
    """

    snapshot_id: str
    created_at: str
    tables: Mapping[str, Sequence[str]]
    parts: Mapping[str, PartFacts] = field(default_factory=dict)
    stages: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    schema_version: int = VERSION
    after: str | None = None

    @property
    def files(self) -> list[str]:
        """Every file of every table."""
        return [file for files in self.tables.values() for file in files]


def current_snapshot(store: Store) -> Snapshot | None:
    """Read the published snapshot, None where nothing has been published.

    Raises
    ------
    CatalogError
        The catalog was written by a later version of motionary, or its manifest is gone or damaged.
    """
    snapshot_id = current_id(store)
    if snapshot_id is None:
        return None
    try:
        return read_snapshot(store, snapshot_id)
    except FileNotFoundError as error:
        raise lost(store, snapshot_id, error) from None


def current_id(store: Store) -> str | None:
    """Read which snapshot is published, None where nothing has been.

    Raises
    ------
    CatalogError
        `CURRENT` holds no snapshot's id, or the store is a file.
    """
    try:
        content = store.read_bytes(CURRENT)
    except FileNotFoundError:
        return None
    except NotADirectoryError:
        raise CatalogError(f"{store.url} is a file; a catalog is a folder, name that") from None
    name = content.decode(errors="replace").strip()
    if not _is_id(name):
        raise CatalogError(f"{store.full_path(CURRENT)} holds {name[:40]!r}, not a snapshot's id; {_MEND}")
    return name


def snapshot_ids(store: Store) -> list[str]:
    """List the snapshots whose manifests are there, oldest first."""
    names = [posixpath.basename(path) for path in store.names(SNAPSHOTS)]
    ids = [name.removesuffix(".json") for name in names if name.endswith(".json")]
    return sorted(filter(_is_id, ids), key=int)


def next_snapshot_id(store: Store) -> str:
    """Return the id that the next snapshot will have: one more than any manifest that is there."""
    return f"{1 + max(map(int, snapshot_ids(store)), default=0):06d}"


def read_snapshot(store: Store, snapshot_id: str) -> Snapshot:
    """Read a snapshot's manifest.

    Raises
    ------
    FileNotFoundError
        There is none.
    CatalogError
        It is damaged, or a later version of motionary wrote it.
    """
    content = store.read_bytes(manifest_name(snapshot_id))
    try:
        manifest = json.loads(content)
        version = int(manifest["schema_version"])
        if version <= VERSION:
            return _read_manifest(manifest, snapshot_id)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise lost(store, snapshot_id, error) from None
    raise CatalogError(
        f"catalog {store.url} has schema version {version}, "
        f"this motionary reads up to {VERSION}; install a newer motionary"
    )


def publish(store: Store, snapshot: Snapshot, after: Snapshot | None) -> None:
    """Make a snapshot the one that readers open.

    Where the file system can write on condition (S3), of two writers that publish at once one is refused.
    Elsewhere than on disk and there, one writer at a time is the caller's promise.

    Parameters
    ----------
    store : Store
        Holds every file that the snapshot names.
    snapshot : Snapshot
        With facts of every file.
    after : Snapshot, optional
        The snapshot that it was made from.

    Raises
    ------
    ValueError
        A table is missing from the snapshot, or it names a file that is not there or has no facts.
    CatalogError
        Another snapshot than `after` is current: somebody has published meanwhile. Nothing has changed.
    """
    _require_whole(store, snapshot)
    seen = store.version(CURRENT)
    before = after.snapshot_id if after else None
    found = current_id(store)
    if found != before:
        raise _overtaken(store, f"snapshot {found}")
    content = json.dumps(asdict(replace(snapshot, after=before)), indent=1, sort_keys=True).encode()
    manifest = manifest_name(snapshot.snapshot_id)
    try:
        store.create(manifest, content)
    except FileExistsError:
        raise _overtaken(store, manifest) from None
    try:
        store.replace(CURRENT, snapshot.snapshot_id.encode(), seen)
    except FileExistsError:
        store.delete(manifest)
        raise _overtaken(store, f"snapshot {current_id(store)}") from None


def manifest_name(snapshot_id: str) -> str:
    """Return where a snapshot's manifest lies inside the catalog."""
    return f"{SNAPSHOTS}/{snapshot_id}.json"


def aside_name(snapshot_id: str) -> str:
    """Return where vacuum puts a manifest while it looks whether a reader holds the snapshot."""
    return f"{manifest_name(snapshot_id)}{ASIDE}"


def is_aside(store: Store, snapshot_id: str) -> bool:
    """Say whether vacuum has put a manifest out of the way, for good or for a moment."""
    return bool(store.filesystem.exists(store.path(aside_name(snapshot_id))))


def lost(store: Store, snapshot_id: str, why: object) -> CatalogError:
    """Make the error on a manifest that cannot be used."""
    return CatalogError(
        f"the manifest of snapshot {snapshot_id!r} of {store.url} is missing or damaged ({why}); {_MEND}"
    )


_MEND = f"write the id of another file of {SNAPSHOTS}/ into {CURRENT}, or run into a new folder"


def _require_whole(store: Store, snapshot: Snapshot) -> None:
    missing = [table for table in PUBLISHED if not snapshot.tables.get(table)]
    if missing:
        raise ValueError(f"snapshot {snapshot.snapshot_id} lacks the tables {', '.join(missing)}")
    folders = {posixpath.dirname(file) for file in snapshot.files}
    there = {
        posixpath.join(folder, posixpath.basename(path)) for folder in folders for path in store.names(folder)
    }
    absent = [file for file in snapshot.files if file not in there]
    if absent:
        raise ValueError(
            f"snapshot {snapshot.snapshot_id} names files that are not there: {', '.join(absent)}"
        )
    unknown = [file for file in snapshot.files if file not in snapshot.parts]
    if unknown:
        raise ValueError(f"snapshot {snapshot.snapshot_id} has no facts of {', '.join(unknown)}")


def _overtaken(store: Store, by: str) -> CatalogError:
    return CatalogError(
        f"another run has published {by} of {store.url} meanwhile; this one changed nothing: run it again"
    )


def _read_manifest(manifest: dict, snapshot_id: str) -> Snapshot:
    parts = {str(file): PartFacts(**facts) for file, facts in manifest.get("parts", {}).items()}
    tables = {str(table): [str(file) for file in files] for table, files in manifest["tables"].items()}
    snapshot = Snapshot(**{**manifest, "parts": parts, "tables": tables})
    strange = [file for file in snapshot.files if not _PART.fullmatch(file)]
    if strange:  # a path out of the catalog would let a query read what it names
        raise ValueError(f"{strange[0][:80]!r} is no part's name")
    empty = [table for table, files in tables.items() if not files]
    if empty:
        raise ValueError(f"it names no file of table {empty[0][:40]!r}")
    if snapshot.snapshot_id != snapshot_id:
        raise ValueError(f"it is that of snapshot {str(snapshot.snapshot_id)[:40]!r}")
    if snapshot.after == snapshot_id:
        raise ValueError("it comes after itself")
    datetime.fromisoformat(snapshot.created_at)
    return snapshot


def _is_id(name: str) -> bool:
    return name.isascii() and name.isdigit() and len(name) <= _LONGEST_ID
