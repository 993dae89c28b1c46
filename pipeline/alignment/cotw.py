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

- Table 1's loop bounds are wrong as printed: see `nodes.stretchable`.
- A DOF that does not vary on a segment, in either sequence, counts 0; the paper leaves it undefined (6.5).
  Not varying means a standard deviation of at most what rounding leaves: see `rounding_level`.
- Two of its limits are lifted where asked for. Nodes may lie unequally (`nodes.boundary_nodes`). With
  `open_ends` the first node may come to lie up to `slack` frames before the output and the last as far after
  it: then the reference's ends meet other frames of the input. Of a segment that hangs over, what lies within
  is compared, at least 4 frames from end to end (of the last 3, as its length may be); sum eta is how far the
  last node was moved less the first.
- Ties go to the least |eta|, the shorter segment first, in order of the segments. Sums that differ by less
  than 1e-12 of the weights' sum are ties, so that rounding alone never bends time.
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import index

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.correlation_tables import CorrelationTables, correlation_tables
from motionary.pipeline.alignment.matched import MatchedPair, matched_pair
from motionary.pipeline.alignment.nodes import (
    LEAST_LENGTH,
    Segments,
    boundary_nodes,
    equal_nodes,
    stretchable,
)
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.whole_output import WholeOutput
from motionary.pipeline.config import Spacing
from motionary.pipeline.motion import FloatArray

_TIE = 1e-12


@dataclass(frozen=True, eq=False)
class CotwWarp(Warp):
    """A warp and how correlation-optimized time warping came to it.

    Parameters
    ----------
    objective : float
        Sum over segments and DOFs of weighted correlations, on the length-matched sequence.
    eta : array (segments,) int64
        By how many frames each segment was stretched. They sum to 0 unless the ends are open.
    nodes : array (segments + 1,) int64
        The segments' ends in length-matched time, frames of the reference.
    first_frame : int
        Output frame of the first node: 0, or less where the ends are open.
    segment_length : int
        L, frames of the reference.
    slack : int
        The most that a segment may be stretched or shortened, frames.
    correlation : float
        rho: weighted mean over DOFs of the correlation of the whole output with the reference, on the
        length-matched sequence; see `whole_output`.
    distortion : float
        |h|: the absolute value of the weighted mean over DOFs of eq. 7.
    """

    objective: float
    eta: NDArray[np.int64]
    nodes: NDArray[np.int64]
    first_frame: int
    segment_length: int
    slack: int
    correlation: float
    distortion: float


def cotw(
    moving: FloatArray,
    reference: FloatArray,
    segment_length: int | None = None,
    slack: int | None = None,
    weights: FloatArray | None = None,
    *,
    segments: int | None = None,
    spacing: Spacing = "equal",
    open_ends: bool = False,
) -> CotwWarp:
    """Warp one sequence so that its segments correlate best with the reference's [CoTW 3].

    Either `segment_length` or `segments` is needed; `cotw_search` finds both length and slack.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    segment_length : int, optional
        L, frames of the reference, 4 .. m; the length of a stride, for example [CoTW 6.2]. Above m / 2 there
        is one segment, and the warp is `uniform`. A reference of fewer than 4 frames has L = m.
    slack : int, optional
        0 .. L - 4 frames; 0 where L < 4. By default the most, which is always safe [CoTW 4].
    weights : array (dofs,), optional
        Not negative, not all 0; 1 each by default.
    segments : int, optional
        The number of segments instead of their length, such as the number of actions shown [CoTW 4]: then
        L = floor(m / segments), and the last takes the residual.
    spacing : {"equal", "boundaries"}
        Nodes every L frames, or each where the reference pauses nearby: see `nodes.boundary_nodes`.
    open_ends : bool
        Whether the reference's first and last frame may meet other frames than the input's.

    Returns
    -------
    CotwWarp
        The exact optimum, with `.objective` and `.eta`.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, all weights are 0, or a parameter is out of its range.
    """
    pair = matched_pair(moving, reference, weights)
    whole = WholeOutput(pair)
    length, count = _length_and_count(segment_length, segments, pair.frames)
    most = _checked_slack(slack, length)
    nodes = placed_nodes(pair, length, count, spacing)
    stretched = stretchable(nodes, most, open_ends)
    moved = best_moves(correlation_tables(pair, stretched), stretched, pair.total_weight)
    return warp_of(pair, whole, nodes, moved, length, most)


