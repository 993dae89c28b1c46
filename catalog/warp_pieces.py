"""The warp of a pair in seconds, and in a few straight pieces: where one clip is faster, or waits.

A frame that meets several of the other clip is shared out among them, so that the way is a rising line from
both clips' beginnings to their ends (falling in `b` where that is played backward). It is told in straight
pieces: the piece that the line strays from furthest is cut there, until none strays further than TOLERANCE
or there are MOST_PIECES.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    from motionary.pipeline.distances.explain import WarpingPath

TOLERANCE = 0.1
"""Seconds that the line may stray from its pieces."""
MOST_PIECES = 6


@dataclass(frozen=True)
class WarpPiece:
    """A stretch of both clips in which neither changes its pace much.

    Parameters
    ----------
    start_a, end_a, start_b, end_b : float
        Seconds; `end_b` is before `start_b` where `b` is played backward.
    """

    start_a: float
    end_a: float
    start_b: float
    end_b: float


@dataclass(frozen=True)
class PairWarp:
    """The best way through the whole clips.

    Parameters
    ----------
    backward : bool
        Whether `b` is played backward.
    distance : float
        Mean cost along it.
    path_a, path_b : list of int (L,)
        The compared frames along it.
    seconds_a, seconds_b : list of float (L + 1,)
        When each of its cells begins in both clips, and the last one ends.
    pieces : list of WarpPiece
    """

    backward: bool
    distance: float
    path_a: list[int]
    path_b: list[int]
    seconds_a: list[float]
    seconds_b: list[float]
    pieces: list[WarpPiece]


def make_warp(path: WarpingPath, edges_a: FloatArray, edges_b: FloatArray) -> PairWarp:
    """Turn a path through the whole clips into times.

    Parameters
    ----------
    path : WarpingPath
    edges_a, edges_b : array (frames + 1,)
        Of both clips, the seconds at which every compared frame begins, and the last one ends.
    """
    rows, columns = path.cells.T
    seconds_a = _times(rows, edges_a)
    seconds_b = _times(columns[::-1], edges_b)[::-1] if path.backward else _times(columns, edges_b)
    line = np.column_stack([seconds_a, seconds_b])
    corners = line[_corners(line)]
    return PairWarp(
        backward=path.backward,
        distance=path.distance,
        path_a=rows.tolist(),
        path_b=columns.tolist(),
        seconds_a=seconds_a.tolist(),
        seconds_b=seconds_b.tolist(),
        pieces=[
            WarpPiece(*map(float, (start[0], end[0], start[1], end[1])))
            for start, end in zip(corners[:-1], corners[1:], strict=True)
        ],
    )


def _times(frames: NDArray[np.int64], edges: FloatArray) -> FloatArray:
    """When each cell begins, and the last one ends (L + 1,), of frames that rise from 0 by 0 or 1 (L,)."""
    counts = np.bincount(frames)
    turn = np.arange(len(frames)) - np.repeat(np.cumsum(counts) - counts, counts)
    begins = edges[frames] + (edges[frames + 1] - edges[frames]) * turn / counts[frames]
    return np.append(begins, edges[-1])


def _corners(line: FloatArray) -> list[int]:
    """Points of a line (L + 1, 2) between which straight pieces keep close to it."""
    corners = [0, len(line) - 1]
    while len(corners) <= MOST_PIECES:
        strays = [_furthest(line, *ends) for ends in zip(corners[:-1], corners[1:], strict=True)]
        distance, point = max(strays)
        if distance <= TOLERANCE:
            break
        corners = sorted([*corners, point])
    return corners


def _furthest(line: FloatArray, first: int, last: int) -> tuple[float, int]:
    """How far a line strays from the straight piece between two of its points, and where."""
    along = line[last] - line[first]
    length = float(np.hypot(*along))
    if length == 0:
        return 0.0, first
    apart = line[first : last + 1] - line[first]
    distances = np.abs(apart[:, 0] * along[1] - apart[:, 1] * along[0]) / length
    furthest = int(distances.argmax())
    return float(distances[furthest]), first + furthest
