"""How fast this machine does the job's work: a small run on a sample of the clips, through the real stages.

The results go into a folder of temporary files and are forgotten. What grows with the square of the clips is
timed apart, see `motionary.workflows.costs.made_up`.
"""

from __future__ import annotations

import errno
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from motionary.catalog.store import Store
from motionary.pipeline.compilation import compile_kernels
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import Earlier, Layout
from motionary.pipeline.tables import TABLES
from motionary.pipeline.task import Task, TaskReport, run_task
from motionary.workflows.costs.amounts import clip_sizes
from motionary.workflows.costs.made_up import Squares, time_squares
from motionary.workflows.costs.sample import in_two_sides, sampled
from motionary.workflows.errors import UserError

_SECONDS = 8.0
"""After so many seconds no further batch of the sample is read."""
_REPEATS = 3


@dataclass(frozen=True)
class Share:
    """What a stage took for the sample.

    Parameters
    ----------
    seconds : float
        Of work.
    disk : int
        Bytes of its results.
    """

    seconds: float
    disk: int


@dataclass(frozen=True)
class Tile:
    """What a tile of pairs takes, in seconds.

    Parameters
    ----------
    alone : float
        Whatever its pairs.
    batch : float
        For each batch that it reads.
    pair : float
        For each pair.
    disk, pair_disk : float
        Bytes of its result, whatever its pairs and for each.
    """

    alone: float
    batch: float
    pair: float
    disk: float
    pair_disk: float


@dataclass(frozen=True)
class Calibration:
    """What was measured.

    Parameters
    ----------
    clips, quarantined : int
        Of the sample; those that cannot be read are among the clips.
    bytes : int
        Of its files.
    source_frames, frames, merged_frames, pairs : int
        Of the sample: in the files, at the common rate, with those of low motion merged; pairs compared.
    stages : dict of str to Share
    tile : Tile
        What comparing takes.
    squares : Squares
        What grows with the square of the clips takes.
    clusters : int
    concentration : float
        Sum of the squares of the clusters' shares of the clips.
    starting : float
        Seconds of a run on a few clips, the first of this process: what is loaded once.
    seconds : float
        That all of this took.
    """

    clips: int
    quarantined: int
    bytes: int
    source_frames: int
    frames: int
    merged_frames: int
    pairs: int
    stages: dict[str, Share]
    tile: Tile
    squares: Squares
    clusters: int
    concentration: float
    starting: float
    seconds: float


def calibrate(graph: LibraryGraph, compiling: Callable[[], object] = lambda: None) -> Calibration:
    """Measure how fast this machine does the work of a library.

    Parameters
    ----------
    graph : LibraryGraph
        The library, and the settings.
    compiling : callable
        Called if the kernels must be compiled first.

    Raises
    ------
    UserError
        Of the sample, fewer than two clips can be read; or there is no room for temporary files.
    """
    compile_kernels(compiling)
    start = time.perf_counter()
    try:
        with tempfile.TemporaryDirectory(prefix="motionary-plan-") as folder, threadpool_limits(1):
            run = _SampleRun(graph, Store(folder))
            run.warm_up()
            starting = time.perf_counter() - start
            return _measured(run, run.whole(), start, starting)
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        raise UserError(
            f"there is no room in {tempfile.gettempdir()} to try a sample of the library; make room there, "
            "or set TMPDIR to a folder of a larger disk"
        ) from error


