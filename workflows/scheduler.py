"""Runs a graph on Dask workers: a running cluster's, or processes of this machine.

What travels is small. The scheduler is sent tasks, which name results and hold settings, and hears reports of
a few hundred bytes; tables pass from worker to worker through the catalog. So a worker that dies takes
nothing with it: what it had stored is found by whoever repeats its tasks, and what was in its hands is done
again. When the scheduler dies, the run ends, and the next one goes on from the catalog.
"""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from motionary.pipeline.compilation import KernelCacheError, compile_kernels
from motionary.pipeline.dask_graph import dask_graph
from motionary.pipeline.task import TableStore, Task, TaskReport, run_task
from motionary.workflows.crew import Crew, Remark, SchedulerError, explained
from motionary.workflows.dashboard import dashboard_hint
from motionary.workflows.workplace import Workplace, look_around, run_where_fit, worker_name

if TYPE_CHECKING:
    from distributed import Client

_COMPILING = "motionary-compiling"


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
    workplace : Workplace, optional
        What the workers of a running scheduler must find.
    remark : callable
        Told how many workers there are, when that changes, and where to watch them.
    """

    def __init__(
        self,
        workers: int,
        address: str | None,
        compiling: Callable[[], object],
        workplace: Workplace | None = None,
        remark: Remark = lambda text: None,
    ) -> None:
        self._open = ExitStack()
        self._count, self._address, self._compiling, self._remark = workers, address, compiling, remark
        self._workplace = workplace if address is not None else None
        self._run: Callable[[Task, TableStore, Sequence[TaskReport]], TaskReport] = run_task
        if self._workplace is not None:
            self._run = partial(run_where_fit, self._workplace)
        self._suffix = f"-{uuid4().hex}"
        self._crew: Crew | None = None

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
            Nothing answers at the address, or no longer; there are no workers; a machine has no folder to
            keep compiled kernels in; or one task was the end of several workers.
        UnfitWorkerError
            A worker does not find what it needs.
        """
        if not tasks:
            return []
        with explained(tasks, self._address):
            if self._crew is None:
                self._crew = self._gather_crew()
            graph = dask_graph(tasks, store, self._run, self._suffix)
            reports = {}
            for report in self._crew.results(self._crew.client.get(graph, list(graph), sync=False)):
                reports[report.key] = report
                done(report.stage)
        return [reports[task.key] for task in tasks]

    def _gather_crew(self) -> Crew:
        crew = Crew(self._open.enter_context(_client(self._count, self._address)), self._remark)
        crew.wait()
        if self._workplace is not None:
            _refuse_other_versions(crew.client)
            self._workplace.open()
            self._open.callback(self._workplace.close)
        if self._address is not None or self._count > 1:
            self._remark(f"{crew}; {dashboard_hint(crew.client)}")
        compile_on_every_machine(crew.client, self._compiling, self._workplace)
        return crew


def compile_on_every_machine(
    client: Client, compiling: Callable[[], object], workplace: Workplace | None = None
) -> None:
    """Have one worker of every machine look around and compile the kernels, if none has before.

    Parameters
    ----------
    client : Client
        Of the workers; one that joins later on a new machine does so before its first task.
    compiling : callable
        Called once if anything must be compiled.
    workplace : Workplace, optional
        What they must find.

    Raises
    ------
    SchedulerError
        A machine has no folder to keep compiled kernels in.
    UnfitWorkerError
        A machine lacks what the run needs.
    """
    from distributed import as_completed
    from distributed.comm import get_address_host

    announce = cache(compiling)
    client.subscribe_topic(_COMPILING, lambda event: announce())
    hosts = {get_address_host(address) for address in client.nthreads()}
    futures = [
        # Another does it where the machine has gone meanwhile.
        client.submit(_begin_here, workplace, workers=[host], allow_other_workers=True, pure=False)
        for host in hosts
    ]
    try:
        for future in as_completed(futures):
            future.result()
    except KernelCacheError as error:
        raise SchedulerError(str(error)) from None
    finally:
        client.unsubscribe_topic(_COMPILING)


def _begin_here(workplace: Workplace | None) -> None:
    from distributed import get_worker

    worker = get_worker()
    compile_kernels(lambda: worker.log_event(_COMPILING, worker.address))
    if workplace is not None:
        look_around(workplace, worker_name())


def _refuse_other_versions(client: Client) -> None:
    """Refuse a scheduler, and workers, that could not even be told what to do."""
    found: Any = client.get_versions(packages=["motionary"])
    mine = found["client"]["packages"]["motionary"]
    others = {f"the scheduler {client.scheduler_info(n_workers=0)['address']}": found["scheduler"]}
    others |= {f"worker {address}": one for address, one in found["workers"].items()}
    for name, one in others.items():
        version = one["packages"]["motionary"]
        if version != mine:
            has = "no motionary" if version is None else f"motionary {version}"
            raise SchedulerError(
                f"{name} has {has}, and this is motionary {mine}: install that on all machines of the "
                "cluster, restart it, and run again"
            )


@contextmanager
def _client(workers: int, address: str | None) -> Iterator[Client]:
    from distributed import Client, LocalCluster
    from distributed.utils import silence_logging_cmgr

    if address is not None:
        try:
            client = Client(address, timeout=10)
        except (OSError, ValueError) as error:
            raise SchedulerError(
                f"no Dask scheduler answers at {address!r}: {error}; start one by dask scheduler, and give "
                "the address that it prints, as tcp://HOST:8786"
            ) from None
        with silence_logging_cmgr(logging.CRITICAL), client:
            yield client
        return
    with _interrupts_ignored():
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=workers > 1,
            dashboard_address="127.0.0.1:0",  # a free port, and nothing for the network to see
            scheduler_kwargs={"dashboard": workers > 1},  # one process has little to show
            # Dask would count mapped files as memory, and end workers that hold no more than was planned.
            memory_limit=0,
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
