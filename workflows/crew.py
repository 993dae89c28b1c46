"""The workers of a run: what comes back from them, how many they are, and what it means if they are gone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from motionary.pipeline.task import Task
from motionary.workflows.errors import UserError

if TYPE_CHECKING:
    from distributed import Client, Future, KilledWorker

_TICK = 1.0  # seconds between two looks at who works
_PATIENCE = 1800.0
"""Seconds without any worker after which a run gives up: a queue may need some time to send others."""

Remark = Callable[[str], object]


class SchedulerError(UserError):
    """The Dask scheduler or its workers cannot do the work; the message says why, and what to do."""


class Crew:
    """The workers of a client, and how many they are.

    Parameters
    ----------
    client : Client
    remark : callable
        Told how many there are, when that changes.
    """

    def __init__(self, client: Client, remark: Remark) -> None:
        self.client = client
        self._remark = remark
        self._size: int | None = None
        self._looked = self._alone_since = 0.0

    def __str__(self) -> str:
        return "1 worker" if self._size == 1 else f"{self._size} workers"

    def wait(self) -> None:
        """Wait until there is a worker."""
        self._look()
        while not self._size:
            time.sleep(_TICK)
            self._look()

    def results(self, futures: Sequence[Future]) -> Iterator[Any]:
        """Yield what tasks return as they end, holding none of it; meanwhile tell how many work on them."""
        from distributed import CancelledError, as_completed

        pending = as_completed(futures, with_results=True)
        del futures  # with its last reference the scheduler forgets a task
        while not pending.is_empty():
            if time.monotonic() - self._looked >= _TICK:
                self._look()
            with pending.thread_condition:
                if not pending.has_ready():
                    pending.thread_condition.wait(_TICK)
            if not pending.has_ready():
                continue
            _, result = next(pending)
            if isinstance(result, CancelledError):
                raise result
            yield result

    def _look(self) -> None:
        scheduler = self.client.scheduler_info(n_workers=0)
        before, self._size = self._size, scheduler["n_workers"]
        self._looked = now = time.monotonic()
        if self._size == 0 and before != 0:
            self._alone_since = now
            self._remark(
                f"no workers at {scheduler['address']}; waiting for some, "
                f"{_PATIENCE / 60:.0f} minutes at most"
            )
        elif self._size == 0 and now - self._alone_since > _PATIENCE:
            raise SchedulerError(
                f"{scheduler['address']} has had no workers for {_PATIENCE / 60:.0f} minutes; start "
                "some, and run again: what is done is stored"
            )
        elif before is not None and self._size != before:
            self._remark(f"{self} now, {before} before")


@contextmanager
def explained(tasks: Sequence[Task], address: str | None) -> Iterator[None]:
    """Say what has happened where Dask says how it noticed.

    Parameters
    ----------
    tasks : sequence of Task
        Those that run.
    address : str, optional
        The scheduler's.

    Raises
    ------
    SchedulerError
        The scheduler is gone, or one task was the end of several workers.
    """
    from distributed import CancelledError, KilledWorker
    from distributed.client import ClosedClientError
    from distributed.comm import CommClosedError

    try:
        yield
    except KilledWorker as error:
        raise SchedulerError(_of_killed(error, tasks)) from None
    except (CancelledError, ClosedClientError, CommClosedError):
        raise SchedulerError(
            f"the scheduler at {address} is gone, or has dropped this run's tasks; what is done is stored, "
            "and with a scheduler the same command goes on from there"
        ) from None


def _of_killed(error: KilledWorker, tasks: Sequence[Task]) -> str:
    stage, key, *_ = str(error.task).split("-")
    by_key = {task.key: task for task in tasks}
    clips = _clips(by_key[key], by_key) if key in by_key else []
    which = f" (clips {clips[0]} to {clips[-1]}, {len(clips)} of them)" if clips else ""
    times = error.allowed_failures + 1
    return (
        f"one task of stage {stage}{which} was the end of {times} worker{'s' * (times > 1)}: most often "
        "the system ends them for want of memory; give each worker more, or say with --memory what it has, "
        "and start workers with --memory-limit 0, for Dask's own limit counts mapped files. What is done is "
        "stored, and the same command goes on from there"
    )


def _clips(task: Task, by_key: Mapping[str, Task]) -> list[str]:
    """Name the clips that a task is about, as far as this run reads them."""
    waiting, seen, clips = [task], {task.key}, []
    while waiting:
        one = waiting.pop()
        if one.stage == "ingest":
            clips += [source.clip_id for _, source in one.arguments[0]]
        new = {key for key in one.after if key in by_key} - seen
        seen |= new
        waiting += [by_key[key] for key in new]
    return sorted(clips)
