"""From what a sample took to what the library will take.

Reading grows with the bytes of the files, merging and aligning with the clips, comparing with the pairs and
the square of the clips' length, clustering with the square of the clips, the similarity index with that of
the clips of each cluster; clusters are taken for as unequal as those of the sample. What is stored already is
left out, as far as it can be told before the clusters are known.

By the clock, what divides is divided, a task being the least that a worker takes. What does not divide:
starting, the stages that are one task, publishing, and what handing out and taking back a task takes the
process that does so.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from motionary.pipeline.clustering.landmark_steps import REPRESENTATIVES
from motionary.pipeline.task import MAKES, Task
from motionary.workflows.costs.amounts import clip_sizes
from motionary.workflows.costs.calibration import Calibration, calibrate
from motionary.workflows.costs.disk import free_bytes
from motionary.workflows.costs.foretold import Elapsed, Foretold, StageCost
from motionary.workflows.costs.memory import ONE_TASK, refuse
from motionary.workflows.costs.sample import sample_size
from motionary.workflows.errors import UserError
from motionary.workflows.preparation import Job, Prepared, prepare

WORKERS = (1, 2, 8, 64)
"""With how many workers the time is told, beside the job's own."""

_WORTH_IT = 5_000
"""Clips from which on a run foretells its time: less than a few of a hundred parts of it go into that."""

# Of two processes on two cores that were idle otherwise; the calibration's own start is added.
SECONDS_TO_START = 4.0  # until workers of this machine are up: they import what this process has imported
_HANDED = 2e-3  # a task, in the process that hands it out: 2,000 empty tasks
_PUBLISHED, _PUBLISHED_CLIP = 2.0, 3e-4  # seconds: the overview page of 80 and of 10,000 clips
_TOGETHER = 1.1  # times slower is a core whose neighbour works too: `make bench`, two threads


def foretell(
    job: Job,
    compiling: Callable[[], object] = lambda: None,
    say: Callable[[str], object] = lambda text: None,
) -> Foretold:
    """Say what a run will take: list the library, read a sample of it, and work out the rest.

    Nothing is written but temporary files, which are gone when this returns.

    Parameters
    ----------
    job : Job
    compiling : callable
        Called if the kernels must be compiled first.
    say : callable
        Told what is being tried.

    Raises
    ------
    CatalogError, UserError
        As `motionary.workflows.preparation.prepare`; the run would be refused for want of memory; or of the
        sample not two clips can be read.
    """
    start = time.perf_counter()
    ready = prepare(job)
    refuse(ready.need)
    listing = time.perf_counter() - start
    say(_trying(ready))
    return foretold_by(ready, calibrate(ready.graph, compiling), listing)


def with_seconds(ready: Prepared, compiling: Callable[[], object], say: Callable[[str], object]) -> Prepared:
    """Add to the plan of a large library's first run how long it will take; others are left as they are.

    Parameters
    ----------
    ready : Prepared
        The job.
    compiling, say : callable
        As of `foretell`.
    """
    if ready.plan.seconds is not None or ready.plan.to_read < _WORTH_IT:
        return ready
    say(_trying(ready))
    try:
        told = foretold_by(ready, calibrate(ready.graph, compiling))
    except UserError:  # nothing of the sample can be read: what the run says of each file
        return ready
    return replace(ready, plan=replace(ready.plan, seconds=told.seconds))


def _trying(ready: Prepared) -> str:
    clips = len(ready.graph.layout.digests)
    return f"trying {sample_size(clips)} of {clips:,} clips to tell how long it will take"


def foretold_by(ready: Prepared, measured: Calibration, listing: float = 0.0) -> Foretold:
    """Work out what a run will take.

    Parameters
    ----------
    ready : Prepared
        The job.
    measured : Calibration
        Of its library.
    listing : float
        Seconds that preparing it took.
    """
    library = _Library.of(ready, measured)
    stages = tuple(_stages(ready, measured, library))
    workers = sorted({ready.job.workers, *WORKERS})
    undivided = listing + measured.starting + _PUBLISHED + _PUBLISHED_CLIP * library.clips
    return Foretold(
        plan=ready.plan,
        memory=ready.need,
        clips=library.clips,
        source_frames=round(measured.source_frames * library.by_bytes),
        frames=round(measured.frames * library.by_bytes),
        merged_frames=round(measured.merged_frames * library.by_bytes),
        pairs=round(library.pairs),
        stages=stages,
        workers=ready.job.workers,
        elapsed=tuple(_elapsed(stages, count, undivided) for count in workers),
        sampled=measured.clips,
        calibration=measured.seconds,
        room_on_disk=free_bytes(ready.store),
    )


@dataclass(frozen=True)
class _Library:
    """How much there is of what the sample shows.

    Parameters
    ----------
    clips : int
        Those that cannot be read among them.
    readable, pairs : float
        Clips that can be read, as far as the sample tells, and pairs of them.
    clustered : float
        Those of them all pairs of which are kept: the landmarks, or all.
    by_bytes, by_clips : float
        Times the sample, counted by bytes of files and by clips.
    """

    clips: int
    readable: float
    pairs: float
    clustered: float
    by_bytes: float
    by_clips: float

    @staticmethod
    def of(ready: Prepared, measured: Calibration) -> _Library:
        sizes = clip_sizes(ready.graph.layout)
        readable = len(sizes) * (1 - measured.quarantined / measured.clips)
        by_clips = len(sizes) / measured.clips
        by_bytes = sum(sizes.values()) / measured.bytes if measured.bytes else by_clips
        landmarks = ready.job.config.clusters.landmarks
        clustered = readable if landmarks is None else min(readable, landmarks)
        pairs = readable * (readable - 1) / 2
        return _Library(len(sizes), readable, pairs, clustered, by_bytes, by_clips)

    @property
    def length(self) -> float:
        """A clip's mean length, divided by the sample's."""
        return self.by_bytes / self.by_clips


