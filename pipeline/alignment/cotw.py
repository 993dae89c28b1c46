"""Correlation-optimized time warping [CoTW 3].

The moving sequence is length-matched to the reference's m frames (UTW) and cut into c = max(1, floor(m / L))
segments: nodes at 0, L, 2L, ..., (c - 1) L and m - 1, the last segment taking the residual. Segment k of
length l_k is stretched linearly to l_k + eta_k, |eta_k| <= slack, sum eta = 0, so that the first and the last
frame stay, and

    J(k, s, eta) = sum over DOFs i of w_i rho(stretched segment k, reference frames s .. s + l_k + eta)

is Pearson's correlation (eq. 3 and 5) on the segment's output frames, both end nodes included. Table 1's
backward recurrence over the place s of each node in output time finds the exact maximum of their sum:

    F_c(m - 1) = 0,    F_k(s) = max over eta of  J(k, s, eta) + F_(k+1)(s + l_k + eta)

Where we differ from the paper:

- Table 1's loop bounds are wrong as printed. Node k, k segments from the first frame and c - k from the last,
  reaches exactly k L - r .. k L + r with r = slack min(k, c - k).
- A DOF that does not vary on a segment, in either sequence, counts 0; the paper leaves it undefined (6.5).
  Not varying means a standard deviation of at most what rounding leaves: see `rounding_level`.
- Ties go to the least |eta|, the shorter segment first, in order of the segments. Sums that differ by less
  than 1e-12 of the weights' sum are ties, so that rounding alone never bends time.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import index

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import Warp, checked_sequence, interpolate
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray

_LEAST_LENGTH = 4  # the least stretched segment: slack <= L - 4 [CoTW 4]
_TIE = 1e-12


@dataclass(frozen=True, eq=False)
class CotwWarp(Warp):
    """A warp and how correlation-optimized time warping came to it.

    Parameters
    ----------
    objective : float
        Sum over segments and DOFs of weighted correlations, on the length-matched sequence.
    eta : array (segments,) int64
        By how many frames each segment was stretched; they sum to 0.
    segment_length : int
        L, frames of the reference.
    slack : int
        The most that a segment may be stretched or shortened, frames.
    """

    objective: float
    eta: NDArray[np.int64]
    segment_length: int
    slack: int


def cotw(
    moving: FloatArray,
    reference: FloatArray,
    segment_length: int,
    slack: int,
    weights: FloatArray | None = None,
) -> CotwWarp:
    """Warp one sequence so that its segments correlate best with the reference's [CoTW 3].

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    segment_length : int
        L, frames of the reference, 4 .. m. Above m / 2 there is one segment, and the warp is `uniform`.
        A reference of fewer than 4 frames has L = m.
    slack : int
        0 .. L - 4 frames; 0 where L < 4.
    weights : array (dofs,), optional
        Not negative; 1 each by default.

    Returns
    -------
    CotwWarp
        The exact optimum, with `.objective` and `.eta`.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, or a parameter is out of its range.
    """
    moving, reference = checked_sequence(moving, "moving"), checked_sequence(reference, "reference")
    if moving.shape[1] != reference.shape[1]:
        raise ValueError(
            f"moving has {moving.shape[1]} DOFs and reference {reference.shape[1]}; they must have the same"
        )
    weights = checked_weights(weights, reference.shape[1])
    frames = len(reference)
    segment_length, slack = _checked_parameters(segment_length, slack, frames)
    nodes = segment_nodes(frames, segment_length)
    tables = correlation_tables(moving, reference, nodes, slack, weights)
    objective, eta = best_stretches(tables, slack, _TIE * float(weights.sum()))
    return CotwWarp(
        source_time=composed_times(nodes, eta, len(moving)),
        moving_frames=len(moving),
        objective=objective,
        eta=eta,
        segment_length=segment_length,
        slack=slack,
    )


def default_parameters(reference_frames: int) -> tuple[int, int]:
    """Return the segment length and slack taken where none are given.

    Parameters
    ----------
    reference_frames : int
        m.

    Returns
    -------
    segment_length, slack : int
        L = m / 4 (rounded, halves to even), between 8 and floor(m / 2); slack = L - 4, the most the method
        allows. Below 10 frames, where halves would leave no slack, a single segment of all m frames.
    """
    half = reference_frames // 2
    length = min(max(round(reference_frames / 4), 8), half) if half > _LEAST_LENGTH else reference_frames
    return length, max(length - _LEAST_LENGTH, 0)


def segment_nodes(frames: int, segment_length: int) -> NDArray[np.int64]:
    """Return the segments' ends in length-matched time (c + 1,): 0, L, ..., (c - 1) L, m - 1."""
    segments = max(1, frames // segment_length)
    return np.append(np.arange(segments) * segment_length, frames - 1)


def correlation_tables(
    moving: FloatArray,
    reference: FloatArray,
    nodes: NDArray[np.int64],
    slack: int,
    weights: FloatArray,
) -> list[FloatArray]:
    """Compute J for every segment, stretch and output place that a warp within `slack` can reach.

    Parameters
    ----------
    moving : array (n, dofs)
    reference : array (m, dofs)
    nodes : array (c + 1,)
        From `segment_nodes`.
    slack : int
        The largest that `best_stretches` will be asked for.
    weights : array (dofs,)

    Returns
    -------
    list of c arrays (2 slack + 1, 2 r_k + 1)
        Row: eta + slack. Column: the segment's first output frame, from nodes[k] - r_k on. Cells that no warp
        reaches are 0 and never read. A cell's bits do not depend on `slack`.
    """
    moving_floor, reference_floor = rounding_level(moving) ** 2, rounding_level(reference) ** 2
    matched = interpolate(moving.astype(np.float64), uniform_times(len(moving), len(reference)))
    source = np.ascontiguousarray((matched - matched.mean(axis=0)).T)
    target = np.ascontiguousarray((reference - reference.mean(axis=0, dtype=np.float64)).T)
    radii = _node_radii(len(nodes) - 1, slack)
    return [
        _segment_table(
            source[:, nodes[k] : nodes[k + 1] + 1], target, weights, moving_floor, reference_floor,
            slack, nodes[k], radii[k], radii[k + 1],
        )
        for k in range(len(nodes) - 1)
    ]  # fmt: skip


def best_stretches(tables: list[FloatArray], slack: int, tie: float) -> tuple[float, NDArray[np.int64]]:
    """Run Table 1's dynamic programme over the correlations.

    Parameters
    ----------
    tables : list of c arrays
        From `correlation_tables`, for this slack or a larger one.
    slack : int
        Bound of |eta|.
    tie : float
        Objectives that differ by no more count as equal.

    Returns
    -------
    objective : float
    eta : array (c,) int64
    """
    segments = len(tables)
    radii = _node_radii(segments, slack)
    best: FloatArray = np.zeros(1)
    choices = []
    for k in reversed(range(segments)):
        best, choice = _best_step(tables[k], best, slack, radii[k], radii[k + 1], tie)
        choices.append(choice)
    eta = np.zeros(segments, dtype=np.int64)
    moved = 0
    for k, choice in enumerate(reversed(choices)):
        eta[k] = choice[moved + radii[k]]
        moved += eta[k]
    return float(best[0]), eta


def composed_times(nodes: NDArray[np.int64], eta: NDArray[np.int64], moving_frames: int) -> FloatArray:
    """Return the original moving time at each reference frame (m,): segment-wise warp, then length match."""
    frames = nodes[-1] + 1
    moved = nodes + np.append(0, np.cumsum(eta))
    matched_time = np.interp(np.arange(frames), moved, nodes)
    return matched_time * (moving_frames - 1) / max(frames - 1, 1)


def rounding_level(values: FloatArray) -> FloatArray:
    """Return the standard deviation up to which a DOF counts as constant (dofs,).

    That is four roundings of its largest value in the dtype given (float32 features are coarser than their
    arithmetic), and at least 1e-12 of the largest value of all: a joint that lies on an axis keeps noise
    from the arithmetic of the whole body, which is large beside its own size.

    Parameters
    ----------
    values : array (..., dofs)
        In the dtype in which they were made.
    """
    dtype = values.dtype if np.issubdtype(values.dtype, np.floating) else np.float64
    largest = np.abs(values).reshape(-1, values.shape[-1]).max(axis=0).astype(np.float64)
    return np.maximum(4 * float(np.finfo(dtype).eps) * largest, 1e-12 * largest.max())


def _checked_parameters(segment_length: int, slack: int, frames: int) -> tuple[int, int]:
    segment_length, slack = index(segment_length), index(slack)
    least = min(_LEAST_LENGTH, frames)
    if not least <= segment_length <= frames:
        raise ValueError(
            f"segment_length is {segment_length}; for a reference of {frames} frames "
            f"it must lie in {least} .. {frames}"
        )
    most = max(segment_length - _LEAST_LENGTH, 0)
    if not 0 <= slack <= most:
        raise ValueError(
            f"slack is {slack} and segment_length {segment_length}; "
            f"slack must lie in 0 .. segment_length - {_LEAST_LENGTH} = {most}"
        )
    return segment_length, slack


def _node_radii(segments: int, slack: int) -> list[int]:
    return [slack * min(k, segments - k) for k in range(segments + 1)]


@njit(cache=True, nogil=True)
def _segment_table(  # noqa: PLR0917
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
            powers[j - least, :within] = squares[:within]


@njit(cache=True, nogil=True)
def _slide(pattern: FloatArray, signal: FloatArray, products: FloatArray) -> None:
    """Fill products[s] with the inner product of the pattern and signal[s ..], in one order for every s."""
    products[:] = 0.0
    for j in range(len(pattern)):
        for s in range(len(products)):
            products[s] += pattern[j] * signal[s + j]


@njit(cache=True, nogil=True)
def _best_step(  # noqa: PLR0917
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
