"""Proven lower bounds on the weighted distance of two clips, for pairs that need only be known to be far.

    weighted = sum over lambda of w S(lambda),    w = 0.1 W(lambda), S the S-DTW                    (eq. 7-8)

Three bounds, each cheaper than the next and weaker. D is the cost matrix, `low` its least cost.

1. *Boxes*, without D. Every zone weighs an average of costs, so at least `low`, and every cover has a zone:
   S(lambda) >= low, weighted >= low * sum of w. Each clip is cut into runs of consecutive frames; a run lies
   in its axis-aligned box in a few orthonormal coordinates. Projection lengthens no difference of frames, and
   the nearest points of two boxes are at least as near as any two frames inside: the least distance of a box
   of one clip to a box of the other is at most `low`. First one box a clip, then the runs'.
2. *Least cost*: weighted >= low * sum of w, with `low` of D itself.
3. *Profile*, of D. Let R_i be the least cost of row i. Row i has a kept cell at lambda just when
   R_i <= delta(lambda). No zone spans a row without a kept cell, since no region is connected across it; so
   the longest stretches of neighbouring rows with R_i <= delta hold whole zones, and at least one each. Every
   cover has a zone in every stretch, for it touches every row segment; all costs of that zone, and so its
   average, are at least the least R_i of the stretch. Therefore

       S(lambda) >= P(lambda) = sum over stretches of the least R_i in it,

   and the same holds of columns; the larger of both counts. One stretch gives bound 2 again.

Rounding. Weights of zones are whole quanta: a path's mean is the rounded mean of rounded costs
(`fixed_point.py`), and rounding keeps order, so a mean of costs that are all at least x is at least x rounded
to quanta. Bounds 2 and 3 are kept in these quanta, where they hold exactly, and pass through the same sum in
the same order as the curve does: each operation of floats keeps order too, so what comes out is not above the
weighted distance, to the last bit, and not either once both are rounded to float32. No margin is needed.

Bound 1 meets the rounding of projections, boxes and costs, and needs one: see `box_limit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from motionary.pipeline.distances.fixed_point import UNREACHED
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.lanes import LANES, _call, _in_every_place, _lane_type, _load, padded
from motionary.pipeline.motion import FloatArray

# Frames a box, and coordinates that it has at most: longer runs refuse fewer pairs, more coordinates hardly
# any more.
RUN, COORDINATES = 2, 16
# Frames that the axes are found from, at most.
FRAMES = 1024


class Axes(NamedTuple):
    """Coordinates in which clips are boxed.

    Parameters
    ----------
    origin : array (d,)
        Subtracted from every frame.
    directions : array (d, k)
        Orthonormal columns up to rounding, those of greatest variance first.
    stretch : float
        No difference of frames grows by more than this factor, which is 1 but for rounding.
    """

    origin: NDArray[np.float64]
    directions: NDArray[np.float64]
    stretch: float


class Boxes(NamedTuple):
    """Axis-aligned boxes, as rows and as lanes; what fills up lanes are copies of the last box.

    Parameters
    ----------
    low, high : array (boxes, k)
        Ends of every box.
    low_lanes, high_lanes : array (blocks, k, LANES)
        The same, transposed.
    """

    low: FloatArray
    high: FloatArray
    low_lanes: FloatArray
    high_lanes: FloatArray


class BoxedClips(NamedTuple):
    """One box a clip (`whole`), and boxes of its runs (`runs`).

    Parameters
    ----------
    whole, runs : Boxes
        The runs of one clip after another's; each clip fills whole blocks of lanes.
    run_start, block_start : array (clips + 1,)
        Where each clip begins in the rows and in the blocks of `runs`.
    """

    whole: Boxes
    runs: Boxes
    run_start: NDArray[np.int64]
    block_start: NDArray[np.int64]


def principal_axes(clips: Sequence[FloatArray]) -> Axes:
    """Return the axes of greatest variance of some frames; other axes bound as truly, but less sharply."""
    frames = np.concatenate(clips)
    frames = frames[:: -(-len(frames) // FRAMES)].astype(np.float64)
    # Squares of the largest values that clips may hold would overflow.
    frames /= np.abs(frames).max() or 1.0
    _, directions = np.linalg.eigh(np.atleast_2d(np.cov(frames.T, bias=True)))
    directions = np.ascontiguousarray(directions[:, ::-1][:, :COORDINATES])
    count = directions.shape[1]
    # |V x|^2 <= (1 + |V'V - I|) |x|^2 in the spectral norm; the Frobenius norm is not below it.
    skew = np.linalg.norm(directions.T @ directions - np.eye(count)) + count * len(directions) * 2.0**-51
    return Axes(clips[0].mean(axis=0, dtype=np.float64), directions, float(np.sqrt(1.0 + skew)))


def boxed_clips(clips: Sequence[FloatArray], axes: Axes) -> BoxedClips:
    """Box clips (frames, d) of one dtype; the boxes have it too, rounded outwards."""
    frames = np.array([len(clip) for clip in clips])
    runs = -(-frames // RUN)
    run_start, block_start = (np.concatenate([[0], np.cumsum(n)]) for n in (runs, -(-runs // LANES)))
    placed = (np.concatenate(clips) - axes.origin) @ axes.directions
    clip_start = np.concatenate([[0], np.cumsum(frames)])
    within = np.arange(run_start[-1]) - np.repeat(run_start[:-1], runs)
    starts = np.repeat(clip_start[:-1], runs) + within * RUN
    place = np.repeat(np.arange(len(clips)), -(-runs // LANES))
    lane = (np.arange(block_start[-1]) - block_start[place])[:, None] * LANES + np.arange(LANES)
    of_lane = run_start[place][:, None] + np.minimum(lane, runs[place][:, None] - 1)
    every = np.minimum(np.arange(padded(len(clips), LANES)), len(clips) - 1).reshape(-1, LANES)
    dtype = clips[0].dtype
    return BoxedClips(
        _boxes(placed, clip_start[:-1], every, dtype),
        _boxes(placed, starts, of_lane, dtype),
        run_start,
        block_start,
    )


def _boxes(
    placed: NDArray[np.float64], starts: NDArray[np.int64], of_lane: NDArray[np.int64], dtype: np.dtype
) -> Boxes:
    low = np.minimum.reduceat(placed, starts, axis=0).astype(dtype)
    high = np.maximum.reduceat(placed, starts, axis=0).astype(dtype)
    low, high = np.nextafter(low, dtype.type(-np.inf)), np.nextafter(high, dtype.type(np.inf))
    lanes = (np.ascontiguousarray(side[of_lane].transpose(0, 2, 1)) for side in (low, high))
    return Boxes(low, high, *lanes)


def box_limit(least: float, weights: NDArray[np.float64], clips: Sequence[FloatArray], axes: Axes) -> float:
    """Return the box distance above which the weighted distance of two clips is at least `least`.

    u is the unit of rounding of the clips' dtype, d their dimension, G the greatest |frame - origin|. True
    distances are at most `stretch` times shorter than in the axes.

    - A projected coordinate is off by at most 2 (d + 2) 2^-53 G `stretch`, and there are at most d; boxes are
      rounded outwards. Gaps and their squares lose or gain at most a factor (1 + u)^(d + 3).
    - A computed cost is at least the true distance times (1 - u)^(d + 2): of every squared difference, of
      every fused addition, of the root. Underflow takes at most sqrt(2 d s), s the least subnormal number.
    - A zone's mean is at least `low` less half a quantum, and a quantum is at most 2^(1 - value_bits) of the
      greatest cost, or 2^-960 (`fixed_point.py`); the greatest cost is at most 2 G.
    - The sum over lambda of T terms rounds by at most a factor (1 - 2^-53)^(2 T + 2).

    All factors are within 1 +- 4 (d + T + 8) u of 1.
    """
    dtype, (_, d) = clips[0].dtype, clips[0].shape
    limits = np.finfo(dtype)
    greatest = max(float(np.abs(clip - axes.origin).max()) for clip in clips) * np.sqrt(d)
    longest = max(len(clip) for clip in clips)
    value_bits = min(52, 62 - 2 * int(2 * longest).bit_length())
    quantum = 2.0 ** (1 - value_bits) * 2.0 * greatest + 2.0**-960
    projected = 8.0 * d * (d + 2) * 2.0**-53 * greatest
    underflow = 2.0 * np.sqrt(2.0 * d * float(limits.smallest_subnormal))
    factor = 1.0 + 4.0 * (d + len(weights) + 8) * float(limits.eps)
    total = float(weights.sum())
    if total == 0.0:
        return np.inf
    return (least / total + quantum + projected + underflow) * axes.stretch * factor


def _near_boxes(
    typingctx: Any, low: Any, high: Any, row: Any, low_lanes: Any, high_lanes: Any, block: Any, limit: Any
) -> Any:
    """Compare a box with the LANES boxes of a block: bit k is set where box k is near.

    Near is what lies at most `limit` away, both squared; the gaps are added in the order of the coordinates.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        low, high, low_lanes, high_lanes = (
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args, arguments, strict=True)
            if isinstance(kind, types.Array)
        )
        row, block, limit = arguments[2], arguments[5], arguments[6]
        depth = cgutils.unpack_tuple(builder, low.shape)[1]
        lane = _lane_type(context, signature.args[0])
        zero = lane([0.0] * LANES)
        total = cgutils.alloca_once(builder, lane)
        builder.store(zero, total)
        with cgutils.for_range(builder, depth) as loop:
            here = builder.add(builder.mul(row, depth), loop.index)
            there = builder.mul(builder.add(builder.mul(block, depth), loop.index), row.type(LANES))
            below, above = (
                _in_every_place(builder, builder.load(builder.gep(side.data, [here])), lane)
                for side in (low, high)
            )
            over = builder.fsub(_load(builder, low_lanes, there, lane), above)
            under = builder.fsub(below, _load(builder, high_lanes, there, lane))
            gap = builder.select(builder.fcmp_ordered(">", over, under), over, under)
            gap = builder.select(builder.fcmp_ordered(">", gap, zero), gap, zero)
            builder.store(_call(builder, "fma", lane, [gap, gap, builder.load(total)]), total)
        near = builder.fcmp_unordered("<=", builder.load(total), _in_every_place(builder, limit, lane))
        return builder.zext(builder.bitcast(near, ir.IntType(LANES)), ir.IntType(64))

    return types.uint64(low, high, types.intp, low_lanes, high_lanes, types.intp, low.dtype), generate


