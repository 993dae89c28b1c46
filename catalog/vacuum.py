"""Vacuum: old snapshots go, and the files that no other names with them.

Kept are the current snapshot, the newest `keep`, those younger than `days`, those that a reader holds (see
`leases`), and those that were current until less than `grace_hours` ago: what protects readers without a
lease, which are all readers of an object store. A file that no manifest names yet is left for as long, since
a run that was cut short finds it again.

Manifests go first, then files, so that whenever it is cut short every manifest that is left is whole. A
manifest is put aside under another name, and only then is it looked whether a reader holds it: a reader locks
first and reads the manifest then, so that either vacuum sees the lock or the reader misses the manifest. One
left aside by a vacuum that died is put back by the next.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.errors import CatalogError
from motionary.catalog.leases import is_leased, remove_dead_leases
from motionary.catalog.snapshot import (
    ASIDE,
    SNAPSHOTS,
    Snapshot,
    aside_name,
    current_snapshot,
    lost,
    manifest_name,
    read_snapshot,
    snapshot_ids,
)
from motionary.catalog.store import Store

_UNFINISHED = re.compile(r"\.[0-9a-f]{32}\.tmp$")


@dataclass(frozen=True)
class Vacuumed:
    """What a vacuum removed, or would remove.

    Parameters
    ----------
    snapshots : tuple of str
        Ids of the snapshots removed.
    files, bytes : int
        Files removed, and their lengths together.
    held : tuple of str
        Ids of the snapshots that only an open reader keeps.
    """

    snapshots: tuple[str, ...]
    files: int
    bytes: int
    held: tuple[str, ...]


def vacuum(
    store: Store,
    keep: int | None = None,
    days: float | None = None,
    grace_hours: float = 1.0,
    dry_run: bool = False,
) -> Vacuumed:
    """Remove old snapshots, and the files that no other snapshot names.

    The caller holds the catalog's lock: see `motionary.catalog.writer_lock`.

    Parameters
    ----------
    store : Store
        Of the catalog.
    keep : int, optional
        Keep this many of the newest snapshots; the current one is always kept.
    days : float, optional
        Keep snapshots made less than this many days ago, too.
    grace_hours : float
        Keep what was current less than this many hours ago, and files younger than that.
    dry_run : bool
        Only tell what would be removed.

    Raises
    ------
    ValueError
        `keep` is less than 1, `days` or `grace_hours` less than 0.
    CatalogError
        There is no catalog, or the manifest of a snapshot that is to be kept cannot be read. Nothing has been
        removed that a snapshot names.
    """
    if (keep is not None and keep < 1) or (days is not None and days < 0) or grace_hours < 0:
        raise ValueError(
            f"keep {keep} must be at least 1, days {days} and grace_hours {grace_hours} at least 0"
        )
    current = current_snapshot(store)
    if current is None:
        raise CatalogError(f"{store.url} is not a catalog: nothing to vacuum")
    now, grace = datetime.now(UTC), timedelta(hours=grace_hours)
    _put_back(store)
    manifests = _read_all(store)
    kept = _kept(manifests, current, keep, None if days is None else timedelta(days=days), grace, now)
    named = _files_of(store, manifests, kept)

    old = [one for one in manifests if one not in kept]
    held = [one for one in old if (is_leased(store, one) if dry_run else not _retire(store, one))]
    named |= _files_of(store, manifests, held)
    if not dry_run:
        store.settle(SNAPSHOTS)
        remove_dead_leases(store)
    unnamed = _unnamed(store, named, now - grace)
    if not dry_run:
        for file in unnamed:
            store.delete(file)
    gone = [one for one in old if one not in held]
    return Vacuumed(tuple(gone), len(unnamed), sum(unnamed.values()), tuple(held))


def _put_back(store: Store) -> None:
    """Put back the manifests that a vacuum which died had put aside."""
    for path in store.names(SNAPSHOTS):
        if path.endswith(ASIDE):
            name = f"{SNAPSHOTS}/{posixpath.basename(path)}"
            store.rename(name, name.removesuffix(ASIDE))


def _read_all(store: Store) -> dict[str, Snapshot | CatalogError]:
    """Read every manifest; one that cannot be read is its error."""
    manifests: dict[str, Snapshot | CatalogError] = {}
    for snapshot_id in snapshot_ids(store):
        try:
            manifest = read_snapshot(store, snapshot_id)
            _made(manifest)
            manifests[snapshot_id] = manifest
        except CatalogError as error:
            manifests[snapshot_id] = error
        except ValueError as error:
            manifests[snapshot_id] = lost(store, snapshot_id, error)
    return manifests


def _kept(
    manifests: Mapping[str, Snapshot | CatalogError],
    current: Snapshot,
    keep: int | None,
    age: timedelta | None,
    grace: timedelta,
    now: datetime,
) -> set[str]:
    """Choose the snapshots that the rules keep, readers apart."""
    kept = {current.snapshot_id, *(list(manifests)[-keep:] if keep else ())}
    replaced = _replaced(manifests, current)
    for snapshot_id, manifest in manifests.items():
        # Of which it is not known when it was made, or ceased to be current, is kept.
        made = now if isinstance(manifest, CatalogError) else _made(manifest)
        if (age is not None and now - made < age) or now - replaced.get(snapshot_id, now) < grace:
            kept.add(snapshot_id)
    return kept


def _replaced(manifests: Mapping[str, Snapshot | CatalogError], current: Snapshot) -> dict[str, datetime]:
    """Tell when each snapshot ceased to be current: when the one published after it was made.

    A manifest of a run that died before it published replaced nothing; so only those count from which the
    current one descends.
    """
    published: list[Snapshot] = [current]
    while (before := manifests.get(published[-1].after or "")) is not None:
        if isinstance(before, CatalogError) or int(before.snapshot_id) >= int(published[-1].snapshot_id):
            break
        published.append(before)
    times = {}
    for snapshot_id in manifests:
        later = [one for one in published if int(one.snapshot_id) > int(snapshot_id)]
        if later:
            times[snapshot_id] = _made(later[-1])
    return times


def _made(snapshot: Snapshot) -> datetime:
    return datetime.fromisoformat(snapshot.created_at).astimezone(UTC)


def _files_of(
    store: Store, manifests: Mapping[str, Snapshot | CatalogError], snapshots: Iterable[str]
) -> set[str]:
    files: set[str] = set()
    for snapshot_id in snapshots:
        manifest = manifests[snapshot_id]
        if isinstance(manifest, CatalogError):
            raise CatalogError(
                f"snapshot {snapshot_id} is to be kept, but which files it names cannot be read: vacuum "
                f"stops. Restore {store.full_path(manifest_name(snapshot_id))}, or remove it and so the "
                f"snapshot ({manifest})"
            )
        files.update(manifest.files)
    return files


def _retire(store: Store, snapshot_id: str) -> bool:
    """Remove a manifest unless a reader holds it; say whether it is gone."""
    if not isinstance(store.filesystem, LocalFileSystem):
        store.delete(manifest_name(snapshot_id))
        return True
    manifest, aside = manifest_name(snapshot_id), aside_name(snapshot_id)
    store.rename(manifest, aside)
    if is_leased(store, snapshot_id):
        store.rename(aside, manifest)
        return False
    store.delete(aside)
    return True


def _unnamed(store: Store, named: set[str], before: datetime) -> dict[str, int]:
    """List the parts that nothing names, and files that were never finished, if they are old enough."""
    found = {
        name: size
        for name, size in store.sizes("").items()
        if (name.startswith("tables/") and name not in named) or _UNFINISHED.search(name)
    }
    return {name: size for name, size in found.items() if store.modified(name) <= before}
