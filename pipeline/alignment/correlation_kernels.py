"""The compiled kernels of segments' correlations: see `motionary.pipeline.alignment.correlation_tables`.

Rows are frames and columns are DOFs throughout, so that every inner loop runs along the DOFs of a frame.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.alignment.matched import PLACES
from motionary.pipeline.motion import FloatArray

Integers = NDArray[np.int64]
_kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_kernel
def inverse_deviations(
    reference: FloatArray, frames: int, floor: FloatArray, least: int, most: int
) -> FloatArray:
    """Return 1 / norm of every centred window: [span - least, first frame, DOF], spans from least to most.

    A window of span n has n + 1 frames. One whose mean square is at most `floor` counts as constant, and is 0
    like the windows that would end after the last frame.
    """
    dofs = reference.shape[1]
    inverse = np.zeros((most - least + 1, frames, dofs))
    mean, squares = np.empty(dofs), np.empty(dofs)
    for first in range(frames):
        for dof in range(dofs):
            mean[dof] = reference[first, dof]
            squares[dof] = 0.0
        for span in range(1, min(most, frames - 1 - first) + 1):
            values, share = reference[first + span], 1.0 / (span + 1)
            for dof in range(dofs):  # Welford
                delta = values[dof] - mean[dof]
                mean[dof] += delta * share
                squares[dof] += delta * (values[dof] - mean[dof])
            if span >= least:
                row = inverse[span - least, first]
                for dof in range(dofs):
                    if squares[dof] > floor[dof] * (span + 1):
                        row[dof] = 1.0 / np.sqrt(squares[dof])
    return inverse


@_kernel
def fill_tables(
    source: FloatArray,
    reference: FloatArray,
    nodes: Integers,
    low: Integers,
    high: Integers,
    least_eta: Integers,
    most_eta: Integers,
    start: Integers,
    weights: FloatArray,
    source_floor: FloatArray,
    reference_floor: FloatArray,
    inverse: FloatArray,
    least: int,
    values: FloatArray,
) -> None:
    """Fill the tables of all segments, one after another: see `correlation_tables.TableLayout`."""
    frames = len(source)
    for k in range(len(nodes) - 1):
        _segment_table(
            source[nodes[k] : nodes[k + 1] + 1], reference, frames, weights, source_floor, reference_floor,
            inverse, least, (least_eta[k], most_eta[k]), (low[k], high[k]), (low[k + 1], high[k + 1]),
            values[start[k] : start[k + 1]],
        )  # fmt: skip


@_kernel
def sum_of_correlations(
    source: FloatArray,
    reference: FloatArray,
    nodes: Integers,
    moved: Integers,
    weights: FloatArray,
    source_floor: FloatArray,
    reference_floor: FloatArray,
) -> float:
    """Return the objective of the warp that brings the nodes to output frames `moved`."""
    frames, total = len(source), 0.0
    for k in range(len(nodes) - 1):
        stretched = np.empty((moved[k + 1] - moved[k] + 1, source.shape[1]))
        _stretch(source[nodes[k] : nodes[k + 1] + 1], stretched)
        total += _correlated(stretched, reference, frames, weights, source_floor, reference_floor, moved[k])
    return total


@_kernel
def _segment_table(
    segment: FloatArray,
    reference: FloatArray,
    frames: int,
    weights: FloatArray,
    segment_floor: FloatArray,
    reference_floor: FloatArray,
    inverse: FloatArray,
    least: int,
    etas: tuple[int, int],
    first: tuple[int, int],
    following: tuple[int, int],
    table: FloatArray,
) -> None:
    """Fill a segment's table: weighted correlations [eta - etas[0], output frame - first[0]].

    Parameters
    ----------
    segment : array (span + 1, dofs)
        The length-matched input between two nodes, both included.
    reference : array (frames + PLACES - 1, dofs)
    frames : int
        m.
    weights : array (dofs,)
    segment_floor, reference_floor : array (dofs,)
        Mean squares up to which a DOF counts as constant.
    inverse : array (spans, frames, dofs)
        From `inverse_deviations`, spans from `least` on.
    etas, first, following : tuple of int
        Least and greatest eta, and output frames of the segment's two nodes. Where a segment hangs over the
        reference's ends, what lies within is compared.
    table : array (etas * places,)
        Zeros; cells whose second node lies outside `following` stay so and are never read.
    """
    span, dofs, places = len(segment) - 1, segment.shape[1], first[1] - first[0] + 1
    stretched = np.empty((span + etas[1] + 1, dofs))
    sums, scale = np.empty((PLACES, dofs)), np.empty(dofs)
    for eta in range(etas[0], etas[1] + 1):
        out = span + eta
        low, high = max(first[0], following[0] - out), min(first[1], following[1] - out)
        if low > high:
            continue
        row = table[(eta - etas[0]) * places : (eta - etas[0] + 1) * places]
        _stretch(segment, stretched[: out + 1])
        inside_low, inside_high = max(low, 0), min(high, frames - 1 - out)
        for place in range(low, high + 1):
            if place < inside_low or place > inside_high:
                row[place - first[0]] = _correlated(
                    stretched[: out + 1], reference, frames, weights, segment_floor, reference_floor, place
                )
        _centre(stretched[: out + 1], segment_floor, scale)
        for dof in range(dofs):
            scale[dof] *= weights[dof]
        for start in range(inside_low, inside_high + 1, PLACES):
            _products(stretched[: out + 1], reference[start:], sums)
            for k in range(min(PLACES, inside_high + 1 - start)):
                row[start + k - first[0]] = _weighted(sums[k], scale, inverse[out - least, start + k])


@_kernel
def _stretch(segment: FloatArray, stretched: FloatArray) -> None:
    """Interpolate a segment to more or fewer frames."""
    length, span, dofs = len(segment) - 1, len(stretched) - 1, segment.shape[1]
    for j in range(span + 1):
        before, rest = divmod(j * length, max(span, 1))
        share = rest / max(span, 1)
        here, after = segment[before], segment[min(before + 1, length)]
        for dof in range(dofs):
            stretched[j, dof] = here[dof] + share * (after[dof] - here[dof])


@_kernel
def _centre(pattern: FloatArray, floor: FloatArray, scale: FloatArray) -> None:
    """Subtract the means; fill `scale` with 1 / norm, 0 where the pattern counts as constant."""
    frames, dofs = pattern.shape
    mean, squares = np.zeros(dofs), np.zeros(dofs)
    for j in range(frames):
        for dof in range(dofs):
            mean[dof] += pattern[j, dof]
    for dof in range(dofs):
        mean[dof] /= frames
    for j in range(frames):
        for dof in range(dofs):
            pattern[j, dof] -= mean[dof]
            squares[dof] += pattern[j, dof] * pattern[j, dof]
    for dof in range(dofs):
        constant = squares[dof] <= floor[dof] * frames
        scale[dof] = 0.0 if constant else 1.0 / np.sqrt(squares[dof])


@_kernel
def _correlated(
    stretched: FloatArray,
    reference: FloatArray,
    frames: int,
    weights: FloatArray,
    segment_floor: FloatArray,
    reference_floor: FloatArray,
    place: int,
) -> float:
    """Correlate what lies within the reference of a segment that may begin before it or end after it."""
    dofs = len(weights)
    begin, end = max(place, 0), min(place + len(stretched), frames)
    pattern, window = np.empty((end - begin, dofs)), np.empty((end - begin, dofs))
    for j in range(end - begin):
        for dof in range(dofs):
            pattern[j, dof] = stretched[begin - place + j, dof]
            window[j, dof] = reference[begin + j, dof]
    scale, window_scale, sums = np.empty(dofs), np.empty(dofs), np.zeros(dofs)
    _centre(pattern, segment_floor, scale)
    _centre(window, reference_floor, window_scale)
    for dof in range(dofs):
        scale[dof] *= weights[dof]
    for j in range(end - begin):
        for dof in range(dofs):
            sums[dof] += pattern[j, dof] * window[j, dof]
    return _weighted(sums, scale, window_scale)


@_kernel
def _products(pattern: FloatArray, reference: FloatArray, sums: FloatArray) -> None:
    """Fill sums[k, dof] with the inner product of the pattern and reference[k ..], PLACES at a time.

    Four frames of the pattern meet seven of the reference in sixteen products, so that what is loaded and
    stored of both is used four times; the order of the sum does not depend on the place.
    """
    frames, dofs = pattern.shape
    s0, s1, s2, s3 = sums[0], sums[1], sums[2], sums[3]
    for dof in range(dofs):
        s0[dof], s1[dof], s2[dof], s3[dof] = 0.0, 0.0, 0.0, 0.0
    whole = frames - frames % 4
    for j in range(0, whole, 4):
        p0, p1, p2, p3 = pattern[j], pattern[j + 1], pattern[j + 2], pattern[j + 3]
        r0, r1, r2, r3 = reference[j], reference[j + 1], reference[j + 2], reference[j + 3]
        r4, r5, r6 = reference[j + 4], reference[j + 5], reference[j + 6]
        for d in range(dofs):
            a, b, c, e = p0[d], p1[d], p2[d], p3[d]
            s0[d] += a * r0[d] + b * r1[d] + c * r2[d] + e * r3[d]
            s1[d] += a * r1[d] + b * r2[d] + c * r3[d] + e * r4[d]
            s2[d] += a * r2[d] + b * r3[d] + c * r4[d] + e * r5[d]
            s3[d] += a * r3[d] + b * r4[d] + c * r5[d] + e * r6[d]
    for j in range(whole, frames):
        last = pattern[j]
        r0, r1, r2, r3 = reference[j], reference[j + 1], reference[j + 2], reference[j + 3]
        for d in range(dofs):
            s0[d] += last[d] * r0[d]
            s1[d] += last[d] * r1[d]
            s2[d] += last[d] * r2[d]
            s3[d] += last[d] * r3[d]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _weighted(sums: FloatArray, scale: FloatArray, deviations: FloatArray) -> float:
    """Sum over DOFs; in the order that is quickest, one after another would take as long as the products."""
    total = 0.0
    for dof in range(len(sums)):
        total += sums[dof] * scale[dof] * deviations[dof]
    return total
