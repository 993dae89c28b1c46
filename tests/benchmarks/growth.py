"""How times grow with the number of clips, with their length and with the dimension."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.clips import ClipSet, spread
from tests.benchmarks.contests import Timing, alternate, our_contestant, peer_contestant
from tests.benchmarks.peer_process import PeerProcess

NUMBERS = (13, 27, 54, 108)
LENGTHENINGS = (1, 2, 4)
DIMENSIONS = (15, 30, 59, 118, 236)
# Clips of which length and dimension are varied.
FEW = 27
BESIDE = "dtaidistance"


@dataclass(frozen=True, eq=False)
class Stage:
    """One point of a growth: what was varied, the clips, the timings."""

    varied: str
    value: int
    clips: ClipSet
    timings: list[Timing]


def measure_growth(clips: ClipSet, peers: PeerProcess | None, rounds: int, most: int) -> list[Stage]:
    """Time DTW and the curve by us, and DTW by dtaidistance, at every point.

    Parameters
    ----------
    clips : ClipSet
        Unmerged.
    peers : PeerProcess, optional
        None where there is none.
    rounds : int
        Of each point.
    most : int
        Clips at most, for quick runs.
    """
    stages = []
    for varied, value, chosen in _points(clips, most):
        contestants = [our_contestant(task, chosen.clips) for task in ("dtw", "curve")]
        if peers is not None:
            peers.load(chosen)
            contestants.append(peer_contestant(peers, BESIDE, "dtw", chosen.name))
        stages.append(Stage(varied, value, chosen, alternate(contestants, rounds)))
    return stages


def _points(clips: ClipSet, most: int) -> Iterator[tuple[str, int, ClipSet]]:
    for number in NUMBERS:
        if number <= min(len(clips.clips), most):
            yield "clips", number, ClipSet("growth", spread(clips.clips, number))
    few = spread(clips.clips, min(FEW, most))
    for times in LENGTHENINGS:
        # Real clips repeated end to end: no longer clip would be as like itself as these are.
        yield "length", times, ClipSet("growth", [np.tile(clip, (times, 1)) for clip in few])
    for dimensions in DIMENSIONS:
        times = -(-dimensions // clips.dimensions)
        yield (
            "dimension",
            dimensions,
            ClipSet(
                "growth", [np.ascontiguousarray(np.tile(clip, (1, times))[:, :dimensions]) for clip in few]
            ),
        )
