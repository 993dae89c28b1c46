"""Runs a graph on Dask workers: a running cluster's, or processes of this machine."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from urllib.parse import urlsplit

from distributed import Client, LocalCluster, as_completed, get_worker

from motionary.pipeline.compilation import KernelCacheError, compile_kernels
from motionary.pipeline.graph import Task, TaskReport
from motionary.workflows.errors import UserError

_COMPILING = "motionary-compiling"


class SchedulerError(UserError):
    """The Dask scheduler that was named cannot be reached, or its workers cannot compile."""


def compute(
    tasks: Sequence[Task],
    workers: int,
    address: str | None,
    done: Callable[[str], None],
    compiling: Callable[[], object] | None,
) -> list[TaskReport]:
    """Run every task.

    Parameters
    ----------
    tasks : sequence of Task
        Of a graph.
    workers : int
        Processes on this machine; 1 runs in this process. Not used with `address`.
    address : str, optional
        A running Dask scheduler.
    done : callable
        Called with the stage of every finished task.
    compiling : callable, optional
        Called once if the kernels must be compiled first, somewhere. None where no task will need them.

    Returns
    -------
    list of TaskReport
        In the order of the tasks.

    Raises
    ------
    SchedulerError
        Nothing answers at `address`, or a machine has no folder to keep compiled kernels in.
    """
    with _client(workers, address) as client:
        if compiling is not None:
            compile_on_every_machine(client, compiling)
        graph = {task.node.key: task.node for task in tasks}
        futures = client.get(graph, list(graph), sync=False)
        for _, report in as_completed(futures, with_results=True):
            done(report.stage)
        return client.gather(futures)


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
    worker = get_worker()
    compile_kernels(lambda: worker.log_event(_COMPILING, worker.address))


@contextmanager
def _client(workers: int, address: str | None) -> Iterator[Client]:
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
