"""How far a download is: a bar a file on a terminal, plain lines elsewhere; always on stderr."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, DownloadColumn, Progress, TaskID, TextColumn, TransferSpeedColumn

_MEGABYTE = 10**6
_STEP = 50 * _MEGABYTE  # a line each, where the size is not known


class Meter(Protocol):
    """What a download tells how far it is."""

    def begin(self, name: str, total: int | None, done: int) -> None:
        """Begin with a file, or with it anew: its bytes where known, and those that are there."""

    def advance(self, count: int) -> None:
        """Count bytes of it that have come."""


@contextmanager
def download_meter(console: Console) -> Iterator[Meter]:
    """Show the progress of downloads, one after the other."""
    if not console.is_terminal:
        yield _Lines(console)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, console=console) as bars:
        yield _Bars(bars)


class _Bars:
    def __init__(self, bars: Progress) -> None:
        self.bars = bars
        self.rows: dict[str, TaskID] = {}
        self.name = ""

    def begin(self, name: str, total: int | None, done: int) -> None:
        self.name = name
        if name not in self.rows:
            self.rows[name] = self.bars.add_task(name, total=total)
        self.bars.update(self.rows[name], total=total, completed=done)

    def advance(self, count: int) -> None:
        self.bars.advance(self.rows[self.name], count)


class _Lines:
    def __init__(self, console: Console) -> None:
        self.console = console
        self.name, self.total, self.done = "", None, 0

    name: str
    total: int | None
    done: int

    def begin(self, name: str, total: int | None, done: int) -> None:
        self.name, self.total, self.done = name, total, done
        size = "size unknown" if total is None else _shown(total)
        self._say(f"{name}: {size}" + (f", going on after {_shown(done)}" if done else ""))

    def advance(self, count: int) -> None:
        before, self.done = self.done, self.done + count
        step = _STEP if self.total is None else max(self.total // 10, _MEGABYTE)
        if self.done // step > before // step:
            of = "" if self.total is None else f" of {_shown(self.total)}"
            self._say(f"{self.name}: {_shown(self.done)}{of}")

    def _say(self, line: str) -> None:
        self.console.print(line, highlight=False, soft_wrap=True)


def _shown(count: int) -> str:
    return f"{count / _MEGABYTE:,.1f} MB" if count >= _MEGABYTE else f"{count:,} bytes"