def _stages(ready: Prepared, measured: Calibration, library: _Library) -> Iterable[StageCost]:
    graph, plan, shares = ready.graph, ready.plan, measured.stages
    to_read = min(1.0, plan.to_read / library.clips)
    every = library.clips * (library.clips - 1) / 2
    a_pair = library.pairs / every if every else 0.0
    passing = plan.to_compare - plan.to_store
    clustered = not graph.is_stored(graph.clustered.key, MAKES["cluster"])
    touched = affected(ready) if clustered else 0.0
    missing = [task for task in graph.compared if not graph.is_stored(task.key, task.makes)]
    seconds = {
        "ingest": shares["ingest"].seconds * library.by_bytes * to_read,
        "resample": shares["resample"].seconds * library.by_bytes * to_read,
        "compare": _compare_seconds(missing, plan.to_store * a_pair, measured, library),
        "assign": _pairs_seconds(_assigned_pairs(measured, library) if passing else 0.0, measured, library),
        "refine": _pairs_seconds(passing * a_pair, measured, library),
        "cluster": _cluster_seconds(measured, library) * clustered,
        "identify": shares["identify"].seconds * clustered,
        "represent": _represent_seconds(ready, measured, library, touched) * clustered,
        "align": shares["align"].seconds * library.by_clips * touched,
        "style": shares["style"].seconds * library.by_clips * touched,
        "name": shares["name"].seconds * clustered,
    }
    kept = library.clustered * (library.clustered - 1) / 2
    to_compare = min(1.0, plan.to_store * a_pair / kept) if kept else 0.0
    part = {"ingest": to_read, "resample": to_read, "compare": to_compare, "align": touched, "style": touched}
    tasks = graph.tasks_by_stage() | {"compare": len(missing)}
    for stage in tasks:
        scale = library.by_clips if stage != "compare" else 0.0
        disk = shares[stage].disk * scale if stage in shares else 0.0
        if stage in ("ingest", "resample"):
            disk *= library.length
        if stage == "compare":
            disk = len(graph.compared) * measured.tile.disk + kept * measured.tile.pair_disk
        share = part.get(stage, float(clustered))
        count = tasks[stage] if stage == "compare" else math.ceil(tasks[stage] * share)
        memory = ready.need.stages.get(stage, 0)
        yield StageCost(stage, count, seconds.get(stage, 0.0), memory, round(disk * share))


def _compare_seconds(
    missing: Sequence[Task], pairs: float, measured: Calibration, library: _Library
) -> float:
    tile, length = measured.tile, library.length
    read = sum(len(keys) for task in missing for _, keys in task.reads)
    alone = len(missing) * tile.alone + read * tile.batch * length
    return alone + _pairs_seconds(pairs, measured, library)


def _pairs_seconds(pairs: float, measured: Calibration, library: _Library) -> float:
    return pairs * measured.tile.pair * library.length**2


def _assigned_pairs(measured: Calibration, library: _Library) -> float:
    """Count the pairs of clips with landmarks that stand for groups, were these as many as in the sample."""
    return library.readable * REPRESENTATIVES * measured.clusters


def _cluster_seconds(measured: Calibration, library: _Library) -> float:
    (few, short), (many, long) = measured.squares.clusterings
    square = max(long - short, 0.0) / (many**2 - few**2)
    return max(short - square * few**2, 0.0) + square * library.clustered**2


def _represent_seconds(ready: Prepared, measured: Calibration, library: _Library, touched: float) -> float:
    squares, frames = measured.squares, measured.frames / max(measured.clips - measured.quarantined, 1)
    alike = measured.concentration * library.readable**2 * frames * library.length * squares.similarity
    read = measured.stages["represent"].seconds * library.by_clips
    passed = 0.0 if ready.amounts.landmarks is not None else library.pairs  # by landmarks it reads no pairs
    return passed * squares.passing + touched * (read + alike)


def affected(ready: Prepared) -> float:
    """Say what share of the clips may be aligned anew: those of clusters in which a clip comes or goes.

    All in a first run, and where they are aligned or clustered otherwise.
    """
    plan, earlier, settings = ready.plan, ready.graph.earlier, ready.graph.settings
    alike = all(earlier.settings.get(stage) == settings[stage] for stage in ("align", "cluster"))
    if ready.before is None or not alike:
        return 1.0
    clusters = max(ready.store.rows(ready.before.tables["references"]), 1)
    return min(1.0, (plan.new + plan.changed + plan.removed) / clusters)


def _elapsed(stages: Sequence[StageCost], workers: int, undivided: float) -> Elapsed:
    seconds = undivided + (SECONDS_TO_START if workers > 1 else 0.0)
    alone = seconds
    for one in stages:
        alone += _HANDED * one.tasks
        seconds += _HANDED * one.tasks
        if one.stage in ONE_TASK:
            seconds += one.seconds
            alone += one.seconds
        elif one.tasks:
            together = _TOGETHER if workers > 1 else 1.0
            share = math.ceil(one.tasks / workers) / one.tasks if one.tasks < 8 * workers else 1 / workers
            seconds += together * one.seconds * share
    return Elapsed(workers, seconds, alone)
