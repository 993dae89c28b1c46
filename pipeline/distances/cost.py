"""The cost of showing one frame for another: Euclidean distances between all frames of two clips [DC 4.3].

    D(i, j) = |F_i - G_j| = sqrt(sum over k of (F_ik - G_jk)^2),    k ascending

A cell depends on its two frames alone, bit for bit, and on neither their order nor the shape around them:
the differences are squared and added one dimension after the other, several columns at a time, with no
fused operation. The rival, |F|^2 + |G|^2 - 2 F.G by a matrix product, takes a third of the time but loses
small distances to cancellation, and its last bits depend on the product's shape: padding all shapes to 64
cured that with OpenBLAS's AVX-512 kernels and not with its AVX2 ones.

Deviation from the paper: none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.motion import FloatArray

# A clip's frames are padded to these multiples, as columns and as rows, and its dimensions to SWEEP: what one
# turn of the kernel's loops takes. A dimension of zeros adds nothing; the padded cells are never read.
COLUMNS = 16
ROWS = 2
SWEEP = 4


class PackedClips(NamedTuple):
    """Clips laid out for `frame_distances`, as rows and as columns; `depth` is the padded dimension.

    Parameters
    ----------
    rows : array (sum of padded frames, depth)
        One clip's frames after another's.
    columns : array (depth * sum of padded frames,)
        Each clip transposed to (depth, padded frames), one after another.
    frames : array (clips,)
        Frames in each clip.
    row_start, column_start : array (clips + 1,)
        Where each clip begins in `rows`, and in `columns` divided by `depth`; the last entry is the end.
    """

    rows: FloatArray
    columns: FloatArray
    frames: NDArray[np.int64]
    row_start: NDArray[np.int64]
    column_start: NDArray[np.int64]


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
    rows, columns = pack_clips([first]).rows, pack_clips([second]).columns
    costs = np.empty((len(rows), len(columns) // rows.shape[1]))
    frame_distances(rows, columns.reshape(rows.shape[1], -1), costs)
    return costs[: len(first), : len(second)].astype(first.dtype)


def padded(count: int, multiple: int) -> int:
    """Return `count` rounded up to a multiple."""
    return -(-count // multiple) * multiple


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
        with np.errstate(invalid="ignore"):
            fits = np.abs(array) <= largest
        if not fits.all():
            frame, dimension = np.argwhere(~fits)[0]
            value = array[frame, dimension]
            wrong = "not a finite number" if not np.isfinite(value) else f"larger than {largest:.3g}"
            raise ValueError(
                f"{name} holds {value} at frame {frame}, dimension {dimension}: {wrong}; "
                "repair or drop the clip"
            )
    return arrays


def checked_costs(cost: ArrayLike) -> NDArray[np.float64]:
    """Convert a cost matrix to float64 and check it: two-dimensional, not empty, finite, not negative.

    Raises
    ------
    ValueError
        Says which of these fails, and where.
    """
    costs = np.ascontiguousarray(cost, dtype=np.float64)
    if costs.ndim != 2 or costs.size == 0:
        raise ValueError(f"cost has shape {costs.shape}; a cost matrix is (m, n) with at least one cell")
    fits = np.isfinite(costs) & (costs >= 0)
    if not fits.all():
        row, column = np.argwhere(~fits)[0]
        raise ValueError(
            f"cost holds {costs[row, column]} at row {row}, column {column}; "
            "costs are finite and not negative"
        )
    return costs


def pack_clips(clips: Sequence[FloatArray]) -> PackedClips:
    """Lay out checked clips of one dtype for `frame_distances`, padded with zeros."""
    frames = np.array([len(clip) for clip in clips], dtype=np.int64)
    row_start = np.concatenate([[0], np.cumsum([padded(len(clip), ROWS) for clip in clips])])
    column_start = np.concatenate([[0], np.cumsum([padded(len(clip), COLUMNS) for clip in clips])])
    dimensions = clips[0].shape[1]
    depth = padded(dimensions, SWEEP)
    rows = np.zeros((row_start[-1], depth), dtype=clips[0].dtype)
    columns = np.zeros(column_start[-1] * depth, dtype=clips[0].dtype)
    for index, clip in enumerate(clips):
        row, column, end = row_start[index], column_start[index], column_start[index + 1]
        rows[row : row + len(clip), :dimensions] = clip
        columns[column * depth : end * depth].reshape(depth, -1)[:dimensions, : len(clip)] = clip.T
    return PackedClips(rows, columns, frames, row_start, column_start)


@njit(cache=True, nogil=True)
def frame_distances(rows, columns, out):  # type: ignore[no-untyped-def]
    """Fill `out` (rows, width) from rows (rows, depth) and columns (depth, width), padded by `pack_clips`.

    Written so that the compiler vectorises over the columns: each cell still adds its terms in order of k.
    """
    depth, width = columns.shape
    sums, sums_below = np.empty(width, columns.dtype), np.empty(width, columns.dtype)
    for i in range(0, rows.shape[0], ROWS):
        sums[:] = 0
        sums_below[:] = 0
        for k in range(0, depth, SWEEP):
            x0, x1, x2, x3 = rows[i, k], rows[i, k + 1], rows[i, k + 2], rows[i, k + 3]
            y0, y1, y2, y3 = rows[i + 1, k], rows[i + 1, k + 1], rows[i + 1, k + 2], rows[i + 1, k + 3]
            c0, c1, c2, c3 = columns[k], columns[k + 1], columns[k + 2], columns[k + 3]
            for j in range(width):
                d0, d1, d2, d3 = x0 - c0[j], x1 - c1[j], x2 - c2[j], x3 - c3[j]
                e0, e1, e2, e3 = y0 - c0[j], y1 - c1[j], y2 - c2[j], y3 - c3[j]
                sums[j] = (((sums[j] + d0 * d0) + d1 * d1) + d2 * d2) + d3 * d3
                sums_below[j] = (((sums_below[j] + e0 * e0) + e1 * e1) + e2 * e2) + e3 * e3
        for j in range(width):
            out[i, j] = np.sqrt(sums[j])
        for j in range(width):
            out[i + 1, j] = np.sqrt(sums_below[j])
