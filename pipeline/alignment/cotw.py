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
from numpy.typing import NDArray

from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.alignment.warp import Warp, checked_sequence, interpolate
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray

_LEAST_LENGTH = 4  # the least stretched segment: slack <= L - 4 [CoTW 4]
_MOST_DEFAULT_SLACK = 60  # two seconds at 30 frames a second
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


def default_parameters(reference_frames: int, segment_length: int | None = None) -> tuple[int, int]:
    """Return the segment length and slack taken where none are given.

    Parameters
    ----------
    reference_frames : int
        m.
    segment_length : int, optional
        L where that is given; of more than m frames there are m.

    Returns
    -------
    segment_length, slack : int
        L = m / 4 (rounded, halves to even), between 8 and floor(m / 2); slack = L - 4, the most the method
        allows, but at most 60 frames, so that the time it takes grows with m and not with its cube. Below 10
        frames, where halves would leave no slack, a single segment of all m frames.
    """
    half = reference_frames // 2
    if segment_length is not None:
        length = min(segment_length, reference_frames)
    elif half > _LEAST_LENGTH:
        length = min(max(round(reference_frames / 4), 8), half)
    else:
        length = reference_frames
    return length, min(max(length - _LEAST_LENGTH, 0), _MOST_DEFAULT_SLACK)


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
    from motionary.pipeline.alignment.cotw_kernels import segment_table

    moving_floor, reference_floor = rounding_level(moving) ** 2, rounding_level(reference) ** 2
    matched = interpolate(moving.astype(np.float64), uniform_times(len(moving), len(reference)))
    source = np.ascontiguousarray((matched - matched.mean(axis=0)).T)
    target = np.ascontiguousarray((reference - reference.mean(axis=0, dtype=np.float64)).T)
    radii = _node_radii(len(nodes) - 1, slack)
    return [
        segment_table(
            np.ascontiguousarray(source[:, nodes[k] : nodes[k + 1] + 1]), target, weights,
            moving_floor, reference_floor, slack, nodes[k], radii[k], radii[k + 1],
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
    from motionary.pipeline.alignment.cotw_kernels import best_step

    segments = len(tables)
    radii = _node_radii(segments, slack)
    best: FloatArray = np.zeros(1)
    choices = []
    for k in reversed(range(segments)):
        best, choice = best_step(tables[k], best, slack, radii[k], radii[k + 1], tie)
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
