"""Runs a graph on Dask workers: a running cluster's, or processes of this machine."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from motionary.pipeline.compilation import KernelCacheError, compile_kernels
from motionary.pipeline.graph import dask_graph
from motionary.pipeline.task import TableStore, Task, TaskReport
from motionary.workflows.errors import UserError

if TYPE_CHECKING:
    from distributed import Client

_COMPILING = "motionary-compiling"


class SchedulerError(UserError):
    """The Dask scheduler that was named cannot be reached, or its workers cannot compile."""


class Workers:
    """Dask workers, started when there is first something to do.

    Parameters
    ----------
    workers : int
        Processes on this machine; 1 runs in this process. Not used with `address`.
    address : str, optional
        A running Dask scheduler.
    compiling : callable
        Called once if the kernels must be compiled first, somewhere.
    """

    def __init__(self, workers: int, address: str | None, compiling: Callable[[], object]) -> None:
        self._open = ExitStack()
        self._start = partial(_client, workers, address)
        self._compiling = compiling
        self._client: Client | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *raised: object) -> None:
        self._open.close()

    def compute(
        self, tasks: Sequence[Task], store: TableStore, done: Callable[[str], object]
    ) -> list[TaskReport]:
        """Run tasks.

        Parameters
        ----------
        tasks : sequence of Task
            With all that they wait for and that is not stored.
        store : TableStore
            Where results are.
        done : callable
            Called with the stage of every finished task.

        Returns
        -------
        list of TaskReport
            In the order of the tasks.

        Raises
        ------
        SchedulerError
            Nothing answers at the address, or a machine has no folder to keep compiled kernels in.
        """
        if not tasks:
            return []
        from distributed import as_completed

        if self._client is None:
            self._client = self._open.enter_context(self._start())
            compile_on_every_machine(self._client, self._compiling)
        graph = dask_graph(tasks, store)
        futures = self._client.get(graph, list(graph), sync=False)
        for _, report in as_completed(futures, with_results=True):
            done(report.stage)
        return self._client.gather(futures)


def compile_on_every_machine(client: Client, compiling: Callable[[], object]) -> None:
    """Have one worker of every machine compile the kernels, if none has before, while the others wait.

    Parameters
    ----------
    client : Client
        Of the workers; one that joins later on a new machine compiles while it works.
    compiling : callable
        Called once if anything must be compiled.

    Raises
    ------
    SchedulerError
        A machine has no folder to keep compiled kernels in.
    """
    from distributed import as_completed

    announce = cache(compiling)
    client.subscribe_topic(_COMPILING, lambda event: announce())
    one_of_each = {urlsplit(address).hostname: address for address in client.nthreads()}
    futures = [client.submit(_compile_here, workers=[one], pure=False) for one in one_of_each.values()]
    try:
        for future in as_completed(futures):
            future.result()
    except KernelCacheError as error:
        raise SchedulerError(str(error)) from None
    finally:
        client.unsubscribe_topic(_COMPILING)


def _compile_here() -> None:
    from distributed import get_worker

    worker = get_worker()
    compile_kernels(lambda: worker.log_event(_COMPILING, worker.address))


@contextmanager
def _client(workers: int, address: str | None) -> Iterator[Client]:
    from distributed import Client, LocalCluster

    if address is not None:
        try:
            client = Client(address, timeout=10)
        except (OSError, ValueError) as error:
            raise SchedulerError(f"no Dask scheduler answers at {address}: {error}") from None
        with client:
            yield client
        return
    with _interrupts_ignored():
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=workers > 1,
            dashboard_address="127.0.0.1:0",  # a free port, and nothing for the network to see
            silence_logs=logging.CRITICAL,  # what a task raises is raised here as well
        )
    with cluster, Client(cluster) as client:
        yield client


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Let processes that start meanwhile ignore Ctrl-C: this one hears it, and ends them in order."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
