"""What a run will take: the answer of `motionary plan`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from motionary.workflows.costs.disk import PAGE
from motionary.workflows.costs.memory import Need
from motionary.workflows.costs.sizes import needed_text, size_text, time_text
from motionary.workflows.plan import Plan


@dataclass(frozen=True)
class StageCost:
    """What a stage takes.

    Parameters
    ----------
    stage : str
    tasks : int
        Those that have something to compute.
    seconds : float
        Of work, all its tasks together, on one core.
    memory : int
        Bytes that its largest task holds beside what a process holds anyway.
    disk : int
        Bytes that its results have.
    """

    stage: str
    tasks: int
    seconds: float
    memory: int
    disk: int


@dataclass(frozen=True)
class Elapsed:
    """How long a run takes by the clock.

    Parameters
    ----------
    workers : int
        Processes, a core each.
    seconds : float
        From its start to the published catalog.
    undivided : float
        Seconds of these that more workers do not make fewer.
    """

    workers: int
    seconds: float
    undivided: float


@dataclass(frozen=True)
class Foretold:
    """What a run will take.

    Parameters
    ----------
    plan : Plan
        Which clips are new, what is to be read and compared.
    memory : Need
        What the processes hold at most.
    clips, source_frames, frames, merged_frames, pairs : int
        Of the whole library: clips, their frames in the files, at the common rate, and with those of low
        motion merged; pairs of clips.
    stages : tuple of StageCost
        In the order of the run.
    workers : int
        Of the job.
    elapsed : tuple of Elapsed
        With several numbers of workers, the job's among them.
    sampled : int
        Clips that were read for this.
    calibration : float
        Seconds that it took.
    room_on_disk : int, optional
        Bytes that are free where the catalog lies; None where that is not known.
    """

    plan: Plan
    memory: Need
    clips: int
    source_frames: int
    frames: int
    merged_frames: int
    pairs: int
    stages: tuple[StageCost, ...]
    workers: int
    elapsed: tuple[Elapsed, ...]
    sampled: int
    calibration: float
    room_on_disk: int | None

    @property
    def seconds(self) -> float:
        """How long the job takes by the clock."""
        return next(one.seconds for one in self.elapsed if one.workers == self.workers)

    @property
    def work(self) -> float:
        """Seconds of work of all stages, on one core."""
        return sum(one.seconds for one in self.stages)

    @property
    def disk(self) -> int:
        """Bytes that the run writes."""
        return sum(one.disk for one in self.stages)

    def to_json(self) -> dict[str, Any]:
        """Write it as JSON values."""
        sums = {"seconds": self.seconds, "work": self.work, "disk": self.disk}
        return asdict(self) | sums

    def __str__(self) -> str:
        read = f"{self.source_frames:,} frames in the files, {self.frames:,} at the common rate"
        free = "" if self.room_on_disk is None else f" of {size_text(self.room_on_disk)} free"
        return "\n".join(
            [
                str(replace(self.plan, seconds=self.seconds)),
                f"{self.clips:,} clips, {read}, {self.merged_frames:,} merged; {self.pairs:,} pairs in all",
                "",
                *self._by_stage(),
                "",
                *self._by_workers(),
                "",
                f"memory: {needed_text(self.memory.bytes, self.memory.allowed)}, most of it beside the "
                f"processes for {self.memory.largest}; {self._scratch()}",
                f"disk: {size_text(self.disk + PAGE)}{free}, the overview page with it",
                f"from {self.sampled} clips that were tried in {self.calibration:.0f} s on this machine; "
                "workers are taken for as fast as its cores",
            ]
        )

    def _scratch(self) -> str:
        if not self.memory.scratch:
            return "temporary files by how many pairs prove to be near"
        return f"{size_text(self.memory.scratch)} of temporary files"

    def _by_stage(self) -> list[str]:
        rows = [("stage", "tasks", "work", "memory a task", "disk")]
        rows += [
            (one.stage, f"{one.tasks:,}", time_text(one.seconds), size_text(one.memory), size_text(one.disk))
            for one in self.stages
        ]
        return _columns([*rows, ("all", "", time_text(self.work), "", size_text(self.disk))])

    def _by_workers(self) -> list[str]:
        rows = [("workers", "time", "of which undivided")]
        rows += [(str(one.workers), time_text(one.seconds), time_text(one.undivided)) for one in self.elapsed]
        return _columns(rows)


def _columns(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Lay cells out, all but the first to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    aligned = [[cell.rjust(width) for cell, width in zip(row, widths, strict=True)] for row in rows]
    return [
        "  ".join([row[0].ljust(widths[0]), *cells[1:]]) for row, cells in zip(rows, aligned, strict=True)
    ]