class _SampleRun:
    """A run on a sample of a library's clips, in this process."""

    def __init__(self, library: LibraryGraph, store: Store) -> None:
        self._library, self.store = library, store
        self.sizes = clip_sizes(library.layout)
        self._sample = sampled(library.layout, self.sizes)
        self.graph = self._graph_of(self._sample)

    def warm_up(self) -> None:
        """Run on a few clips first: what is imported and loaded once is no cost of the clips."""
        few = self._graph_of(in_two_sides([batch[:2] for batch in self._sample.batches[:2]]))
        with suppress(UserError):  # others of the sample may do
            self._rest(few, [self._run(task) for task in few.ingested])

    def whole(self) -> list[TaskReport]:
        """Read batches while there is time, then do all else with those."""
        start, read = time.perf_counter(), []
        for task in self._graph_of(self._sample).ingested:
            read.append(self._run(task))
            if time.perf_counter() - start > _SECONDS:
                break
        self.graph = self._graph_of(in_two_sides(self._sample.batches[: len(read)]))
        return self._rest(self.graph, read)

    def joined(self, table: str, tasks: Sequence[Task]) -> pa.Table:
        """Read a table that tasks made."""
        return pa.concat_tables([self.store.load(task.key, table) for task in tasks])

    def again(self, task: Task) -> Share:
        """Return what a task takes when it is repeated, at its fastest."""
        copies = [replace(task, key=f"{task.key}-{number}") for number in range(_REPEATS)]
        reports = [self._run(copy) for copy in copies]
        disk = sum(facts.bytes for facts in reports[0].stored.values())
        return Share(min(one.seconds for one in reports), disk)

    def smallest_tile(self) -> Task:
        """Compare one clip with another."""
        two = self._graph_of(in_two_sides([[clip] for clip in [*self.graph.layout][:2]]))
        for task in [*two.ingested, *two.resampled]:
            self._run(task)
        return two.compared[min(1, len(two.compared) - 1)]

    def _rest(self, graph: LibraryGraph, read: list[TaskReport]) -> list[TaskReport]:
        nobody = TABLES["represented"].empty_table()
        made = read + [self._run(task) for task in graph.comparison() if task.stage != "ingest"]
        members = self.store.load(graph.identified.key, "members")
        if len(members) < 2:
            raise UserError(
                f"of {len([*graph.layout])} clips that were tried, {len(members)} can be read, and a plan "
                "takes two; a run says of each file why not"
            )
        representation = graph.representation(members, nobody)
        made.append(self._run(representation))
        references = self.store.load(representation.key, "represented")
        return made + [self._run(task) for task in graph.alignment(representation, references, nobody)]

    def _run(self, task: Task) -> TaskReport:
        return run_task(task, self.store)

    def _graph_of(self, layout: Layout) -> LibraryGraph:
        # Few clips may be fewer than the clusters that are asked for.
        library, config = self._library, self._library.config
        clusters, distances = replace(config.clusters, n_clusters=None), config.distances
        if distances.pairs == "landmarks":  # all pairs of the sample tell what one takes
            clusters, distances = replace(clusters, landmarks=None), replace(distances, pairs="all")
        config = replace(config, clusters=clusters, distances=distances)
        tables = library.labels, library.overrides
        return LibraryGraph(layout, *tables, config, Earlier(), lambda key, tables: False, library.room)


def _measured(run: _SampleRun, reports: Sequence[TaskReport], start: float, starting: float) -> Calibration:
    graph, store = run.graph, run.store
    ingested, features = run.joined("ingested", graph.ingested), run.joined("features", graph.ingested)
    pairs = run.joined("pairs", graph.compared)
    merged = store.rows([store.part_name("resampled", task.key) for task in graph.resampled])
    compared = len(ingested) * (len(ingested) - 1) // 2  # of which far ones may have been left out
    members = store.load(graph.identified.key, "members")["cluster_id"].to_numpy()
    counts = np.unique(members, return_counts=True)[1]
    return Calibration(
        clips=len([*graph.layout]),
        quarantined=len([*graph.layout]) - len(ingested),
        bytes=sum(run.sizes[clip.clip_id] for clip in graph.layout),
        source_frames=int(ingested["frames"].to_numpy().sum()),
        frames=len(features),
        merged_frames=merged,
        pairs=compared,
        stages={stage: _share(stage, reports) for stage in graph.tasks_by_stage()},
        tile=_tile(run, compared, _share("compare", reports).disk),
        squares=time_squares(store, ingested, pairs, features, graph.config),
        clusters=len(counts),
        concentration=float(((counts / len(members)) ** 2).sum()),
        starting=starting,
        seconds=time.perf_counter() - start,
    )


def _share(stage: str, reports: Sequence[TaskReport]) -> Share:
    own = [report for report in reports if report.stage == stage]
    disk = sum(facts.bytes for report in own for facts in report.stored.values())
    return Share(sum(report.seconds for report in own), disk)


def _tile(run: _SampleRun, pairs: int, disk: int) -> Tile:
    """Divide what comparing took among tiles, batches and pairs."""
    tasks, smallest = run.graph.compared, run.again(run.smallest_tile())
    start = time.perf_counter()
    run.joined("resampled", run.graph.resampled)
    batch = (time.perf_counter() - start) / len(run.graph.resampled)
    alone = max(smallest.seconds - 2 * batch, 0.0)
    read = sum(len(keys) for task in tasks for _, keys in task.reads)
    took = sum(run.again(task).seconds for task in tasks)
    pair = max(took - read * batch - len(tasks) * alone, 0.1 * took) / pairs
    return Tile(alone, batch, pair, smallest.disk, max(disk - len(tasks) * smallest.disk, 0) / pairs)
