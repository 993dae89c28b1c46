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
    """Bound what a slack allows.

    Table 1's loop bounds are wrong as printed. A node lies no further from its own frame than the segments
    before it can push it, and no further than those after it can pull it back.

    Parameters
    ----------
    nodes : array (c + 1,)
    slack : int
        The most that a segment may be stretched or shortened; and with `open_ends`, how far the first node
        may come to lie before the output, and the last after it.
    open_ends : bool
    least : int
        No segment becomes shorter, nor what is seen of one that hangs over; the last by one frame, since it
        is a frame shorter where L divides m.
    """
    from motionary.pipeline.alignment.cotw_kernels import fill_bounds

    slacks, low, high = (np.empty(len(nodes) - turn, dtype=np.int64) for turn in (1, 0, 0))
    fill_bounds(nodes, slack, slack if open_ends else 0, least, slacks, low, high)
    return Segments(nodes, slacks, low, high)
