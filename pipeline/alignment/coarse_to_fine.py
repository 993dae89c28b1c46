"""A search for long sequences: warps that are likely to be worth much, refined level by level [CoTW 4].

The grid's time grows with the fourth power of the number of frames. So both sequences are brought to at
most 144 frames, the warps that maximise an additive version of eq. 8 are found there for every segment length
(`likely_warps`), and those of greatest eq. 8 value, a few for each number of segments, are carried up level
by level, each at most twice as long as the last. On every level inner nodes are moved one or two at a time
while that raises the value, within the slack.

What comes out keeps to CoTW's constraints; it maximises eq. 8 and not Table 1's sum, and so is most often
worth a little more than the grid's best.
"""

from __future__ import annotations

from collections import Counter
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.cotw import placed_nodes
from motionary.pipeline.alignment.grid import GridWarp
from motionary.pipeline.alignment.likely_warps import likely_warps
from motionary.pipeline.alignment.matched import MatchedPair
from motionary.pipeline.alignment.nodes import LEAST_LENGTH, Segments, stretchable
from motionary.pipeline.alignment.whole_output import WholeOutput
from motionary.pipeline.config import Spacing

COARSE_FRAMES = 144
# From this length on every second is tried on the coarsest level; those nearby are tried at the end.
_DENSE = 32
# How many warps are refined: of the coarsest level; of those as many as have one number of segments; and from
# level to level as many as have these frames together, so that long sequences take no longer than others.
_CARRIED, _OF_EACH_COUNT, _FRAMES_CARRIED = 14, 3, 1200
# The best third are tried with segments a little shorter and longer too.
_NEARBY = (-2, -1, 1, 2)
# Frames by which nodes are first moved, on each level.
_FIRST_STEP = 4


def refined_warps(
    pair: MatchedPair, shortest: int, alpha: float, spacing: Spacing, open_ends: bool
) -> list[GridWarp]:
    """Find warps of great eq. 8 value, of more frames than COARSE_FRAMES.

    Parameters
    ----------
    pair : MatchedPair
    shortest : int
        The least L, frames of the reference.
    alpha : float
        Weight of distortion.
    spacing : {"equal", "boundaries"}
    open_ends : bool
    """
    coarse, *levels = _levels(pair.frames)
    level = pair.at_length(coarse)
    least, shortest_here = (ceil(length * coarse / pair.frames) for length in (LEAST_LENGTH, shortest))
    shortest_here = max(shortest_here, least + 1)
    lengths = [*range(shortest_here, _DENSE), *range(max(shortest_here, _DENSE), coarse // 2 + 1, 2)]
    warps = list(likely_warps(level, lengths, least, alpha, spacing, open_ends))
    carried = _worth_refining(warps, WholeOutput(level), alpha)
    for frames in levels:
        level = pair.at_length(frames)
        refine = _Refinement(level, pair.frames, shortest, alpha, spacing, open_ends)
        carried = refine([(warp, _length_at(warp, frames)) for warp in carried])
        carried = carried[: max(1, _FRAMES_CARRIED // frames)]
    best = carried[: max(1, len(carried) // 3)]
    return carried + refine([(warp, warp.segment_length + turn) for warp in best for turn in _NEARBY])


class _Refinement:
    """Brings warps to a level and moves their nodes there.

    Parameters
    ----------
    level : MatchedPair
        The pair at some number of frames.
    frames : int
        m, frames of the reference.
    shortest : int
        The least L, in those.
    alpha, spacing, open_ends
        As in `refined_warps`.
    """

    def __init__(
        self, level: MatchedPair, frames: int, shortest: int, alpha: float, spacing: Spacing, open_ends: bool
    ) -> None:
        self._level, self._alpha, self._spacing, self._open_ends = level, alpha, spacing, open_ends
        self._least, self._shortest = (
            ceil(length * level.frames / frames) for length in (LEAST_LENGTH, shortest)
        )
        self._whole = WholeOutput(level)

    def __call__(self, warps: list[tuple[GridWarp, int]]) -> list[GridWarp]:
        """Return coarser warps at this level, each with a segment length, by falling value.

        Those whose length does not give as many segments are left out.
        """
        finer = []
        for warp, length in warps:
            segments = len(warp.nodes) - 1
            if length >= self._shortest and self._level.frames // length == segments:
                finer.append(self._refined(warp, length))
        finer.sort(key=lambda one: -one[0])
        return [warp for _, warp in finer]

    def _refined(self, warp: GridWarp, length: int) -> tuple[float, GridWarp]:
        from motionary.pipeline.alignment.cotw_kernels import used_slack

        nodes = placed_nodes(self._level, length, len(warp.nodes) - 1, self._spacing)
        segments = stretchable(nodes, length - self._least, self._open_ends, self._least)
        moved = _within(segments, _carried_up(warp, nodes))
        value = self._whole.climb(segments, moved, self._alpha, _FIRST_STEP)
        return value, GridWarp(length, used_slack(nodes, moved), nodes, moved)


def _levels(frames: int) -> list[int]:
    """Numbers of frames from the coarsest, at most COARSE_FRAMES, to all, each at most twice the last."""
    steps = max(1, ceil(log2(frames / COARSE_FRAMES)))
    coarse = min(frames, COARSE_FRAMES)
    return [round(coarse * (frames / coarse) ** (step / steps)) for step in range(steps + 1)]


def _worth_refining(warps: list[GridWarp], whole: WholeOutput, alpha: float) -> list[GridWarp]:
    """Choose the best, and not all of one number of segments: they would lead to the same warp."""
    values = []
    for warp in warps:
        correlation, distortion = whole(warp.nodes, warp.moved)
        values.append(correlation - alpha * distortion)
    chosen: list[GridWarp] = []
    counts: Counter[int] = Counter()
    for place in sorted(range(len(warps)), key=lambda i: -values[i]):
        segments = len(warps[place].nodes)
        if len(chosen) < _CARRIED and counts[segments] < _OF_EACH_COUNT:
            chosen.append(warps[place])
            counts[segments] += 1
    return chosen


def _length_at(warp: GridWarp, frames: int) -> int:
    """Return a warp's L among more frames: as near as gives as many segments."""
    segments = len(warp.nodes) - 1
    length = round(warp.segment_length * frames / (warp.nodes[-1] + 1))
    return min(max(length, frames // (segments + 1) + 1), frames // segments)


def _carried_up(warp: GridWarp, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return where a coarser warp puts the nodes of a finer level."""
    scale = nodes[-1] / warp.nodes[-1]
    return np.rint(np.interp(nodes, warp.nodes * scale, warp.moved * scale)).astype(np.int64)


def _within(segments: Segments, moved: NDArray[np.int64]) -> NDArray[np.int64]:
    """Bring moves that rounding has put out of their bounds back into them.

    From the last node back each takes the nearest place that its range and the segment after it allow; the
    ranges are such that there is one.
    """
    spans = np.diff(segments.nodes)
    moved = np.clip(moved, segments.low, segments.high)
    for k in range(len(spans) - 1, -1, -1):
        latest = moved[k + 1] - spans[k] + segments.slacks[k]
        earliest = moved[k + 1] - spans[k] - segments.slacks[k]
        moved[k] = min(max(moved[k], earliest, segments.low[k]), latest, segments.high[k])
    return moved
