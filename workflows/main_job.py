"""The main job: a library of motions in, a published catalog out."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import UTC, datetime

from motionary.catalog import Catalog
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.snapshot import CURRENT, current_snapshot
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import Writer, the_only_writer
from motionary.pipeline.stages.cluster import TooFewClipsError
from motionary.pipeline.task import TaskReport
from motionary.workflows.computation import Computation, StoredParts
from motionary.workflows.costs.disk import refuse_small_disks
from motionary.workflows.costs.memory import refuse
from motionary.workflows.costs.model import SECONDS_TO_START, with_seconds
from motionary.workflows.crew import Remark
from motionary.workflows.errors import UserError
from motionary.workflows.plan import Plan
from motionary.workflows.preparation import Job, Prepared, prepare
from motionary.workflows.publication import Check, publish_run
from motionary.workflows.scheduler import Workers
from motionary.workflows.workplace import Workplace


@dataclass(frozen=True)
class RunResult:
    """What a run did.

    Parameters
    ----------
    catalog : Catalog
        Opened at the snapshot that the run published.
    labels_outside : list of str
        What the labels file names that is not in the library.
    stale_labels : mapping of str to str
        Those of them that were renamed since the published run, and what they are called now.
    computed, reused : int
        Results that had to be computed, and those that were there already.
    plan : Plan
        What there was to do.
    """

    catalog: Catalog
    labels_outside: list[str]
    stale_labels: Mapping[str, str]
    computed: int
    reused: int
    plan: Plan


ShowProgress = Callable[[dict[str, int]], AbstractContextManager[Callable[[str], object]]]


def run(
    job: Job,
    show_progress: ShowProgress,
    compiling: Callable[[], object] = lambda: None,
    take_over: Callable[[Writer], object] = lambda writer: None,
    planned: Callable[[Plan], object] = lambda plan: None,
    check: Check = lambda before, after: None,
    remark: Remark = lambda text: None,
) -> RunResult:
    """Ingest, compare, cluster, name and align a library, then publish the result in one step.

    Parameters
    ----------
    job : Job
        What to do.
    show_progress : callable
        Given the number of tasks by stage, a context whose value is called with the stage of every finished
        task; see `motionary.workflows.progress`.
    compiling : callable
        Called if the kernels must be compiled first; that takes about a minute, once on a machine.
    take_over : callable
        Told of a writer of this catalog that died.
    planned : callable
        Told what there is to do, before it is done.
    check : callable
        Given the published catalog, None where there is none, and the one about to be published. What it
        raises leaves the published one as it is.
    remark : callable
        Told how many workers there are, when that changes, and where to watch them.

    Raises
    ------
    CatalogError
        Another process writes this catalog.
    UserError
        The library is missing or holds no clip or too few that can be read, the labels file cannot be used,
        the catalog's folder holds something else, the run needs more memory or disk than there is, the
        scheduler cannot be reached or its workers lack something, or compiled kernels cannot be kept.
    """
    started = datetime.now(UTC)
    ready = prepare(job)
    _refuse_too_much(ready)
    _claim(ready.store)
    with the_only_writer(ready.store, take_over):
        if current_snapshot(ready.store) != ready.before:  # somebody published while this run was preparing
            ready = prepare(job)
        if ready.job.config.distances.pairs != job.config.distances.pairs:
            remark(f"compares all pairs: of {len(ready.graph.layout.keys)} clips, landmarks would be all")
        ready = with_seconds(ready, compiling, remark)
        planned(ready.plan)
        with (
            show_progress(ready.graph.tasks_by_stage()) as done,
            Workers(_processes(ready), job.scheduler, compiling, _workplace(ready), remark) as workers,
        ):
            # Listed anew under the lock: a vacuum may have come between.
            stored = StoredParts(ready.store, ready.before)
            try:
                made = _compute(ready, Computation(ready.store, stored, workers, done))
            except TooFewClipsError as error:
                raise UserError(str(error)) from None
        catalog = publish_run(ready, made, started, check)
    computed = sum(report.computed for report in made)
    return RunResult(
        catalog, ready.supplied.outside, ready.stale_labels, computed, len(made) - computed, ready.plan
    )


def _refuse_too_much(ready: Prepared) -> None:
    """Refuse what does not fit before anything is written; workers elsewhere have disks of their own."""
    refuse(ready.need)
    if ready.job.scheduler is None:
        refuse_small_disks(ready.store, ready.amounts, ready.plan, ready.need)


def _claim(store: Store) -> None:
    """Make the catalog's folder; one that holds something else is not taken over.

    Raises
    ------
    UserError
        It is a folder of other files.
    OSError
        It cannot be written.
    """
    names = {posixpath.basename(path.rstrip("/")) for path in store.names("")}
    if names and not names & {CURRENT, "tables"}:
        some = ", ".join(sorted(names)[:3])
        raise UserError(f"{store.url} is no catalog and holds other files ({some}); name a new folder")
    store.filesystem.makedirs(store.path("tables"), exist_ok=True)


def _processes(ready: Prepared) -> int:
    """Return how many processes to start: none beside this one for what it does sooner alone."""
    workers, seconds = ready.job.workers, ready.plan.seconds
    return 1 if seconds is not None and seconds * workers < SECONDS_TO_START + seconds else workers


def _workplace(ready: Prepared) -> Workplace | None:
    """Say what workers elsewhere must find."""
    sources = (clip.source for batch in ready.graph.layout.batches for clip in batch)
    return Workplace.of(ready.store, sources) if ready.job.scheduler else None


def _compute(ready: Prepared, computation: Computation) -> list[TaskReport]:
    graph, store = ready.graph, ready.store
    represented = ready.before.tables.get("represented") if ready.before else None
    earlier = store.read(represented) if represented else SCHEMAS["represented"].empty_table()
    made = [report for tasks in graph.waves(store.load) for report in computation.run(tasks)]
    representation = graph.representation(store.load(graph.identified.key, "members"), earlier)
    made += computation.run([representation])
    references = store.load(representation.key, "represented")
    return made + computation.run(graph.alignment(representation, references, earlier))
