"""The Dask graph: which stage feeds which. Wiring, no mathematics.

    files -> ingest (a batch) -> compare (two batches) -> cluster -> represent -> align (a batch) -> style

A result is named by its key: a digest of its stage's version and settings and of the keys of what it reads,
down to the digests of the files. Equal keys mean equal results, so a task whose result is stored already has
nothing to do. Tasks hand each other keys, never arrays; tables pass through the store that the caller gives.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations_with_replacement
from typing import Any, Protocol

import pyarrow as pa
from dask.task_spec import List, TaskRef
from dask.task_spec import Task as DaskTask

from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.readers.library import Source
from motionary.pipeline.stages import align, cluster, compare, ingest, represent, style


class TableStore(Protocol):
    """Where results are kept; it travels to the workers."""

    def has(self, key: str, tables: Iterable[str]) -> bool:
        """Say whether a result is stored whole."""

    def save(self, key: str, tables: Mapping[str, pa.Table]) -> None:
        """Store a result's tables."""

    def load(self, key: str, table: str) -> pa.Table:
        """Return a stored table."""


@dataclass(frozen=True)
class TaskReport:
    """What a task tells its caller: whose result it made, in what time, or that it was there already."""

    stage: str
    key: str
    seconds: float
    computed: bool


@dataclass(frozen=True)
class Task:
    """A task of the graph; `node` computes to its `TaskReport`.

    `reads` are the keys of the results it waits for, `makes` the tables it stores.
    """

    stage: str
    key: str
    reads: tuple[str, ...]
    makes: tuple[str, ...]
    node: DaskTask


def build_graph(
    sources: Sequence[Source], labels: pa.Table, config: PipelineConfig, store: TableStore
) -> list[Task]:
    """Join the stages over a library.

    Parameters
    ----------
    sources : sequence of Source
        Its clips, in clip_id order.
    labels : pyarrow.Table
        Supplied labels: clip_id and text columns.
    config : PipelineConfig
        Every stage's settings.
    store : TableStore
        Where results go.

    Returns
    -------
    list of Task
        Every task, after those it reads from.
    """
    batches = batched_by_name(sources, config.distances.tile)

    ingested = [_ingest_task(batch, config, store) for batch in batches]
    tiles = [
        _task(
            store, "compare", compare.compare, compare.VERSION, compare.MAKES,
            reads=[("resampled", [first]), ("resampled", [second])],
            settings=_thresholds(config), arguments=(config.distances,),
        )
        for first, second in combinations_with_replacement(ingested, 2)
    ]  # fmt: skip
    clustered = _task(
        store, "cluster", cluster.cluster, cluster.VERSION, cluster.MAKES,
        reads=[("ingested", ingested), ("pairs", tiles)],
        settings=(asdict(config.clusters), labels.to_pylist()), arguments=(labels, config.clusters),
    )  # fmt: skip
    represented = _task(
        store, "represent", represent.represent, represent.VERSION, represent.MAKES,
        reads=[("clips", [clustered]), ("members", [clustered]), ("pairs", tiles), ("features", ingested)],
        settings=(asdict(config.clusters), config.alignment.weights),
        arguments=(config.clusters, config.alignment),
    )  # fmt: skip
    aligned = [
        _task(
            store, "align", align.align, align.VERSION, align.MAKES,
            reads=[("ingested", [batch]), ("frames", [batch]), ("features", [batch]),
                   ("clusters", [represented]), ("reference_features", [represented])],
            settings=asdict(config.alignment),
            arguments=(config.alignment, config.features.frame_rate),
        )
        for batch in ingested
    ]  # fmt: skip
    styled = _task(
        store, "style", style.style, style.VERSION, style.MAKES,
        reads=[("clips", [clustered]), ("clusters", [represented]), ("aligned", aligned)],
        settings=[asdict(one) for one in config.features.conventions],
        arguments=(config.features.conventions, config.features.frame_rate),
    )  # fmt: skip
    return [*ingested, *tiles, clustered, represented, *aligned, styled]


def batched_by_name(sources: Sequence[Source], size: int) -> list[list[Source]]:
    """Cut a library into batches of about `size` clips, twice that at most.

    A batch ends after a clip whose name says so, by its digest. So a clip that comes or goes changes its own
    batch, not all that follow, and the results of the others are found again.
    """
    batches: list[list[Source]] = [[]]
    for source in sources:
        batches[-1].append(source)
        drawn = int.from_bytes(hashlib.blake2b(source.clip_id.encode(), digest_size=8).digest())
        if drawn % size == 0 or len(batches[-1]) == 2 * size:
            batches.append([])
    return [batch for batch in batches if batch]


def _ingest_task(batch: Sequence[Source], config: PipelineConfig, store: TableStore) -> Task:
    files = [(source.clip_id, source.path, source.digest) for source in batch]
    return _task(
        store, "ingest", ingest.ingest, ingest.VERSION, ingest.MAKES,
        reads=[], settings=(asdict(config.read), asdict(config.features), files), arguments=(batch, config),
    )  # fmt: skip


def _thresholds(config: PipelineConfig) -> tuple[Any, ...]:
    drawn = config.distances.thresholds == "random"
    return (config.distances.thresholds, config.distances.seed if drawn else None)


def _task(
    store: TableStore,
    stage: str,
    body: Callable[..., dict[str, pa.Table]],
    version: int,
    makes: tuple[str, ...],
    reads: Sequence[tuple[str, Sequence[Task]]],
    settings: Any,
    arguments: tuple[Any, ...],
) -> Task:
    stored = [(table, [task.key for task in tasks]) for table, tasks in reads]
    about = json.dumps([stage, version, settings, stored], sort_keys=True)
    key = hashlib.blake2b(about.encode(), digest_size=16).hexdigest()
    before = {task.key: TaskRef(task.node.key) for _, tasks in reads for task in tasks}
    node = DaskTask(
        f"{stage}-{key}", run_task, stage, key, makes, store, body, stored, arguments, List(*before.values())
    )
    return Task(stage, key, tuple(before), makes, node)


def run_task(
    stage: str,
    key: str,
    makes: tuple[str, ...],
    store: TableStore,
    body: Callable[..., dict[str, pa.Table]],
    reads: Sequence[tuple[str, Sequence[str]]],
    arguments: tuple[Any, ...],
    before: Sequence[TaskReport],
) -> TaskReport:
    """Run a stage's body on the tables it reads and store what it makes, unless that is stored already.

    `before` is what must have happened first; the tables themselves come from the store.
    """
    start = time.perf_counter()
    computed = not store.has(key, makes)
    if computed:
        tables = [pa.concat_tables(store.load(one, table) for one in keys) for table, keys in reads]
        store.save(key, body(*tables, *arguments))
    return TaskReport(stage, key, time.perf_counter() - start, computed)
