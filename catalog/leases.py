"""Leases: which snapshots readers have open, so that vacuum leaves those alone.

A reader of a catalog on disk holds the operating system's lock on a file of its own,
`leases/<snapshot>.<uuid>`, from before it reads the manifest until it is closed, is collected as garbage, or
its process ends, however that ends. Nobody waits: a reader whose snapshot goes away between its choice and
its lease chooses again, and vacuum takes a manifest out of sight *before* it looks for leases, so that one of
the two always sees the other.

A reader that may not write in the catalog holds no lease, nor does one of a catalog that is not on disk;
vacuum's grace time protects them.
"""

from __future__ import annotations

import os
import weakref
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from filelock import FileLock
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.store import Store

LEASES = "leases"

_PATIENCE = 1.0
"""Seconds for a lock that only vacuum can hold, for a moment; a file system without locks never gives it."""


class Lease:
    """A reader's hold on a snapshot; it ends with `release`, or with the object."""

    def __init__(self, lock: FileLock) -> None:
        self._end = weakref.finalize(self, _end, lock, os.getpid())

    def release(self) -> None:
        """Give the snapshot up; a second time does nothing."""
        self._end()


def take_lease(store: Store, snapshot_id: str) -> Lease | None:
    """Hold a snapshot, whether or not it is there: read its manifest afterwards.

    Returns
    -------
    Lease or None
        None where the catalog is not on disk or may not be written.
    """
    if not isinstance(store.filesystem, LocalFileSystem):
        return None
    folder = Path(store.path(LEASES))
    try:
        folder.mkdir(exist_ok=True)
        while folder.exists():
            path = folder / f"{snapshot_id}.{uuid4().hex}"
            lock = _OwnLock(path, thread_local=False)
            with suppress(FileNotFoundError):
                lock.acquire(timeout=_PATIENCE)
            if lock.is_locked and path.exists():
                return Lease(lock)
            lock.release()  # vacuum found it before it was locked, and took it for a dead reader's
    except (OSError, NotImplementedError):
        pass
    return None


def is_leased(store: Store, snapshot_id: str) -> bool:
    """Say whether a reader holds a snapshot of a catalog on disk."""
    return any([_is_live(path) for path in _lease_files(store, snapshot_id)])


def remove_dead_leases(store: Store) -> None:
    """Remove what readers left that died without an end."""
    for path in _lease_files(store, "*"):
        _is_live(path)


class _OwnLock(FileLock):
    """A lock that belongs to one process: a forked child, which shares it, does not give it up."""

    def __init__(self, path: Path, thread_local: bool) -> None:
        super().__init__(path, thread_local=thread_local)
        self.process = os.getpid()

    def _release(self) -> None:
        if os.getpid() == self.process:
            super()._release()


def _end(lock: FileLock, process: int) -> None:
    if os.getpid() == process:
        lock.release()
        with suppress(OSError):
            Path(lock.lock_file).unlink()


def _lease_files(store: Store, snapshot_id: str) -> list[Path]:
    if not isinstance(store.filesystem, LocalFileSystem):
        return []
    return list(Path(store.path(LEASES)).glob(f"{snapshot_id}.*"))


def _is_live(path: Path) -> bool:
    """Try the lock of a lease; who gets it removes the file, for its reader is gone."""
    lock = FileLock(path)
    try:
        lock.acquire(blocking=False)
    except FileNotFoundError:
        return False
    except OSError:  # somebody else's, or not ours to open: presume a reader
        return True
    with suppress(OSError):
        path.unlink()
    lock.release()
    return False
