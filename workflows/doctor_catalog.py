"""What the doctor looks at in a catalog: its storage, its folder, its state and its writer."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from uuid import uuid4

from filelock import FileLock, Timeout
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.snapshot import current_snapshot
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import LOCK, RECORD, Writer
from motionary.workflows.doctor import Finding
from motionary.workflows.versions import versions

Look = Callable[[], Iterator[Finding]]


def looks_at(catalog: str) -> list[tuple[str, Look]]:
    """List what is to be looked at in a catalog, by name."""
    store = Store(catalog)
    if not isinstance(store.filesystem, LocalFileSystem):
        return [("storage", partial(_elsewhere, store)), ("snapshot", partial(_snapshot, store))]
    return [
        ("storage", partial(_on_disk, store)),
        ("snapshot", partial(_snapshot, store)),
        ("disk", partial(_room, store)),
        ("folder", partial(_folder, store)),
        ("left over", partial(_left_over, store)),
        ("writer", partial(_writer, store)),
    ]


def _on_disk(store: Store) -> Iterator[Finding]:
    folder = Path(store.path(""))
    there = "" if folder.exists() else "; it is not there yet, a run makes it"
    yield Finding("NOTE", "storage", f"{folder} on disk: locks keep a second writer out{there}")


def _elsewhere(store: Store) -> Iterator[Finding]:
    """Try to write, read and remove an object."""
    yield Finding(
        "NOTE",
        "storage",
        f"{store.url} is not on this disk: no lock keeps a second writer out, so start one run at a time; "
        "where the store writes on condition (S3), of two that publish at once one is refused. Readers "
        "hold no lease: vacuum leaves what was current within its grace time",
    )
    name, content = f".doctor-{uuid4().hex}", b"motionary"
    try:
        store.filesystem.pipe_file(store.path(name), content)
        read = store.read_bytes(name)
        store.filesystem.rm_file(store.path(name))
    except Exception as error:  # every store has errors of its own
        mend = "check the address, and the permission to write, read and delete there"
        yield Finding("FAILED", "access", f"{type(error).__name__}: {error}", mend)
        return
    if read == content:
        yield Finding("PASSED", "access", "an object can be written, read and removed")
    else:
        yield Finding("FAILED", "access", "an object came back changed", "use another store")


def _snapshot(store: Store) -> Iterator[Finding]:
    """Tell what is published, and whether the same versions would compute it again."""
    snapshot = current_snapshot(store)
    if snapshot is None:
        yield Finding("NOTE", "snapshot", f"nothing is published at {store.url}")
        return
    yield Finding("PASSED", "snapshot", f"{snapshot.snapshot_id} of {snapshot.created_at}")
    here = versions()
    other = [
        f"{name} {made} (here {here[name]})"
        for name, made in sorted(snapshot.versions.items())
        if name in here and here[name] != made
    ]
    if other:
        yield Finding("NOTE", "versions", f"the snapshot was computed by {', '.join(other)}")


def _room(store: Store) -> Iterator[Finding]:
    """Compare the free space with what the current snapshot takes, which a run may write anew."""
    snapshot = current_snapshot(store)
    needed = sum(facts.bytes for facts in snapshot.parts.values()) if snapshot else 0
    free = shutil.disk_usage(_existing(Path(store.path("")))).free
    detail = f"{free / 2**20:.0f} MiB free, the current snapshot takes {needed / 2**20:.0f} MiB"
    if free > needed:
        yield Finding("PASSED", "disk", detail)
    else:
        mend = "a run that computes everything needs as much again: make room, or motionary vacuum"
        yield Finding("FAILED", "disk", detail, mend)


def _folder(store: Store) -> Iterator[Finding]:
    """Try in a catalog's folder what publishing does there, in a temporary folder that is removed."""
    folder = _existing(Path(store.path("")))
    try:
        with TemporaryDirectory(prefix=".doctor-", dir=folder, ignore_cleanup_errors=True) as made:
            for what, attempt, mend in _ATTEMPTS:
                try:
                    attempt(Path(made))
                except (OSError, NotImplementedError) as error:
                    yield Finding("FAILED", what, f"{folder}: {error}", mend)
                else:
                    yield Finding("PASSED", what, f"works in {folder}")
    except OSError as error:
        mend = "let this user write there, or mount it for writing"
        yield Finding("FAILED", "write", f"{folder}: {error}", mend)


def _write(folder: Path) -> None:
    with (folder / "new").open("wb") as file:
        file.write(b"motionary")
        file.flush()
        os.fsync(file.fileno())


def _rename(folder: Path) -> None:
    for name in ("old", "newer"):
        (folder / name).write_text(name)
    (folder / "newer").replace(folder / "old")
    if (folder / "old").read_text() != "newer":
        raise OSError("a file that was replaced still has its old content")
    if os.name == "posix":
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def _lock(folder: Path) -> None:
    with FileLock(folder / "lock", timeout=0):
        try:
            with FileLock(folder / "lock", timeout=0):
                raise OSError("a lock that is held is given to a second one")
        except Timeout:
            return


_ATTEMPTS = (
    ("write", _write, "let this user write there, or mount it for writing; a full disk needs room"),
    ("rename", _rename, "keep the catalog on a disk whose file system replaces files and syncs folders"),
    ("lock", _lock, "keep the catalog on a file system with locks, or start one run at a time"),
)


def _left_over(store: Store) -> Iterator[Finding]:
    """Count what writers began and did not end."""
    folder = Path(store.path(""))
    files = [file for pattern in ("*.tmp", "*/*.tmp", "*/*/*.tmp") for file in folder.glob(pattern)]
    if files:
        names = f"{len(files)} unfinished, the first {files[0]}"
        yield Finding(
            "NOTE", "left over", f"{names}: a run writes them now, or motionary vacuum removes them"
        )
    else:
        yield Finding("PASSED", "left over", "no unfinished files")


def _writer(store: Store) -> Iterator[Finding]:
    """Tell who writes the catalog, or died of it."""
    try:
        writer = Writer(**json.loads(Path(store.path(RECORD)).read_text()))
    except (FileNotFoundError, NotADirectoryError):
        yield Finding("PASSED", "writer", "nobody writes it")
        return
    except (ValueError, TypeError):
        yield Finding("NOTE", "writer", f"{store.path(RECORD)} was cut short; the next run replaces it")
        return
    try:
        FileLock(store.path(LOCK), timeout=0).acquire().lock.release()
    except Timeout:
        yield Finding("NOTE", "writer", f"{writer} is writing it; a second run is refused until it ends")
    else:
        yield Finding("NOTE", "writer", f"{writer} died while writing; the next run takes its place")


def _existing(folder: Path) -> Path:
    """Return a folder, or the nearest above it that is there."""
    folder = folder.absolute()
    return next(one for one in (folder, *folder.parents) if one.exists())
