"""How far a run is: a bar a stage on a terminal, plain lines elsewhere; always on stderr."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import timedelta

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

Advance = Callable[[str], None]

_REMEMBERED = 600.0
"""Seconds over which a stage's speed is taken: a task may last for minutes, and several end together."""


@contextmanager
def progress(totals: Mapping[str, int], console: Console) -> Iterator[Advance]:
    """Show the stages' progress.

    Parameters
    ----------
    totals : mapping of str to int
        Tasks a stage.
    console : rich.console.Console
        Where to.

    Yields
    ------
    callable
        To be called with the stage of every finished task.
    """
    yield from (_bars if console.is_terminal else _lines)(totals, console)


def _bars(totals: Mapping[str, int], console: Console) -> Iterator[Advance]:
    columns = (
        TextColumn("{task.description:<10}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        _TimeLeft(),
    )  # fmt: skip
    with Progress(*columns, console=console, speed_estimate_period=_REMEMBERED) as bars:
        rows = {stage: bars.add_task(stage, total=total, start=False) for stage, total in totals.items()}

        def advance(stage: str) -> None:
            bars.start_task(rows[stage])
            bars.advance(rows[stage])

        yield advance


class _TimeLeft(ProgressColumn):
    """How long a stage will still take, at the speed that it has; nothing where that is not known."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        seconds = task.time_remaining
        return Text("" if task.finished or seconds is None else f"{timedelta(seconds=round(seconds))} left")


def _lines(totals: Mapping[str, int], console: Console) -> Iterator[Advance]:
    done: Counter[str] = Counter()

    def advance(stage: str) -> None:
        done[stage] += 1
        total = totals[stage]
        # Every tenth of a stage: a log must not grow with the library.
        if done[stage] * 10 // total > (done[stage] - 1) * 10 // total:
            console.print(f"{stage}: {done[stage]} of {total}", highlight=False)

    yield advance
