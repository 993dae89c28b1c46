"""The main job: a library of motions in, a published catalog out."""

from __future__ import annotations

import json
import os
import posixpath
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import (
    CURRENT,
    OVERVIEW,
    Snapshot,
    current_snapshot,
    next_snapshot_id,
    publish,
)
from motionary.catalog.store import Store
from motionary.catalog.views.overview import overview_page
from motionary.catalog.writer_lock import Writer, the_only_writer
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.graph import Task, TaskReport, build_graph
from motionary.pipeline.readers.library import Source, scan_library
from motionary.workflows.errors import UserError
from motionary.workflows.labels_file import NO_LABELS, read_labels
from motionary.workflows.scheduler import compute


@dataclass(frozen=True)
class Job:
    """What a run is asked to do.

    Parameters
    ----------
    libraries : sequence of str
        Folders of motion capture.
    catalog : str
        Folder or fsspec URL of the catalog; made where there is none.
    config : PipelineConfig
        Every stage's settings.
    labels : Path, optional
        CSV of supplied labels.
    workers : int
        Processes on this machine.
    scheduler : str, optional
        A running Dask scheduler instead.
    """

    libraries: Sequence[str]
    catalog: str
    config: PipelineConfig
    labels: Path | None = None
    workers: int = 1
    scheduler: str | None = None


@dataclass(frozen=True)
class RunResult:
    """What a run did.

    Parameters
    ----------
    catalog : Catalog
        Opened at the snapshot that the run published.
    labels_outside : list of str
        What the labels file names that is not in the library.
    computed, reused : int
        Tasks that had something to do, and those whose result was there already.
    """

    catalog: Catalog
    labels_outside: list[str]
    computed: int
    reused: int


ShowProgress = Callable[[Counter], AbstractContextManager[Callable[[str], None]]]


def run(
    job: Job,
    show_progress: ShowProgress,
    compiling: Callable[[], object] = lambda: None,
    take_over: Callable[[Writer], object] = lambda writer: None,
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
        Called if the kernels must be compiled first; that takes some thirty seconds, once on a machine.
    take_over : callable
        Told of a writer of this catalog that died.

    Raises
    ------
    CatalogError
        Another process writes this catalog.
    UserError
        The library is missing or holds no clip or too few, the labels file cannot be used, the catalog's
        folder holds something else, the scheduler cannot be reached, or compiled kernels cannot be kept.
    """
    started = datetime.now(UTC)
    roots = [os.path.abspath(library) for library in job.libraries]  # noqa: PTH100 - keeps a link's own name
    sources = library_sources(roots)
    wanted = job.config.clusters.n_clusters
    if wanted is not None and wanted > len(sources):
        raise UserError(f"{wanted} clusters are asked for, and the library holds {len(sources)} clips")
    column = job.config.clusters.label_column
    labels = read_labels(job.labels, sources, column) if job.labels else NO_LABELS

    store = Store(absolute(job.catalog))
    _claim(store)
    with the_only_writer(store, take_over):
        tasks = build_graph(sources, labels.table, job.config, store)
        with show_progress(Counter(task.stage for task in tasks)) as done:
            reports = compute(
                tasks, job.workers, job.scheduler, done, None if _all_stored(store, tasks) else compiling
            )
        catalog = _publish(store, tasks, reports, job, roots, started)
    computed = sum(report.computed for report in reports)
    return RunResult(catalog, labels.outside, computed, len(reports) - computed)


def library_sources(roots: Sequence[str]) -> list[Source]:
    """List the clips of libraries.

    Raises
    ------
    UserError
        A library is missing or holds no clip.
    """
    try:
        return scan_library(roots)
    except (OSError, ValueError) as error:
        raise UserError(str(error)) from error


def absolute(url: str) -> str:
    """Return a catalog's URL such that workers find it from any folder."""
    return url if "://" in url else os.path.abspath(url)  # noqa: PTH100 - Path.resolve would follow links


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


def _all_stored(store: Store, tasks: Sequence[Task]) -> bool:
    """Say whether no task has anything to compute, from one listing a table."""
    stored = {
        table: {posixpath.basename(path) for path in store.names(f"tables/{table}")}
        for table in {table for task in tasks for table in task.makes}
    }
    return all(
        posixpath.basename(store.part_name(table, task.key)) in stored[table]
        for task in tasks
        for table in task.makes
    )


def _publish(
    store: Store,
    tasks: Sequence[Task],
    reports: Sequence[TaskReport],
    job: Job,
    roots: Sequence[str],
    started: datetime,
) -> Catalog:
    """Write the run's record, publish the snapshot, and leave the overview page beside it."""
    before = current_snapshot(store)
    snapshot_id = next_snapshot_id(store)
    run_id = f"{started:%Y%m%dT%H%M%SZ}-{snapshot_id}"
    files = {
        table: [store.part_name(table, task.key) for task in tasks if table in task.makes]
        for table in PUBLISHED
    }
    record = {
        "run_id": run_id,
        "started_at": started,
        "finished_at": datetime.now(UTC),
        "version": version("motionary"),
        "library": list(roots),
        "settings": json.dumps(asdict(job.config), sort_keys=True),
        "clips": store.rows(files["clips"]),
        "quarantined": store.rows(files["quarantine"]),
        "clusters": store.rows(files["references"]),
        "stage_seconds": list(_stage_seconds(reports).items()),
    }
    store.save(run_id, {"runs": pa.Table.from_pylist([record], schema=SCHEMAS["runs"])})
    files["runs"] = [*(before.tables["runs"] if before else ()), store.part_name("runs", run_id)]
    publish(store, Snapshot(snapshot_id, datetime.now(UTC).isoformat(timespec="seconds"), files))

    catalog = Catalog.open(store.url)
    store.write(OVERVIEW, overview_page(catalog).encode())
    return catalog


def _stage_seconds(reports: Sequence[TaskReport]) -> dict[str, float]:
    seconds: dict[str, float] = {}
    for report in reports:
        seconds[report.stage] = seconds.get(report.stage, 0.0) + report.seconds
    return seconds
