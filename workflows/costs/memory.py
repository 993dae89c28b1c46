"""The memory that a run needs, and what it may have.

The most that the processes of a run hold together, pages that they share counted once:

    shared + processes * process + clips * listed + max(workers * largest parallel task, largest single task)

What is a batch's or a tile's is held by every worker at once; what is the whole library's is one task's
(cluster, represent, style), while the other workers wait. With one worker there is one process, else one
more than workers; on a cluster that is running the numbers are those of one of its workers.

The constants, in bytes, are of CPython 3.11 on Linux; how each was measured stands beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from motionary.pipeline.graph import ROOM
from motionary.workflows.costs.amounts import Amounts
from motionary.workflows.costs.sizes import size_text
from motionary.workflows.errors import UserError

# Of two workers with compiled kernels and their client: 339 MB resident alone, 216 MB with what they share
# divided among them (smaps_rollup after importing pipeline.graph and comparing eight clips).
_SHARED, _PROCESS = 140e6, 200e6
_LISTED = 15e3  # a clip in the layout, the graph and the library's tables: 155 MB of 10,000 in the client

# Growth of a process's greatest resident memory while `ingest` read the largest take of HDM05, then the 32
# largest (76.6 MB of 4.1 MB of text, 129 MB of 24 MB), and 64 embedded clips (54 MB of 8 MB).
_READ, _PARSED = 3.0, 16.0  # a byte of a batch's files, as tables and Parquet; of the file that is being read
_ANY = 30e6  # a task, whatever it does
_COMPARED = 500.0  # a pair of a tile: 456 of 256 clips with 256
_CLUSTERED = 8e3  # a clip that is clustered: seven dendrograms, their cuts, the graph of its nearest others
_SEEN = 1 / 16  # of the square of those, a bit a pair: see stages.columns.mapped_distances
_LINKED = 8.0  # of the square of the landmarks, and of a group that is refined: see stages.cluster
_NAMED = 600.0  # a clip in a task over the whole library: what it is called, its digest, its distance
_POSED = 0.3  # a byte of the library, as poses at 30 frames a second: 309 bytes a frame, see stages.represent
_STYLED, _AVERAGED, _ANALYSED = 2.6e3, 13e3, 62e3  # a clip of some 31 joints: see stages.style
_LARGEST_CLUSTER = 0.25  # of all clips: what is represented and styled cannot be divided further
_PAGE = 80e6  # the overview page: 61 MB of 80 clips, 53 of 10,000, in a process that has imported all else
_SCRATCH = 16.0  # a pair, in temporary files while it is clustered: see clustering.linkage and mapped

_MERGED = 0.1  # a byte of the library, merged frames of clips that are refined: .06 of embedded ones

_SLACK = 64e6
"""Bytes left beside the room of a task: what a part takes while it is read."""

ONE_TASK = ("cluster", "stand", "regroup", "identify", "represent", "style", "name", "publish")
"""Stages that are one task, over the whole library, and what comes after them."""


@dataclass(frozen=True)
class Need:
    """The memory that a run needs, in bytes.

    Parameters
    ----------
    bytes : int
        The most that all processes hold together; of a cluster that is running, one worker.
    allowed : int, optional
        What they may hold; None where nobody knows.
    room : int
        What a task over the whole library may hold of it at a time.
    workers : int
        Tasks at once of the stages that are not `ONE_TASK`.
    processes : int
    base : int
        What the processes hold before they have anything to do.
    file : str
        The clip of the largest file, which must be read in one piece.
    stages : mapping of str to int
        What the largest task of each stage holds beside that.
    scratch : int
        Temporary files that are mapped beside that: the system drops their pages where it needs the memory.
        0 where only near pairs are kept, for nobody knows how many.
    """

    bytes: int
    allowed: int | None
    room: int
    workers: int
    processes: int
    base: int
    file: str
    stages: Mapping[str, int]
    scratch: int

    @property
    def largest(self) -> str:
        """The stage that needs most."""
        return max(self.stages, key=lambda stage: _at_once(stage, self.workers) * self.stages[stage])

    @property
    def fits(self) -> bool:
        """Whether it is allowed."""
        return self.allowed is None or self.bytes <= self.allowed


def need_of(amounts: Amounts, workers: int, memory: int | None, scheduler: str | None = None) -> Need:
    """Say what memory a run needs.

    Parameters
    ----------
    amounts : Amounts
        Of the library.
    workers : int
        Processes on this machine.
    memory : int, optional
        Bytes that they may hold, as the caller said; by default what this machine, or its container, has.
    scheduler : str, optional
        A running Dask scheduler: then all of this is about one of its workers, and what that has is not known
        here.
    """
    at_once = 1 if scheduler else workers
    processes = 1 if at_once == 1 else at_once + 1
    base = round(_SHARED + processes * _PROCESS + amounts.clips * _LISTED)
    allowed = memory if memory is not None or scheduler else _memory_limit()
    room = ROOM if allowed is None else round(min(max(allowed - base - _SLACK, _SLACK), ROOM))
    stages = {stage: round(size) for stage, size in _tasks(amounts, room).items()}
    most = max(_at_once(stage, at_once) * size for stage, size in stages.items())
    scratch = 0.0 if amounts.pruned else _SCRATCH * amounts.clustered * (amounts.clustered - 1) / 2
    if amounts.landmarks is not None:
        scratch += at_once * _LINKED * amounts.landmarks**2 + _MERGED * amounts.library
    return Need(base + most, allowed, room, at_once, processes, base, amounts.largest, stages, round(scratch))


def refuse(need: Need) -> None:
    """Refuse a run that needs more than it may have.

    Raises
    ------
    UserError
        With both numbers, what needs it, and what to do about it.
    """
    if need.fits or need.allowed is None:
        return
    needed, allowed = size_text(need.bytes, up=True), size_text(need.allowed)
    raise UserError(
        f"the run needs about {needed} of memory and {allowed} is allowed: "
        f"{_processes_text(need)} {size_text(need.base)}, and {_largest_text(need)} "
        f"{size_text(need.bytes - need.base)}; {' or '.join(_mends(need))}"
    )


def _memory_limit() -> int:
    from distributed.system import memory_limit

    return memory_limit()


def _tasks(amounts: Amounts, room: int) -> dict[str, float]:
    """Say what the largest task of each stage holds, in bytes."""
    read, clips = _READ * amounts.batch, amounts.clips
    poses, undivided = _POSED * amounts.library, _LARGEST_CLUSTER * clips
    seen = 0 if amounts.pruned else _SEEN * amounts.clustered**2
    held = {
        "ingest": read + _PARSED * amounts.file,
        "resample": read,
        "compare": _COMPARED * amounts.tile,
        "cluster": _CLUSTERED * amounts.clustered + _NAMED * (clips - amounts.clustered) + seen,
        "identify": _NAMED * clips,
        "represent": _NAMED * clips + min(poses, max(room, _LARGEST_CLUSTER * poses)),
        "name": _NAMED * clips,
        "align": read + _NAMED * clips,
        # Of one cluster that is more than the averages of all clusters together.
        "style": _STYLED * clips + (_AVERAGED + _ANALYSED) * undivided,
        "publish": _PAGE,
    }
    if amounts.landmarks is not None:
        square = _LINKED * amounts.landmarks**2
        held |= {"sample": read, "assign": read, "stand": square, "refine": square}
        held |= {"regroup": _NAMED * clips}
    return {stage: _ANY + size for stage, size in held.items()}


def _at_once(stage: str, workers: int) -> int:
    return 1 if stage in ONE_TASK else workers


def _processes_text(need: Need) -> str:
    return "its process holds" if need.processes == 1 else f"its {need.processes} processes hold"


def _largest_text(need: Need) -> str:
    return f"{need.largest} of {need.file}" if need.largest == "ingest" else need.largest


def _mends(need: Need) -> list[str]:
    """Say what would make it fit, the least first."""
    assert need.allowed is not None
    mends = []
    for fewer in range(need.workers - 1, 0, -1):
        base = need.base - (need.processes - (1 if fewer == 1 else fewer + 1)) * _PROCESS
        most = max(_at_once(stage, fewer) * size for stage, size in need.stages.items())
        if base + most <= need.allowed:
            mends.append(f"use --workers {fewer}")
            break
    if need.largest == "ingest" and need.base < need.allowed:
        mends.append("take that file out")
    mends.append(f"allow more: --memory {-(-need.bytes // 10**8) / 10:g}GB")
    return mends
