"""DTW and B-DTW of all pairs, without the curve [DC 3, eq. 1]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from motionary.pipeline.distances.cost import PackedClips
from motionary.pipeline.distances.fixed_point import mean_quanta, pack
from motionary.pipeline.distances.kernel import kernel
from motionary.pipeline.distances.recurrence import both_ways, forward
from motionary.pipeline.distances.tiles import (
    comparable_clips,
    compare_all,
    largest_pair,
    pair_costs,
    room_for_costs,
    threads_to_use,
)


def pairwise_dtw(
    clips: Sequence[ArrayLike], n_jobs: int | None = None, bidirectional: bool = False, tile: int = 128
) -> NDArray[np.float64]:
    """Compare every clip with every later one by DTW, or by B-DTW: a fraction of the curve's time.

    Parameters
    ----------
    clips : sequence of array (frames, d)
        N clips; compared in float32 where all of them are float32, else in float64.
    n_jobs : int, optional
        Threads; by default one for every processor that this process may use.
    bidirectional : bool
        Whether to take the smaller of both directions (B-DTW, eq. 1).
    tile : int
        Clips a side of a tile. Neither it nor `n_jobs` changes a bit of the result.

    Returns
    -------
    array (N (N-1) / 2,)
        `dtw` or `b_dtw` of `pairwise_distances`, bit for bit, in the same order.

    Raises
    ------
    ValueError
        As `pairwise_distances`.
    """
    jobs = threads_to_use(n_jobs, tile)
    arrays = comparable_clips(clips, [f"clips[{i}]" for i in range(len(clips))])
    distances = np.empty(len(arrays) * (len(arrays) - 1) // 2)

    def compare(a: PackedClips, b: PackedClips, upper: bool) -> list[NDArray[np.float64]]:
        return [_compare_by_dtw(a, b, bidirectional, upper)]

    compare_all(arrays, jobs, tile, compare, [distances])
    return distances


def _compare_by_dtw(a: PackedClips, b: PackedClips, bidirectional: bool, upper: bool) -> NDArray[np.float64]:
    """Return DTW or B-DTW of a tile, zero where `upper` leaves a pair out."""
    distances = np.zeros((len(a.frames), len(b.frames)))
    rows, columns = largest_pair(a, b, upper)
    room = room_for_costs(rows, columns, a.rows.dtype)
    words = np.empty(len(room.costs), dtype=np.int64)
    rows_of_totals = np.empty((2, columns), dtype=np.int64)
    _fill_dtw_tile(a, b, bidirectional, upper, room, words, rows_of_totals, distances)
    return distances


@kernel
def _fill_dtw_tile(a, b, bidirectional, upper, room, words, totals, distances):  # type: ignore[no-untyped-def]
    """Compare every clip of `a` with every clip of `b`, or with those of higher index alone (`upper`)."""
    for p in range(len(a.frames)):
        for q in range(p + 1 if upper else 0, len(b.frames)):
            m, n, _, width, _, high = pair_costs(a, p, b, q, room)
            quantum, length_bits = pack(room.costs, m, n, high, words[: m * width])
            if bidirectional:
                ahead, back = both_ways(words, width, 0, m - 1, 0, n - 1, totals[0], totals[1], 0)
                least = min(mean_quanta(ahead, length_bits), mean_quanta(back, length_bits))
            else:
                ahead = forward(words, width, 0, m - 1, 0, n - 1, totals[0], totals[1])
                least = mean_quanta(ahead, length_bits)
            distances[p, q] = least * quantum
