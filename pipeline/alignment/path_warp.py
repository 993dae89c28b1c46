"""Warps that follow a path of frames: what dynamic time warping (`dtw.py`) and its kind share.

A path joins frames of the moving sequence with frames of the reference, monotonously in both. The moving
sequence is shown in the reference's time, so reference frame k shows the *mean* of the moving frames that the
path joins with it:

    source_time(k) = mean { i : (i, k) in path }

Consecutive means never fall, since a path's steps never do. The paper instead stretches both sequences to the
path's length, "a warped version of the reference", with a still frame wherever the path runs along an axis
[CoTW 6.1, Figure 17]; here the reference keeps its time, and moving frames are run over where the path
demands it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.alignment.warp import Warp


@dataclass(frozen=True, eq=False)
class PathWarp(Warp):
    """A warp and the path it was made of; see `path_warp`.

    Parameters
    ----------
    path : array (L, 2) int64
        Joined frames: of the moving sequence, of the reference.
    """

    path: NDArray[np.int64]


def path_warp(path: ArrayLike, moving_frames: int) -> PathWarp:
    """Turn a path of joined frames into a warp.

    Parameters
    ----------
    path : array (L, 2) of int
        Frames of the moving sequence and of the reference; neither falls, and every reference frame from 0 to
        the last is joined with some moving frame.
    moving_frames : int
        Length of the moving sequence.

    Returns
    -------
    PathWarp
        At each reference frame the mean of the moving frames joined with it.

    Raises
    ------
    ValueError
        The path is no such path.
    """
    cells = np.array(path)
    if cells.ndim != 2 or cells.shape[1] != 2 or not cells.size or not np.issubdtype(cells.dtype, np.integer):
        raise ValueError(
            f"path has shape {cells.shape} and type {cells.dtype}; it needs whole numbers, "
            "(cells, 2), at least one cell"
        )
    falls = np.flatnonzero((np.diff(cells, axis=0) < 0).any(axis=1))
    if falls.size:
        cell = int(falls[0])
        raise ValueError(
            f"path goes from {tuple(cells[cell].tolist())} to {tuple(cells[cell + 1].tolist())} after cell "
            f"{cell}; neither sequence's frames may fall"
        )
    if cells[0, 0] < 0 or cells[-1, 0] >= moving_frames:
        raise ValueError(
            f"path joins moving frames {cells[0, 0]} to {cells[-1, 0]}; "
            f"a moving sequence of {moving_frames} frames has 0 to {moving_frames - 1}"
        )
    if cells[0, 1] < 0:
        raise ValueError(f"path begins at reference frame {cells[0, 1]}; frames count from 0")
    joined = np.bincount(cells[:, 1])
    if not joined.all():
        missing = int(np.argmin(joined))
        raise ValueError(f"path meets no reference frame {missing}; it must meet all from 0 on")
    source_time = np.bincount(cells[:, 1], weights=cells[:, 0]) / joined
    return PathWarp(source_time, moving_frames, cells.astype(np.int64))
