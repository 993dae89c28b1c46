"""From measured runs to a larger library on more workers: fitted growth, and the arithmetic of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from motionary.pipeline.task import MAKES
from motionary.workflows.costs.memory import ONE_TASK
from tests.benchmarks.scale_graph import GraphSize
from tests.benchmarks.scale_run import Measured

DIVIDED = tuple(stage for stage in MAKES if stage not in ONE_TASK)
"""Stages of many tasks; every other is one task, in one process."""
REST = "start, plan, publish"
"""What the clock shows beyond the stages, waiting for the last of their tasks among it."""
FRAMES_POWER = {"ingest": 1, "resample": 1, "compare": 2, "represent": 1, "align": 2, "style": 1}
"""By which power of a clip's length a stage's work grows; not at all where it is not named."""
ASSUMPTIONS = (
    "A worker is as fast as a core of this machine beside as many others as worked here, and has a core.",
    f"{', '.join(DIVIDED)} divide evenly among workers; each ends with the wait for one of its tasks.",
    "Every other stage is one task in one process: more workers do not make it faster.",
    "A stage's seconds go on from the largest run by the exponent fitted over all of them.",
    "Files and catalog are read and written as fast as here by all workers at once; what that asks of "
    "disk and network is told beside.",
    "A clip's merged frames are to its frames as here. Where clips are longer, comparing and aligning grow "
    "with the square of their length, other stages in proportion: assumed, not measured.",
    "Memory is a sum of a part for the processes, one for the clips and one for the pairs, fitted; "
    "--memory holds it to less.",
    "Pairs on disk go on by their exponent, every other table in proportion to the frames.",
    "No worker is lost, and nobody else uses them.",
)


@dataclass(frozen=True)
class Growth:
    """A quantity that goes with a power of the number of clips.

    Parameters
    ----------
    exponent : float
        Least squares on the logarithms; nan of a single size.
    clips : int
        The largest library.
    largest : float
        What was measured there.
    """

    exponent: float
    clips: int
    largest: float

    def at(self, clips: int) -> float:
        """Go on from the largest library by the exponent."""
        return 0.0 if self.largest == 0 else self.largest * (clips / self.clips) ** self.exponent


def fitted(clips: Sequence[int], values: Sequence[float]) -> Growth:
    """Fit a power to positive values; sizes go up, and those where nothing was measured are passed over."""
    x, y = (np.array([(n, one) for n, one in zip(clips, values, strict=True) if one > 0]).reshape(-1, 2)).T
    exponent = float("nan") if len(x) < 2 else float(np.polyfit(np.log(x), np.log(y), 1)[0])
    return Growth(exponent, clips[-1], values[-1])


def fitted_sum(clips: Sequence[int], values: Sequence[float], at: int) -> float:
    """Fit a constant, a share of the clips and one of their square, none below 0; return the sum at a size.

    Each value counts by its relative error; fewer than three say nothing, and the sum is nan.
    """
    if len(clips) < 3:
        return float("nan")

    def terms(sizes: Sequence[int]) -> np.ndarray:
        return np.vander(np.asarray(sizes, float) / clips[-1], 3, increasing=True)

    shares, _ = nnls(terms(clips) / np.asarray(values)[:, None], np.ones(len(values)))
    return float(terms([at])[0] @ shares)


def seconds_by_stage(run: Measured) -> dict[str, float]:
    """Return a run's seconds of work by stage, and what the clock shows beside them."""
    divided = sum(seconds for stage, seconds in run.stages.items() if stage in DIVIDED)
    alone = sum(run.stages.values()) - divided
    return run.stages | {REST: max(run.seconds - divided / run.workers - alone, 0.0)}


def growth_by_stage(runs: Sequence[Measured]) -> dict[str, Growth]:
    """Fit every stage's growth over runs of one route, smallest first."""
    clips, seconds = [run.clips for run in runs], [seconds_by_stage(run) for run in runs]
    return {stage: fitted(clips, [one[stage] for one in seconds]) for stage in seconds[0]}


@dataclass(frozen=True)
class StageModel:
    """What a stage would take.

    Parameters
    ----------
    work : float
        Seconds on one core.
    elapsed : float
        Seconds on all workers.
    tasks : int
    """

    work: float
    elapsed: float
    tasks: int


@dataclass(frozen=True)
class Model:
    """What a library would take.

    Parameters
    ----------
    clips, workers : int
    frames_a_clip : float
        At the common rate.
    stages : dict of StageModel
    memory : float
        Bytes of a tree of as many processes as were measured, without mapped files.
    disk : dict of float
        Bytes by table.
    scheduled : int
        Bytes that the scheduler is sent.
    read : float
        Bytes of merged frames that the tiles read, each its two sides.
    """

    clips: int
    workers: int
    frames_a_clip: float
    stages: dict[str, StageModel]
    memory: float
    disk: dict[str, float]
    scheduled: int
    read: float

    @property
    def seconds(self) -> float:
        """By the clock."""
        return sum(stage.elapsed for stage in self.stages.values())


def model(
    runs: Sequence[Measured], clips: int, workers: int, frames_a_clip: float | None, graph: GraphSize
) -> Model:
    """Say what a library would take, judging by runs of one route.

    Parameters
    ----------
    runs : sequence of Measured
        Smallest first, two at least.
    clips, workers : int
        Of the library, and of the cluster that it is given.
    frames_a_clip : float, optional
        At the common rate; None for as many as in the largest run.
    graph : GraphSize
        Of so many clips.
    """
    last = runs[-1]
    here = last.frames / last.clips
    longer = (frames_a_clip or here) / here
    stages = {}
    for stage, growth in growth_by_stage(runs).items():
        work = growth.at(clips) * longer ** FRAMES_POWER.get(stage, 0)
        # The graph is that of all pairs; further stages have a task a batch, as reading has.
        tasks = 1 if stage in ONE_TASK else graph.tasks.get(stage, graph.tasks["ingest"])
        elapsed = work / workers + work / tasks if stage in DIVIDED else work
        stages[stage] = StageModel(work, min(elapsed, work), tasks)
    pairs = fitted([run.clips for run in runs], [run.tables["pairs"] for run in runs]).at(clips)
    disk = {
        table: pairs if table == "pairs" else size * longer * clips / last.clips
        for table, size in last.tables.items()
    }
    tiles = graph.tasks["compare"]
    return Model(
        clips=clips, workers=workers, frames_a_clip=here * longer, stages=stages, disk=disk,
        memory=fitted_sum([run.clips for run in runs], [run.peak.own for run in runs], clips),
        scheduled=graph.bytes, read=tiles * 2 * graph.side * disk.get("resampled", 0.0) / clips,
    )  # fmt: skip
