"""The main job: a library of motions in, a published catalog out."""

from __future__ import annotations

import json
import os
import posixpath
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog import Catalog
from motionary.catalog.earlier import earlier_run, inputs_table, known_digests
from motionary.catalog.labels import following
from motionary.catalog.schema import SCHEMAS
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
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import lay_out
from motionary.pipeline.readers.library import KnownDigest, Source, scan_library
from motionary.pipeline.stage_settings import reading_settings
from motionary.pipeline.task import MAKES, TaskReport
from motionary.workflows.computation import Computation, StoredParts
from motionary.workflows.errors import UserError
from motionary.workflows.labels_file import SuppliedLabels, supplied_labels
from motionary.workflows.plan import Plan, plan_run
from motionary.workflows.scheduler import Workers
from motionary.workflows.versions import versions

_SECONDS_TO_START = 4.0
"""Seconds that a worker process takes until it works: it imports what this one has imported."""


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
    label_pattern : str, optional
        Regular expression on clip_ids whose named groups are label columns; a value of the CSV wins.
    workers : int
        Processes on this machine.
    scheduler : str, optional
        A running Dask scheduler instead.
    """

    libraries: Sequence[str]
    catalog: str
    config: PipelineConfig
    labels: Path | None = None
    label_pattern: str | None = None
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
        Results that had to be computed, and those that were there already.
    plan : Plan
        What there was to do.
    """

    catalog: Catalog
    labels_outside: list[str]
    computed: int
    reused: int
    plan: Plan


@dataclass(frozen=True)
class Prepared:
    """A job with its library listed, and with what the catalog's published snapshot offers it."""

    job: Job
    store: Store
    roots: Sequence[str]
    supplied: SuppliedLabels
    before: Snapshot | None
    labels: pa.Table
    graph: LibraryGraph
    stored: StoredParts
    plan: Plan


ShowProgress = Callable[[dict[str, int]], AbstractContextManager[Callable[[str], object]]]


