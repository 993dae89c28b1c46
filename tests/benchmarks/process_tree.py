"""Peak memory of a process and of all that it starts, taken from outside while it works.

A page that several processes share counts once: what is added up is each process's proportional share (PSS,
`/proc/PID/smaps_rollup`). Memory of the processes' own is told apart from mapped files, whose pages the
system can drop and read again, and which a limit on memory need not count.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

EVERY = 0.2
"""Seconds between samples."""
_SHARE = 0.02
"""Of the time that sampling may take: to walk the pages of a large process holds that process up."""


@dataclass(frozen=True)
class TreePeak:
    """The most memory that a tree of processes held, in bytes.

    Parameters
    ----------
    total : int
        With mapped files.
    own : int
        Without them; not always at the same moment.
    processes : int
        The most at once.
    samples : int
    """

    total: int = 0
    own: int = 0
    processes: int = 0
    samples: int = 0

    def with_sample(self, total: int, own: int, processes: int) -> TreePeak:
        """Return the peak after one sample more."""
        return TreePeak(
            max(self.total, total), max(self.own, own), max(self.processes, processes), self.samples + 1
        )


class Watch:
    """The peak of a tree so far.

    Parameters
    ----------
    root : int
        The id of the process at its top.
    """

    def __init__(self, root: int) -> None:
        self._root = root
        self.peak = TreePeak()

    def sample(self) -> None:
        """Look at the tree once."""
        found = [memory for one in tree(self._root) if (memory := _memory(one))]
        total, own = (sum(column) for column in zip(*found, strict=True)) if found else (0, 0)
        self.peak = self.peak.with_sample(total, own, len(found))


@contextmanager
def watched(root: int) -> Iterator[Watch]:
    """Watch a process and all below it by a thread.

    Raises
    ------
    OSError
        This system does not tell a process's share of memory.
    """
    if not Path("/proc/self/smaps_rollup").exists():
        raise OSError("there is no /proc/self/smaps_rollup here; peak memory is measured on Linux, from 4.14")
    watch, ended = Watch(root), threading.Event()

    def look() -> None:
        pause = 0.0
        while not ended.wait(pause):
            start = time.perf_counter()
            watch.sample()
            pause = max(EVERY, (time.perf_counter() - start) / _SHARE)

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        yield watch
    finally:
        ended.set()
        thread.join()


def tree(root: int) -> list[int]:
    """Return the ids of a process and of all below it, as far as they are there."""
    children: dict[int, list[int]] = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit() and (parent := _parent(folder)) is not None:
            children.setdefault(parent, []).append(int(folder.name))
    found, waiting = [], [root]
    while waiting:
        found.append(waiting.pop())
        waiting += children.get(found[-1], [])
    return found


def _parent(process: Path) -> int | None:
    try:
        # The name, in brackets, may hold anything; the state and the parent come after it.
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    except (OSError, IndexError):
        return None


def _memory(process: int) -> tuple[int, int] | None:
    """Return a process's share in bytes, with mapped files and without; None where it has ended."""
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    except OSError:
        return None
    kilobytes = {name: int(rest.split()[0]) for name, _, rest in (one.partition(":") for one in lines[1:])}
    if not kilobytes:
        return None
    swapped = kilobytes.get("SwapPss", 0)
    total = kilobytes["Pss"] + swapped
    return 1024 * total, 1024 * (total - kilobytes.get("Pss_File", 0))