near_boxes: Any = intrinsic(_near_boxes)


@kernel
def runs_apart(a, p, b, q, limit):  # type: ignore[no-untyped-def]
    """Say whether the squared distances of all runs of clip p to all of clip q are above `limit`."""
    runs, others = a.runs, b.runs
    for block in range(b.block_start[q], b.block_start[q + 1]):
        for row in range(a.run_start[p], a.run_start[p + 1]):
            if near_boxes(runs.low, runs.high, row, others.low_lanes, others.high_lanes, block, limit):
                return False
    return True


@kernel
def fill_profile(costs, m, n, profile):  # type: ignore[no-untyped-def]
    """Fill `profile` with the least cost of each of the m rows, then of each of the n columns.

    `costs` (rows, width) are filled up by copies, which change no least cost.
    """
    for j in range(n):
        profile[m + j] = costs[0, j]
    for i in range(m):
        least = costs[i, 0]
        for j in range(n):
            least = min(least, costs[i, j])
            profile[m + j] = min(profile[m + j], costs[i, j])
        profile[i] = least


@kernel
def stretches(profile, quanta, begin, end, limit):  # type: ignore[no-untyped-def]
    """P of rows, or of columns: the sum over stretches of entries at most `limit` of the least, in quanta.

    Written without branches, which no processor could foretell.
    """
    total, least = np.int64(0), np.int64(UNREACHED)
    for i in range(begin, end):
        inside = profile[i] <= limit
        total += np.int64(0) if inside or least == UNREACHED else least
        least = min(least, quanta[i]) if inside else np.int64(UNREACHED)
    return total + (np.int64(0) if least == UNREACHED else least)
