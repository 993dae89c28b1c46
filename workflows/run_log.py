"""The log of a nightly run: JSON lines, one object an event, each with `time` (ISO 8601, UTC) and `event`.

| event | further fields |
|---|---|
| started | config, catalog, libraries, version |
| took_over | process (a writer that died) |
| compiling | |
| remark | text: how many workers there are, when that changes; what was set and is not done |
| planned | new, changed, renamed, removed, unchanged, and what there is to do |
| stage | stage, tasks, seconds (since the step of the graph began that the stage belongs to) |
| labels_outside | count, first |
| labels_stale | count, renamed: names in the labels file of files that have other names now |
| quarantined | path, line, reason, mend |
| limit_exceeded | limit, value, found, of |
| published | snapshot, run_id, clips, quarantined, clusters |
| vacuumed | snapshots, files, bytes that are gone, held (snapshots that only a reader keeps) |
| failed | error, traceback (of a fault that is ours) |
| report | file |
| page | ok, and file, bytes or error |
| webhook, command | ok, error where it is not |
| finished | status, exit_code, seconds |
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from typing import Any


class RunLog:
    """Where events go, each whole and at once.

    Parameters
    ----------
    write : callable
        Takes a line with its end. A line that it cannot write goes to stderr: a full disk ends no run here.
    """

    def __init__(self, write: Callable[[str], object]) -> None:
        self.write = write

    def __call__(self, event: str, **fields: Any) -> None:
        """Write an event; the fields are what JSON can hold, or are written as text."""
        line = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **fields}
        text = json.dumps(line, default=str) + "\n"
        try:
            self.write(text)
        except OSError:
            _to_stderr(text)


@contextmanager
def open_log(file: Path | None) -> Iterator[RunLog]:
    """Add to a log file, its folder made where there is none, or write to stderr.

    Raises
    ------
    OSError
        The file cannot be opened.
    """
    if file is None:
        yield RunLog(_to_stderr)
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("ab", buffering=0) as stream:  # a line a write, so that two processes' lines do not mix
        yield RunLog(lambda line: stream.write(line.encode()))


def _to_stderr(line: str) -> None:
    print(line, end="", file=sys.stderr, flush=True)


@contextmanager
def logged_stages(log: RunLog, totals: Mapping[str, int]) -> Iterator[Callable[[str], None]]:
    """Log every stage that is finished; a way of showing progress, see `motionary.workflows.main_job.run`.

    Parameters
    ----------
    log : RunLog
        Where to.
    totals : mapping of str to int
        Tasks a stage.

    Yields
    ------
    callable
        To be called with the stage of every finished task.
    """
    begun, done = monotonic(), Counter[str]()

    def advance(stage: str) -> None:
        done[stage] += 1
        if done[stage] == totals[stage]:
            log("stage", stage=stage, tasks=done[stage], seconds=round(monotonic() - begun, 3))

    yield advance
