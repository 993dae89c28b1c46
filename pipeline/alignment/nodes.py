"""Where a sequence is cut into segments, and how far each cut may move in the output [CoTW 3.1, 4]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

LEAST_LENGTH = 4
"""The least stretched segment, in frames from node to node: slack <= L - 4 [CoTW 4]."""


def equal_nodes(frames: int, segment_length: int) -> NDArray[np.int64]:
    """Return nodes (c + 1,) at 0, L, ..., (c - 1) L and m - 1: the last segment takes the residual."""
    segments = max(1, frames // segment_length)
    return np.append(np.arange(segments) * segment_length, frames - 1)


def boundary_nodes(reference: FloatArray, nodes: NDArray[np.int64], weights: FloatArray) -> NDArray[np.int64]:
    """Return the nodes with each inner one moved to where the reference pauses nearby.

    The paper's future work: segments of unequal length that begin where one movement ends and the next
    begins. There the body is slowest, so each inner node goes to the frame of least speed (root of the
    weighted sum of squared central differences) within a quarter of its shorter segment, less the least
    length; to the nearest of equals.

    Parameters
    ----------
    reference : array (m, dofs)
    nodes : array (c + 1,)
        Equally spaced.
    weights : array (dofs,)
    """
    spans = np.diff(nodes)
    reach = max(int(spans.min()) - LEAST_LENGTH, 0) // 4
    if len(spans) == 1 or not reach:
        return nodes
    slopes = np.gradient(reference, axis=0)
    speed = np.sqrt((slopes**2 * weights).sum(axis=1))
    steps = sorted(range(-reach, reach + 1), key=abs)
    inner = nodes[1:-1, None] + np.array(steps)
    slowest = inner[np.arange(len(inner)), speed[inner].argmin(axis=1)]
    return np.concatenate([nodes[:1], slowest, nodes[-1:]])


@dataclass(frozen=True, eq=False)
class Segments:
    """The segments of a pair and how they may be stretched.

    Parameters
    ----------
    nodes : array (c + 1,)
        Their ends in length-matched time.
    slacks : array (c,)
        The most that each may be stretched or shortened.
    low, high : array (c + 1,)
        The output frames that each node may take.
    """

    nodes: NDArray[np.int64]
    slacks: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]


def stretchable(nodes: NDArray[np.int64], slack: int, open_ends: bool, least: int = LEAST_LENGTH) -> Segments:
    """Return segments that may be stretched by the slack, and shortened to the least length."""
    slacks = segment_slacks(nodes, slack, least)
    return Segments(nodes, slacks, *node_ranges(nodes, slacks, slack if open_ends else 0, least))


def segment_slacks(nodes: NDArray[np.int64], slack: int, least: int = LEAST_LENGTH) -> NDArray[np.int64]:
    """Return the most that each segment may be stretched or shortened (c,).

    The slack, but no segment becomes shorter than `least` frames, less one for the last: that is a frame
    shorter where L divides m.
    """
    return np.clip(np.diff(nodes) - max(least - 1, 1), 0, slack)


def node_ranges(
    nodes: NDArray[np.int64], slacks: NDArray[np.int64], trim: int = 0, least: int = LEAST_LENGTH
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the least and the greatest output frame that each node can take, (c + 1,) each.

    Table 1's loop bounds are wrong as printed. A node lies no further from its own frame than the segments
    before it can push it, and no further than those after it can pull it back.

    Parameters
    ----------
    nodes : array (c + 1,)
    slacks : array (c,)
    trim : int
        Frames by which the first node may come to lie before the output, and the last after it.
    least : int
        Frames of the first and (less one) of the last segment that stay within the output even so.
    """
    before = np.append(0, np.cumsum(slacks))
    after = before[-1] - before
    low, high = nodes - np.minimum(trim + before, after), nodes + np.minimum(before, trim + after)
    if trim:
        low[1:-1] = np.maximum(low[1:-1], least)
        high[1:-1] = np.minimum(high[1:-1], nodes[-1] - max(least - 1, 1))
    return low, high