def check_spacing(spacing: str) -> None:
    """Raise ValueError where there is no such spacing."""
    if spacing not in ("equal", "boundaries"):
        raise ValueError(f"spacing is {spacing!r}; it must be 'equal' or 'boundaries'")


def placed_nodes(
    pair: MatchedPair, segment_length: int, segments: int, spacing: Spacing
) -> NDArray[np.int64]:
    """Return the nodes (segments + 1,) of a pair.

    Raises
    ------
    ValueError
        There is no such spacing.
    """
    check_spacing(spacing)
    nodes = equal_nodes(pair.frames, segment_length)[: segments + 1]
    nodes[-1] = pair.frames - 1
    if spacing == "boundaries":
        return boundary_nodes(pair.target[: pair.frames], nodes, pair.weights)
    return nodes


def best_moves(tables: CorrelationTables, segments: Segments, total_weight: float) -> NDArray[np.int64]:
    """Run Table 1's dynamic programme over the correlations.

    Parameters
    ----------
    tables : CorrelationTables
        Of these segments, or of the same with larger slacks and ranges.
    segments : Segments
    total_weight : float
        The weights' sum, by which ties are judged.

    Returns
    -------
    array (c + 1,) int64
        The output frame of every node.
    """
    from motionary.pipeline.alignment.cotw_kernels import best_path

    layout, moved = tables.layout, np.empty(len(segments.nodes), dtype=np.int64)
    best_path(
        tables.values, layout.start, layout.least_eta, layout.most_eta, layout.first, layout.places,
        segments.nodes, segments.slacks, segments.low, segments.high, _TIE * total_weight, moved,
    )  # fmt: skip
    return moved


def warp_of(
    pair: MatchedPair,
    whole: WholeOutput,
    nodes: NDArray[np.int64],
    moved: NDArray[np.int64],
    segment_length: int,
    slack: int,
) -> CotwWarp:
    """Return the warp that brings the nodes to output frames `moved`; its times are the original's."""
    from motionary.pipeline.alignment.correlation_kernels import sum_of_correlations

    correlation, distortion = whole(nodes, moved)
    times = np.interp(np.arange(pair.frames), moved, nodes)
    return CotwWarp(
        source_time=times * (pair.moving_frames - 1) / max(pair.frames - 1, 1),
        moving_frames=pair.moving_frames,
        objective=sum_of_correlations(
            pair.source, pair.target, nodes, moved, pair.weights, pair.source_floor, pair.target_floor
        ),
        eta=np.diff(moved) - np.diff(nodes),
        nodes=nodes,
        first_frame=int(moved[0]),
        segment_length=segment_length,
        slack=slack,
        correlation=correlation,
        distortion=distortion,
    )


def _length_and_count(segment_length: int | None, segments: int | None, frames: int) -> tuple[int, int]:
    """Return L and the number of segments.

    Raises
    ------
    ValueError
        Both or neither are given, or one is out of its range.
    """
    if (segment_length is None) == (segments is None):
        raise ValueError("give segment_length or segments, one of them")
    least = min(LEAST_LENGTH, frames)
    if segments is not None:
        count = index(segments)
        if not 1 <= count <= max(1, frames // least):
            raise ValueError(
                f"segments is {count}; a reference of {frames} frames has 1 .. {max(1, frames // least)} "
                f"segments of at least {least} frames"
            )
        return frames // count, count
    length = index(segment_length)  # type: ignore[arg-type]
    if not least <= length <= frames:
        raise ValueError(
            f"segment_length is {length}; for a reference of {frames} frames "
            f"it must lie in {least} .. {frames}"
        )
    return length, max(1, frames // length)


def _checked_slack(slack: int | None, segment_length: int) -> int:
    most = max(segment_length - LEAST_LENGTH, 0)
    if slack is None:
        return most
    if not 0 <= index(slack) <= most:
        raise ValueError(
            f"slack is {slack} and segment_length {segment_length}; "
            f"slack must lie in 0 .. segment_length - {LEAST_LENGTH} = {most}"
        )
    return index(slack)
