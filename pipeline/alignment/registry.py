"""Every aligner behind one interface: what it is called, what it reads, and ``align(moving, reference)``.

The command line, the pages and the tests go through this list; a method that is added to it is in all three.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from motionary.pipeline.alignment.path_warp import dtw
from motionary.pipeline.alignment.search import cotw_search
from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.motion import FloatArray

Reads = Literal["features", "postures", "rotations"]


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
        What `align` takes: the pose of every frame as (frames, dofs); linearised joint rotations
        (frames, dofs), of one skeleton; or quaternions (frames, joints, 4).
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
    Aligner("cotw", "CoTW", "[CoTW] 3, 4", "features", cotw_search),
)

ALIGNERS: Mapping[str, Aligner] = MappingProxyType({one.name: one for one in _EVERY})
"""By name, simplest first."""