def run(
    job: Job,
    show_progress: ShowProgress,
    compiling: Callable[[], object] = lambda: None,
    take_over: Callable[[Writer], object] = lambda writer: None,
    planned: Callable[[Plan], object] = lambda plan: None,
    check: Callable[[Catalog | None, Catalog], object] = lambda before, after: None,
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
    planned : callable
        Told what there is to do, before it is done.
    check : callable
        Given the published catalog, None where there is none, and the one about to be published. What it
        raises leaves the published one as it is.

    Raises
    ------
    CatalogError
        Another process writes this catalog.
    UserError
        The library is missing or holds no clip or too few, the labels file cannot be used, the catalog's
        folder holds something else, the scheduler cannot be reached, or compiled kernels cannot be kept.
    """
    started = datetime.now(UTC)
    ready = prepare(job)
    _claim(ready.store)
    with the_only_writer(ready.store, take_over):
        if current_snapshot(ready.store) != ready.before:  # somebody published while this run was preparing
            ready = prepare(job)
        planned(ready.plan)
        with (
            show_progress(ready.graph.tasks_by_stage()) as done,
            Workers(_processes(ready), job.scheduler, compiling) as workers,
        ):
            made = _compute(ready, Computation(ready.store, ready.stored, workers, done))
        catalog = _publish(ready, made, started, check)
    computed = sum(report.computed for report in made)
    return RunResult(catalog, ready.supplied.outside, computed, len(made) - computed, ready.plan)


def prepare(job: Job) -> Prepared:
    """List a job's library and see what there is to do, changing nothing.

    Raises
    ------
    CatalogError, UserError
        As `run`.
    """
    store = Store(absolute(job.catalog))
    before = current_snapshot(store)
    roots = [os.path.abspath(library) for library in job.libraries]  # noqa: PTH100 - keeps a link's own name
    sources = library_sources(roots, known_digests(store, before))
    wanted = job.config.clusters.n_clusters
    if wanted is not None and wanted > len(sources):
        raise UserError(f"{wanted} clusters are asked for, and the library holds {len(sources)} clips")
    supplied = supplied_labels(job.labels, job.label_pattern, sources, job.config.clusters.label_column)

    earlier, stored = earlier_run(store, before), StoredParts(store)
    layout = lay_out(sources, reading_settings(job.config), job.config.distances.tile, earlier)
    said = store.read(before.tables["labels"]) if before and "labels" in before.tables else None
    labels = following(said or SCHEMAS["labels"].empty_table(), inputs_table(layout))
    overrides = labels.filter(pc.is_in(labels["clip_id"], pa.array(layout.keys, pa.string())))
    graph = LibraryGraph(layout, supplied.table, overrides, job.config, earlier, stored)
    plan = plan_run(graph, store, before, job.workers)
    return Prepared(job, store, roots, supplied, before, labels, graph, stored, plan)


def library_sources(roots: Sequence[str], known_digest: KnownDigest = lambda states: None) -> list[Source]:
    """List the clips of libraries.

    Raises
    ------
    UserError
        A library is missing or holds no clip.
    """
    try:
        return scan_library(roots, known_digest)
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


def _processes(ready: Prepared) -> int:
    """Return how many processes to start: none beside this one for what is done before they are up."""
    workers = ready.job.workers
    work = None if ready.plan.seconds is None else ready.plan.seconds * workers
    return 1 if work is not None and work < _SECONDS_TO_START * workers else workers


def _compute(ready: Prepared, computation: Computation) -> list[TaskReport]:
    graph, store = ready.graph, ready.store
    represented = ready.before.tables.get("represented") if ready.before else None
    earlier = store.read(represented) if represented else SCHEMAS["represented"].empty_table()
    made = computation.run(graph.comparison())
    representation = graph.representation(store.load(graph.identified.key, "members"), earlier)
    made += computation.run([representation])
    references = store.load(representation.key, "represented")
    return made + computation.run(graph.alignment(representation, references, earlier))


def _publish(
    ready: Prepared,
    made: Sequence[TaskReport],
    started: datetime,
    check: Callable[[Catalog | None, Catalog], object],
) -> Catalog:
    """Write the run's record, publish the snapshot, and leave the overview page beside it."""
    store, before = ready.store, ready.before
    snapshot_id = next_snapshot_id(store)
    tables = {
        table: [store.part_name(table, report.key) for report in made if table in MAKES[report.stage]]
        for makes in MAKES.values()
        for table in makes
    }
    parts = {
        store.part_name(table, report.key): facts for report in made for table, facts in report.stored.items()
    }
    run_id = f"{started:%Y%m%dT%H%M%SZ}-{snapshot_id}"
    runs = store.read(before.tables["runs"]) if before else SCHEMAS["runs"].empty_table()
    record = _record(ready, made, tables, run_id, started)
    own = {
        "inputs": inputs_table(ready.graph.layout),
        "labels": ready.labels,
        "runs": pa.concat_tables([runs, record], promote_options="default"),
    }
    for table, rows in own.items():
        file, parts[file] = store.save_whole(table, rows)
        tables[table] = [file]
    if before:
        parts = {file: before.parts[file] for file in before.parts} | parts
    listed = {file for files in tables.values() for file in files}
    facts = {file: parts.get(file) or store.facts(file) for file in sorted(listed)}
    now = datetime.now(UTC).isoformat(timespec="seconds")
    snapshot = Snapshot(snapshot_id, now, tables, facts, ready.graph.settings, versions())

    catalog = Catalog(store, snapshot)
    check(Catalog(store, before) if before else None, catalog)
    publish(store, snapshot, before)
    store.write(OVERVIEW, overview_page(catalog).encode())
    return Catalog.open(store.url)


def _record(
    ready: Prepared, made: Sequence[TaskReport], tables: dict[str, list[str]], run_id: str, started: datetime
) -> pa.Table:
    store, seconds = ready.store, dict.fromkeys(MAKES, 0.0)
    for report in made:
        seconds[report.stage] += report.seconds
    row = {
        "run_id": run_id,
        "started_at": started,
        "finished_at": datetime.now(UTC),
        "version": versions()["motionary"],
        "library": list(ready.roots),
        "settings": json.dumps(asdict(ready.job.config), sort_keys=True),
        "clips": store.rows(tables["clips"]),
        "quarantined": store.rows(tables["quarantine"]),
        "clusters": store.rows(tables["references"]),
        "clips_read": ready.plan.to_read,
        "pairs_computed": ready.plan.to_compare,
        "stage_seconds": list(seconds.items()),
    }
    return pa.Table.from_pylist([row], schema=SCHEMAS["runs"])
