"""`python -m tests.torture disk`: a disk that is full, a folder that may not be written.

A run of the command line over a library that has grown meets, at its n-th write for every n, one of

- ENOSPC when what was written is forced to the disk,
- EROFS when a file is opened for writing,
- EACCES when a file is put in place.

It must end with exit code 1 and one line that says what, where and what to do; leave no unfinished file and
the old snapshot as it was; and finish when it is run again. Where a small file system may be mounted (in a
namespace of its own), the same with a disk that really is full.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa

from tests.torture import forked
from tests.torture.kill import SETTLED
from tests.torture.world import (
    add_clip,
    contents,
    differences,
    embedded_library,
    linked_copy,
    run_arguments,
    spread,
    take_clips,
)

CLIPS, GAINED = 6, 2
FAULTS = {
    "ENOSPC": ("fsync", errno.ENOSPC),
    "EROFS": ("open", errno.EROFS),
    "EACCES": ("replace", errno.EACCES),
}
FREE_KIB = (0, 8, 32, 64, 128, 256, 512)
"""What the small disks have free when the run begins."""


@dataclass
class Disk:
    """What came of it."""

    refused: Counter[str] = field(default_factory=Counter)
    messages: set[str] = field(default_factory=set)
    finished: int = 0
    skipped: str = ""
    faults: list[str] = field(default_factory=list)


def full_disk(work: Path, every: int = 1) -> Disk:
    """Run into every fault; with `every` 3, at each third write only."""
    forked.warm_up(work)
    embedded, library, before = embedded_library(work / "embedded"), work / "library", work / "before"
    for folder in (library, before):
        shutil.rmtree(folder, ignore_errors=True)
    take_clips(embedded, library, CLIPS)
    log, found = work / "log.txt", Disk()
    _must_end_well(run_arguments(library, before), log)
    old = forked.call(partial(contents, before))
    for name in spread(embedded)[CLIPS : CLIPS + GAINED]:
        add_clip(embedded, library, name)
    time.sleep(SETTLED)
    catalog = _copy(before, work / "catalog")
    _must_end_well(run_arguments(library, catalog), log)
    new = forked.call(partial(contents, catalog))
    for name, (operation, code) in FAULTS.items():
        number, more = 0, True
        while more:
            catalog = _copy(before, work / "catalog")
            arguments = run_arguments(library, catalog)
            ended = forked.wait(
                forked.start(arguments, log, partial(_inject, operation, number, code, catalog))
            )
            more = ended != 0
            if more:
                _judge(f"{name} at write {number}", ended, log, catalog, found)
                _finish(f"{name} at write {number}", arguments, log, catalog, (old, new), found)
                found.refused[name] += 1
            number += every
    _small_disks(work, library, before, found)
    return found


def print_disk(found: Disk) -> None:
    """Print the counts."""
    for name, count in found.refused.items():
        print(f"{name:8} refused with one line, old snapshot intact  {count}")
    print(f"finished when run again                              {found.finished}")
    if found.skipped:
        print(f"real full disk: skipped, {found.skipped}")
    for message in sorted(found.messages):
        print(f"  {message}")
    print(f"faults                                               {len(found.faults)}")
    for fault in found.faults[:20]:
        print(f"\nFAULT disk {fault}")


def _judge(place: str, ended: int | None, log: Path, catalog: Path, found: Disk) -> None:
    """Look at what a run that could not write said and left."""
    text = log.read_text(errors="replace")
    told = [line for line in text.splitlines() if line.startswith("motionary: ")]
    if ended != 1 or "Traceback" in text or len(told) != 1:
        found.faults.append(f"{place}: ended with {ended} and says {text[-1500:]!r}")
    elif str(catalog) not in told[0] or ";" not in told[0] or "Errno" in told[0]:
        found.faults.append(f"{place}: does not say what, where and what to do: {told[0]!r}")
    else:
        found.messages.add(_without_place(told[0], catalog))
    left = [str(path.relative_to(catalog)) for path in catalog.rglob("*.tmp")]
    if left:
        found.faults.append(f"{place}: leaves {left}")


def _without_place(message: str, catalog: Path) -> str:
    words = message.replace(str(catalog), "CATALOG").split()
    return " ".join("CATALOG/..." if word.startswith("CATALOG/") else word for word in words)


def _finish(
    place: str,
    arguments: list[str],
    log: Path,
    catalog: Path,
    tables: tuple[Mapping[str, pa.Table], Mapping[str, pa.Table]],
    found: Disk,
) -> None:
    """Compare with the old snapshot, run again, and compare with the new."""
    old, new = tables
    published = (catalog / "CURRENT").read_text() != "000001"
    different = forked.call(lambda: differences(new if published else old, contents(catalog)))
    found.faults += [f"{place}: table {one} differs" for one in different]
    if (code := forked.wait(forked.start(arguments, log))) != 0:
        found.faults.append(f"{place}: the next run ends with {code}: {log.read_text()[-1500:]}")
        return
    different = [] if published else forked.call(lambda: differences(new, contents(catalog)))
    found.faults += [f"{place}: after the next run table {one} differs" for one in different]
    found.finished += not different


def _inject(operation: str, number: int, code: int, catalog: Path) -> None:
    """Make the `number`-th operation on a file of the catalog fail in this process."""
    count = -1

    def fails(path: str) -> bool:
        nonlocal count
        if not path.startswith(f"{catalog}/") or path.startswith((f"{catalog}/leases", f"{catalog}/.writer")):
            return False  # the lock and the leases are no writes of a run's
        count += 1
        return count == number

    def watched(original: Callable, path_of: Callable[..., str]) -> Callable:
        def operate(*arguments: Any, **options: Any) -> Any:
            path = path_of(*arguments, **options)
            if path and fails(path):
                raise OSError(code, os.strerror(code), *([] if operation == "fsync" else [path]))
            return original(*arguments, **options)

        return operate

    if operation == "fsync":
        os.fsync = watched(os.fsync, lambda file: str(Path(f"/proc/self/fd/{file}").readlink()))
    elif operation == "replace":
        os.replace = watched(os.replace, lambda source, target: str(target))
    else:
        Path.open = watched(Path.open, _written)  # type: ignore[method-assign]


def _written(path: Path, mode: str = "r", *others: object, **options: object) -> str:
    return str(path) if set(mode) & set("wax+") else ""


def _small_disks(work: Path, library: Path, before: Path, found: Disk) -> None:
    """Run on file systems that are too small, each in a mount namespace of its own."""
    unshare = shutil.which("unshare")
    possible = unshare and subprocess.run(
        [unshare, "-Urm", "mount", "-t", "tmpfs", "none", str(work)], capture_output=True, check=False
    )
    if not unshare or not possible or possible.returncode:
        found.skipped = "no tmpfs can be mounted here (it takes unshare and user namespaces)"
        return
    mount = work / "small-disk"
    mount.mkdir(exist_ok=True)
    for free in FREE_KIB:
        done = subprocess.run(
            [unshare, "-Urm", sys.executable, "-m", "tests.torture.small_disk",
             str(free), str(mount), str(before), str(library)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode:
            found.faults.append(f"disk with {free} KiB free: {done.stdout[-500:]}{done.stderr[-1500:]}")
        else:
            outcome, _, message = done.stdout.strip().partition(" ")
            found.refused["tmpfs"] += outcome == "refused"
            found.finished += 1
            if message:
                found.messages.add(message)


def _copy(catalog: Path, to: Path) -> Path:
    shutil.rmtree(to, ignore_errors=True)
    return linked_copy(catalog, to)


def _must_end_well(arguments: list[str], log: Path) -> None:
    if (code := forked.wait(forked.start(arguments, log))) != 0:
        raise RuntimeError(f"a run with nothing in its way ended with {code}: {log.read_text()[-1500:]}")
