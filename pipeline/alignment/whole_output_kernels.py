"""The compiled kernels of eq. 8: see `motionary.pipeline.alignment.whole_output`.

What eq. 8 needs of an output are four sums over its frames for each DOF: values, squares, products with the
reference and squared steps. They are kept by segment, since a node that moves changes two of them.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

Integers = NDArray[np.int64]
_VALUES, _SQUARES, _PRODUCTS, _STEPS = range(4)
_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_kernel
def correlation_and_distortion(
    nodes: Integers,
    moved: Integers,
    source: FloatArray,
    target: FloatArray,
    shares: FloatArray,
    source_floor: FloatArray,
    inverse_target: FloatArray,
    slopes: FloatArray,
) -> tuple[float, float]:
    """Return rho and |h| of nodes moved in the output; `shares` are the weights over their sum."""
    sums = np.zeros((len(nodes) - 1, 4, source.shape[1]))
    for k in range(len(sums)):
        _sum_segment(nodes, moved, k, source, target, sums[k])
    return _judged(sums, len(source), shares, source_floor, inverse_target, slopes)


@_kernel
def climb(
    nodes: Integers,
    moved: Integers,
    slacks: Integers,
    low: Integers,
    high: Integers,
    alpha: float,
    step: int,
    source: FloatArray,
    target: FloatArray,
    shares: FloatArray,
    source_floor: FloatArray,
    inverse_target: FloatArray,
    slopes: FloatArray,
) -> float:
    """Move inner nodes, one or two neighbours at a time, while that raises rho - alpha |h|."""
    segments = len(nodes) - 1
    sums = np.zeros((segments, 4, source.shape[1]))
    for k in range(segments):
        _sum_segment(nodes, moved, k, source, target, sums[k])
    rho, h = _judged(sums, len(source), shares, source_floor, inverse_target, slopes)
    best = rho - alpha * h
    kept = np.empty((3, 4, source.shape[1]))
    while step >= 1:
        better = True
        while better:
            better = False
            for wide in range(2):
                for k in range(1, segments - wide):
                    last = k + wide
                    for side in (-step, step):
                        if moved[k] + side < low[k] or moved[last] + side > high[last]:
                            continue
                        before = moved[k] + side - moved[k - 1] - nodes[k] + nodes[k - 1]
                        after = moved[last + 1] - moved[last] - side - nodes[last + 1] + nodes[last]
                        if abs(before) > slacks[k - 1] or abs(after) > slacks[last]:
                            continue
                        _shift(moved, k, last, side)
                        for one in range(k - 1, last + 1):
                            _copy(sums[one], kept[one - k + 1])
                            _sum_segment(nodes, moved, one, source, target, sums[one])
                        rho, h = _judged(sums, len(source), shares, source_floor, inverse_target, slopes)
                        if rho - alpha * h > best + 1e-12:
                            best, better = rho - alpha * h, True
                        else:
                            _shift(moved, k, last, -side)
                            for one in range(k - 1, last + 1):
                                _copy(kept[one - k + 1], sums[one])
        step //= 2
    return best


@_kernel
def _shift(moved: Integers, first: int, last: int, frames: int) -> None:
    for k in range(first, last + 1):
        moved[k] += frames


@_kernel
def _copy(values: FloatArray, to: FloatArray) -> None:
    """Copy cell by cell: an assignment of slices takes seconds to compile, for the texts of its errors."""
    for row in range(values.shape[0]):
        for column in range(values.shape[1]):
            to[row, column] = values[row, column]


@_kernel
def _sum_segment(
    nodes: Integers, moved: Integers, k: int, source: FloatArray, target: FloatArray, sums: FloatArray
) -> None:
    """Fill the four sums of the output's frames from node k up to the next, of the last segment with it."""
    frames, dofs = source.shape
    first, out = moved[k], moved[k + 1] - moved[k]
    pace = (nodes[k + 1] - nodes[k]) / max(out, 1)
    begin, end = max(first, 0), min(first + out, frames - 1)
    is_last = k == len(nodes) - 2
    values, squares, products, steps = sums[_VALUES], sums[_SQUARES], sums[_PRODUCTS], sums[_STEPS]
    for dof in range(dofs):
        values[dof], squares[dof], products[dof], steps[dof] = 0.0, 0.0, 0.0, 0.0
    previous = np.zeros(dofs)
    for frame in range(begin, end + 1):
        time = nodes[k] + (frame - first) * pace
        before = min(int(time), frames - 1)
        share = time - before
        here, after, reference = source[before], source[min(before + 1, frames - 1)], target[frame]
        # The frame of the next node belongs to the next segment, the step to it to this one.
        follows = 1.0 if frame > begin else 0.0
        belongs = 1.0 if frame < end or is_last else 0.0
        for dof in range(dofs):
            shown = here[dof] + share * (after[dof] - here[dof])
            step = follows * (shown - previous[dof])
            previous[dof] = shown
            steps[dof] += step * step
            values[dof] += belongs * shown
            squares[dof] += belongs * shown * shown
            products[dof] += belongs * shown * reference[dof]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _judged(
    sums: FloatArray,
    frames: int,
    shares: FloatArray,
    source_floor: FloatArray,
    inverse_target: FloatArray,
    slopes: FloatArray,
) -> tuple[float, float]:
    """Return rho and |h| from the sums of the segments."""
    dofs = sums.shape[2]
    values, squares, products, steps = np.zeros(dofs), np.zeros(dofs), np.zeros(dofs), np.zeros(dofs)
    for k in range(len(sums)):
        for dof in range(dofs):
            values[dof] += sums[k, _VALUES, dof]
            squares[dof] += sums[k, _SQUARES, dof]
            products[dof] += sums[k, _PRODUCTS, dof]
            steps[dof] += sums[k, _STEPS, dof]
    correlation = distortion = 0.0
    for dof in range(dofs):
        power = squares[dof] - values[dof] * values[dof] / frames
        varies = power > source_floor[dof] * frames
        rho = products[dof] * inverse_target[dof] / np.sqrt(power if varies else 1.0)
        correlation += shares[dof] * (rho if varies else 0.0)
        moves = slopes[dof] > 0.0
        stretch = np.sqrt(steps[dof]) / (slopes[dof] if moves else 1.0) - 1.0
        distortion += shares[dof] * (stretch if moves else 0.0)
    return correlation, abs(distortion)
