"""Timed contests: contestants take turns, round by round, and their medians are compared."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

from motionary.pipeline.distances import pairwise_distances, pairwise_dtw
from tests.benchmarks.clips import Clip, ClipSet
from tests.benchmarks.peer_process import PeerProcess

OURS = "motionary"
OUR_TASKS: dict[str, Callable[[list[Clip], int], object]] = {
    "dtw": lambda clips, threads: pairwise_dtw(clips, n_jobs=threads),
    "b_dtw": lambda clips, threads: pairwise_dtw(clips, n_jobs=threads, bidirectional=True),
    "curve": lambda clips, threads: pairwise_distances(clips, n_jobs=threads),
}
TASK_NAMES = {"dtw": "DTW", "b_dtw": "B-DTW", "curve": "DTW-Curve"}

# What each peer computes, and by which call. It is timed on the same values as float64, its own type.
PEERS = {
    "dtaidistance": "dtw_ndim.distance_matrix_fast, root of summed squared distances",
    "dtaidistance, rooted": "the same with inner_dist='euclidean': summed distances, as ours",
    "aeon": "dtw_pairwise_distance of (channels, frames) arrays: summed squared distances",
    "aeon, frames contiguous": "the same, each frame's values side by side in memory",
    "tslearn": "cdist_dtw, root of summed squared distances",
}
DTAIDISTANCE, AEON = ("dtaidistance", "dtaidistance, rooted"), ("aeon",)
# Rounds that a slow peer takes part in, so that a run stays short.
FEWER_ROUNDS = {"tslearn": 2}
WARM_UP_CLIPS = 4
# A sample is the mean of as many passes as take this long: in a shorter one a core is still waking up.
SAMPLE_SECONDS = 0.25
# The clips are taken so many times over to compare one thread with two, which share out tiles.
REPEATS_FOR_THREADS = 3


@dataclass(frozen=True)
class Contestant:
    """Who computes what.

    Parameters
    ----------
    who, task : str
        A name of `PEERS` or `OURS`; "dtw", "b_dtw" or "curve".
    seconds : callable
        Seconds of one pass over all pairs of the first clips, or of all (None), taken in the process that
        computes.
    rounds : int, optional
        At most so many.
    """

    who: str
    task: str
    seconds: Callable[[int | None], float]
    rounds: int | None = None


@dataclass(frozen=True)
class Timing:
    """All samples of a contestant, seconds a pass."""

    who: str
    task: str
    samples: list[float]

    @property
    def seconds(self) -> float:
        """The median."""
        return median(self.samples)


def our_contestant(task: str, clips: Sequence[Clip], threads: int = 1, who: str = OURS) -> Contestant:
    """Let motionary compute a task."""

    def seconds(first: int | None) -> float:
        chosen = list(clips[:first])
        began = time.perf_counter()
        OUR_TASKS[task](chosen, threads)
        return time.perf_counter() - began

    return Contestant(who, task, seconds)


def peer_contestant(peers: PeerProcess, who: str, task: str, clips: str) -> Contestant:
    """Let a peer compute a task on clips it has loaded."""
    return Contestant(
        who, task, lambda first: peers.seconds(who, task, clips, first), rounds=FEWER_ROUNDS.get(who)
    )


def alternate(contestants: Sequence[Contestant], rounds: int) -> list[Timing]:
    """Time contestants in turn, every second round in the opposite order.

    Before the first round each takes a few clips, which is not counted: that compiles what is compiled.
    """
    for one in contestants:
        one.seconds(WARM_UP_CLIPS)
    timings = [Timing(one.who, one.task, []) for one in contestants]
    for turn in range(rounds):
        for one, timing in list(zip(contestants, timings, strict=True))[:: 1 if turn % 2 == 0 else -1]:
            if one.rounds is None or turn < one.rounds:
                timing.samples.append(_sample(one))
    return timings


def _sample(contestant: Contestant) -> float:
    passes: list[float] = []
    while sum(passes) < SAMPLE_SECONDS:
        passes.append(contestant.seconds(None))
    return sum(passes) / len(passes)


def all_tasks(clips: ClipSet, peers: PeerProcess | None, rounds: int) -> list[Timing]:
    """DTW, B-DTW and the curve of all pairs by us; DTW, and DTW in both directions, by the peers."""
    contestants = [our_contestant(task, clips.clips) for task in OUR_TASKS]
    if peers is not None:
        peers.load(clips)
        contestants += [
            peer_contestant(peers, who, task, clips.name) for task in ("dtw", "b_dtw") for who in PEERS
        ]
    return alternate(contestants, rounds)


def two_threads(clips: ClipSet, rounds: int) -> list[Timing]:
    """Our DTW and curve by one thread and by two."""
    return alternate(
        [
            our_contestant(task, clips.clips * REPEATS_FOR_THREADS, threads, who)
            for task in ("dtw", "curve")
            for threads, who in ((1, "1 thread"), (2, "2 threads"))
        ],
        rounds,
    )


def fastest(timings: Sequence[Timing], task: str, names: Sequence[str]) -> Timing | None:
    """Return the timing with the least median among contestants of a task, where any took part."""
    found = [timing for timing in timings if timing.task == task and timing.who in names]
    return min(found, key=lambda timing: timing.seconds, default=None)
