"""The cost of showing one frame for another: Euclidean distances between all frames of two clips [DC 4.3].

    D(i, j) = |F_i - G_j| = sqrt(sum over k of (F_ik - G_jk)^2),    k ascending

A cell depends on its two frames alone, bit for bit, and on neither their order nor the shape around them:
the squared differences are added one dimension after the other, each by a fused multiply-add, which rounds
alike on every processor (`lanes.py`). The rival, |F|^2 + |G|^2 - 2 F.G by a matrix product, needs half the
operations but loses small distances to cancellation, and its last bits depend on the product's shape: padding
all shapes to 64 cured that with OpenBLAS's AVX-512 kernels and not with its AVX2 ones.

Deviation from the paper: none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES, ROWS, WORD, fill_block, padded
from motionary.pipeline.motion import FloatArray

# Half of the range: a greater one could be rounded up to infinity.
GREATEST_COST = 2.0**1023


class PackedClips(NamedTuple):
    """Clips laid out for `frame_distances`, as rows and as lanes, filled up by copies of their last frames.

    Parameters
    ----------
    rows : array (sum of frames filled up to ROWS, d)
        One clip's frames after another's.
    lanes : array (blocks, d, LANES)
        LANES frames a block, transposed, one clip's blocks after another's.
    frames : array (clips,)
        Frames in each clip.
    row_start, block_start : array (clips + 1,)
        Where each clip begins in `rows` and in `lanes`; the last entry is the end.
    """

    rows: FloatArray
    lanes: FloatArray
    frames: NDArray[np.int64]
    row_start: NDArray[np.int64]
    block_start: NDArray[np.int64]


def cost_matrix(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Euclidean distances between the frames of two clips (the matrix D of [DC] 4.3).

    Parameters
    ----------
    a : array (m, d)
        First clip, one frame a row.
    b : array (n, d)
        Second clip.

    Returns
    -------
    array (m, n)
        float32 where both clips are float32 (and then computed in it), else float64. `cost_matrix(b, a)` is
        its exact transpose; equal frames have distance exactly 0.

    Raises
    ------
    ValueError
        A clip is empty, not two-dimensional, holds a value that is not finite or too large to be squared,
        or the dimensions differ.
    """
    first, second = checked_clips([a, b], ["a", "b"])
    rows, lanes = pack_clips([first]).rows, pack_clips([second]).lanes
    costs = np.empty((len(rows), len(lanes) * LANES), dtype=first.dtype)
    frame_distances(rows, lanes, costs, np.empty((2, LANES), dtype=first.dtype))
    return np.ascontiguousarray(costs[: len(first), : len(second)])


def checked_clips(clips: Sequence[ArrayLike], names: Sequence[str]) -> list[FloatArray]:
    """Convert clips to arrays of one dtype, float32 where all are and else float64, and check them.

    Raises
    ------
    ValueError
        Names the clip at fault and what is wrong with it.
    """
    arrays = [np.asarray(clip) for clip in clips]
    single = all(array.dtype == np.float32 for array in arrays)
    arrays = [np.ascontiguousarray(array, dtype=np.float32 if single else np.float64) for array in arrays]
    for array, name in zip(arrays, names, strict=True):
        if array.ndim != 2 or array.size == 0:
            raise ValueError(
                f"{name} has shape {array.shape}; a clip is (frames, dimensions) with at least one of each"
            )
        if array.shape[1] != arrays[0].shape[1]:
            raise ValueError(
                f"{name} has {array.shape[1]} dimensions and {names[0]} has {arrays[0].shape[1]}; "
                "frames can only be compared in the same dimensions"
            )
        # A squared difference of two such values, summed over the dimensions, must stay finite.
        largest = np.sqrt(np.finfo(array.dtype).max / (5.0 * array.shape[1]))
        # The extremes first: they need no array of their own, and are not a number where any value is not.
        if not (-largest <= array.min() and array.max() <= largest):
            with np.errstate(invalid="ignore"):
                frame, dimension = np.argwhere(~(np.abs(array) <= largest))[0]
            value = array[frame, dimension]
            wrong = "not a finite number" if not np.isfinite(value) else f"larger than {largest:.3g}"
            raise ValueError(
                f"{name} holds {value} at frame {frame}, dimension {dimension}: {wrong}; "
                "repair or drop the clip"
            )
    return arrays


