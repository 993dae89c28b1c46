"""Every aligner behind one interface: what it is called, what it reads, and ``align(moving, reference)``.

The command line, the pages and the tests go through this list; a method that is added to it is in all three.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Literal

from motionary.pipeline.alignment.adaptive import adaptive_dtw
from motionary.pipeline.alignment.canonical_time_warping import canonical_time_warping
from motionary.pipeline.alignment.dtw import derivative_dtw, dtw
from motionary.pipeline.alignment.generalized import generalized_pair
from motionary.pipeline.alignment.iterative import iterative_motion_warping
from motionary.pipeline.alignment.limited import limited_dtw
from motionary.pipeline.alignment.online import Method, online_warp
from motionary.pipeline.alignment.search import cotw_search
from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.windows import Itakura, SakoeChiba
from motionary.pipeline.motion import FloatArray

Reads = Literal["features", "postures", "rotations"]

ONLINE_WINDOWS: Mapping[Method, int] = MappingProxyType({"A": 2, "B": 10, "C": 10})
"""At 30 frames a second: a third of a second to look ahead, the paper's 40 frames at 120."""


@dataclass(frozen=True)
class Aligner:
    """A method of alignment with its usual settings.

    Parameters
    ----------
    name : str
        What it is asked for by, on the command line too.
    title : str
        What it is called in tables and charts.
    source : str
        Where it comes from.
    reads : {"features", "postures", "rotations"}
        What `align` takes: the pose of every frame as (frames, dofs); joint rotations of one skeleton,
        linearised and already weighted by limb (frames, 3 joints), as
        `motionary.pipeline.alignment.postures.weighted_postures` makes them; or quaternions
        (frames, joints, 4).
    align : callable
        (moving, reference) -> Warp, with as many times as the reference has frames.
    other_dofs : bool
        Whether moving and reference may have other numbers of DOFs.
    """

    name: str
    title: str
    source: str
    reads: Reads
    align: Callable[[FloatArray, FloatArray], Warp]
    other_dofs: bool = False


_EVERY = (
    Aligner("uniform", "UTW", "[CoTW] 3.1", "features", uniform, other_dofs=True),
    Aligner("dtw", "DTW", "[CoTW] 2", "features", dtw),
    Aligner(
        "dtw-sakoe-chiba", "DTW, Sakoe-Chiba", "[GTW] 4.3", "features", partial(dtw, window=SakoeChiba())
    ),
    Aligner("dtw-itakura", "DTW, Itakura", "[GTW] 4.3", "features", partial(dtw, window=Itakura())),
    Aligner("limited-dtw", "DTW, 2 steps", "[ADTW]", "features", limited_dtw),
    Aligner("derivative-dtw", "DDTW", "Keogh and Pazzani 2001", "features", derivative_dtw),
    Aligner("iterative-motion-warping", "IMW", "Hsu and others 2005", "features", iterative_motion_warping),
    Aligner(
        "canonical-time-warping",
        "CTW",
        "Zhou and De la Torre 2009",
        "features",
        canonical_time_warping,
        other_dofs=True,
    ),
    Aligner(
        "generalized-time-warping", "GTW", "[GTW] 4", "features", generalized_pair, other_dofs=True
    ),
    Aligner("cotw", "CoTW", "[CoTW] 3, 4", "features", partial(cotw_search, effort="fast")),
    Aligner("adaptive-dtw", "adaptive DTW", "[ADTW]", "postures", adaptive_dtw),
    *(
        Aligner(
            f"online-{letter.lower()}", f"online {letter}", "[FP] 3", "rotations",
            partial(online_warp, method=letter, window=window),
        )
        for letter, window in ONLINE_WINDOWS.items()
    ),
)  # fmt: skip

ALIGNERS: Mapping[str, Aligner] = MappingProxyType({one.name: one for one in _EVERY})
"""By name, simplest first."""
