"""The compiled kernels of correlation-optimized time warping: see `motionary.pipeline.alignment.cotw`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray


@njit(cache=True, nogil=True)
def segment_table(
    segment: FloatArray,
    reference: FloatArray,
    weights: FloatArray,
    segment_floor: FloatArray,
    reference_floor: FloatArray,
    slack: int,
    start: int,
    radius: int,
    next_radius: int,
) -> FloatArray:
    """Fill a segment's table: weighted correlations [eta + slack, start of the output + radius].

    Parameters
    ----------
    segment : array (dofs, nodes)
        The length-matched input between two nodes, both included.
    reference : array (dofs, frames)
    weights : array (dofs,)
    segment_floor, reference_floor : array (dofs,)
        Mean squares up to which a DOF counts as constant.
    slack : int
        The most that the segment may be stretched or shortened.
    start : int
        Where the segment's first node lies in the input.
    radius, next_radius : int
        How far its two nodes may move in the output.
    """
    dofs, nodes = segment.shape
    length = nodes - 1
    table = np.zeros((2 * slack + 1, 2 * radius + 1))
    powers = np.zeros((2 * slack + 1, 2 * radius + 1))
    products = np.empty(2 * radius + 1)
    stretched = np.empty(length + slack + 1)
    for dof in range(dofs):
        if weights[dof] == 0.0:
            continue
        signal = reference[dof, start - radius :]
        _window_powers(signal, length - slack, powers)
        for row in range(2 * slack + 1):
            eta = row - slack
            first = max(0, radius - next_radius - eta)
            last = min(2 * radius, radius + next_radius - eta)
            frames = length + eta + 1
            if first > last:
                continue
            power = _stretch(segment[dof], stretched[:frames])
            if power <= segment_floor[dof] * frames:
                continue
            _slide(stretched[:frames], signal[first:], products[: last - first + 1])
            for place in range(first, last + 1):
                if powers[row, place] > reference_floor[dof] * frames:
                    rho = products[place - first] / np.sqrt(power * powers[row, place])
                    table[row, place] += weights[dof] * rho
    return table


@njit(cache=True, nogil=True)
def _stretch(segment: FloatArray, stretched: FloatArray) -> float:
    """Interpolate a segment to more or fewer frames, centre it, and return its sum of squares."""
    length, span = len(segment) - 1, len(stretched) - 1
    total = 0.0
    for j in range(span + 1):
        before, rest = divmod(j * length, max(span, 1))
        value = segment[before]
        if rest:
            value += (rest / span) * (segment[before + 1] - value)
        stretched[j] = value
        total += value
    mean = total / (span + 1)
    power = 0.0
    for j in range(span + 1):
        stretched[j] -= mean
        power += stretched[j] * stretched[j]
    return power


@njit(cache=True, nogil=True)
def _window_powers(signal: FloatArray, least: int, powers: FloatArray) -> None:
    """Fill powers[q, s] with the centred sum of squares of signal[s .. s + least + q] (Welford)."""
    rows, places = powers.shape
    mean = signal[:places].copy()
    squares = np.zeros(places)
    for j in range(1, min(least + rows, len(signal))):
        within = min(places, len(signal) - j)
        for s in range(within):
            delta = signal[s + j] - mean[s]
            mean[s] += delta / (j + 1)
            squares[s] += delta * (signal[s + j] - mean[s])
        if j >= least:
            for s in range(within):
                powers[j - least, s] = squares[s]


@njit(cache=True, nogil=True)
def _slide(pattern: FloatArray, signal: FloatArray, products: FloatArray) -> None:
    """Fill products[s] with the inner product of the pattern and signal[s ..], in one order for every s."""
    products[:] = 0.0
    for j in range(len(pattern)):
        for s in range(len(products)):
            products[s] += pattern[j] * signal[s + j]


@njit(cache=True, nogil=True)
def best_step(
    table: FloatArray, following: FloatArray, slack: int, radius: int, next_radius: int, tie: float
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Take one step of the recurrence back: F_k from F_(k+1), and the eta of each place."""
    table_slack, table_radius = (table.shape[0] - 1) // 2, (table.shape[1] - 1) // 2
    best = np.full(2 * radius + 1, -np.inf)
    choice = np.zeros(2 * radius + 1, dtype=np.int64)
    for place in range(-radius, radius + 1):
        for turn in range(2 * slack + 1):
            # 0, -1, 1, -2, 2, ...: the first of equals is the least stretch
            eta = -(turn + 1) // 2 if turn % 2 else turn // 2
            end = place + eta
            if abs(end) > next_radius:
                continue
            value = table[eta + table_slack, place + table_radius] + following[end + next_radius]
            if best[place + radius] == -np.inf or value > best[place + radius] + tie:
                best[place + radius] = value
                choice[place + radius] = eta
    return best, choice