def checked_costs(cost: ArrayLike) -> NDArray[np.float64]:
    """Convert a cost matrix to float64 and check it: two-dimensional, not empty, from 0 to 2^1023.

    Raises
    ------
    ValueError
        Says which of these fails, and where.
    """
    costs = np.ascontiguousarray(cost, dtype=np.float64)
    if costs.ndim != 2 or costs.size == 0:
        raise ValueError(f"cost has shape {costs.shape}; a cost matrix is (m, n) with at least one cell")
    fits = (costs >= 0) & (costs <= GREATEST_COST)
    if not fits.all():
        row, column = np.argwhere(~fits)[0]
        raise ValueError(
            f"cost holds {costs[row, column]} at row {row}, column {column}; "
            "costs are finite and not negative, and at most 2^1023"
        )
    return costs


def filled_up(costs: FloatArray) -> FloatArray:
    """Fill a cost matrix up to whole lanes, and after its last row to a whole word, by zeros."""
    return np.pad(costs, ((0, WORD // LANES), (0, -costs.shape[1] % LANES)))


def pack_clips(clips: Sequence[FloatArray]) -> PackedClips:
    """Lay out checked clips of one dtype for `frame_distances`."""
    frames = np.array([len(clip) for clip in clips], dtype=np.int64)
    row_start = np.concatenate([[0], np.cumsum(padded(frames, ROWS))])
    block_start = np.concatenate([[0], np.cumsum(padded(frames, LANES))]) // LANES
    dimensions = clips[0].shape[1]
    rows = np.empty((row_start[-1], dimensions), dtype=clips[0].dtype)
    lanes = np.empty((block_start[-1], dimensions, LANES), dtype=clips[0].dtype)
    _lay_out(np.concatenate(clips), frames, row_start, block_start, rows, lanes)
    return PackedClips(rows, lanes, frames, row_start, block_start)


@kernel
def _lay_out(stacked, frames, row_start, block_start, rows, lanes):  # type: ignore[no-untyped-def]
    """Fill `rows` and `lanes` from clips stacked one after another, and what they leave by last frames."""
    begin, dimensions = 0, stacked.shape[1]
    for clip in range(len(frames)):
        last = begin + frames[clip] - 1
        for row in range(row_start[clip], row_start[clip + 1]):
            frame = min(begin + row - row_start[clip], last)
            for k in range(dimensions):
                rows[row, k] = stacked[frame, k]
        for block in range(block_start[clip], block_start[clip + 1]):
            for lane in range(LANES):
                frame = min(begin + (block - block_start[clip]) * LANES + lane, last)
                for k in range(dimensions):
                    lanes[block, k, lane] = stacked[frame, k]
        begin = last + 1


@kernel
def frame_distances(rows, lanes, out, extremes):  # type: ignore[no-untyped-def]
    """Fill `out` (rows, blocks * LANES) from rows (rows, d) and lanes (blocks, d, LANES) of `pack_clips`.

    Returns the least and the greatest cost; `extremes` (2, LANES) is room for those of every lane.
    """
    for lane in range(LANES):
        extremes[0, lane], extremes[1, lane] = np.inf, -np.inf
    for block in range(len(lanes)):
        for i in range(0, len(rows), ROWS):
            fill_block(rows, i, lanes, block, out, extremes)
    low, high = extremes[0, 0], extremes[1, 0]
    for lane in range(1, LANES):
        low, high = min(low, extremes[0, lane]), max(high, extremes[1, lane])
    return low, high
