"""The compiled kernels of Table 1's dynamic programme: see `alignment.cotw` and `alignment.nodes`."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

Integers = NDArray[np.int64]
_kernel = njit(cache=True, nogil=True, error_model="numpy")


@_kernel
def fill_bounds(
    nodes: Integers, slack: int, trim: int, least: int, slacks: Integers, low: Integers, high: Integers
) -> None:
    """Fill each segment's slack and each node's range of output frames: see `nodes.stretchable`."""
    segments, last, shorter = len(slacks), nodes[-1], max(least - 1, 1)
    after = 0
    for k in range(segments):
        slacks[k] = min(slack, max(nodes[k + 1] - nodes[k] - shorter, 0))
        after += slacks[k]
    before = 0
    for k in range(segments + 1):
        low[k] = nodes[k] - min(trim + before, after)
        high[k] = nodes[k] + min(before, trim + after)
        if trim and 0 < k < segments:
            low[k], high[k] = max(low[k], least), min(high[k], last - shorter)
        if k < segments:
            before += slacks[k]
            after -= slacks[k]
    # What one node cannot reach keeps its neighbours too from where they could not meet it.
    for k in range(1, segments + 1):
        span = nodes[k] - nodes[k - 1]
        low[k] = max(low[k], low[k - 1] + span - slacks[k - 1])
        high[k] = min(high[k], high[k - 1] + span + slacks[k - 1])
    for k in range(segments - 1, -1, -1):
        span = nodes[k + 1] - nodes[k]
        low[k] = max(low[k], low[k + 1] - span - slacks[k])
        high[k] = min(high[k], high[k + 1] - span + slacks[k])


@_kernel
def used_slack(nodes: Integers, moved: Integers) -> int:
    """Return the least slack, from 1, that allows these moves, of inner nodes and of open ends."""
    most = max(1, -moved[0], moved[-1] - nodes[-1])
    for k in range(len(nodes) - 1):
        most = max(most, abs(moved[k + 1] - moved[k] - nodes[k + 1] + nodes[k]))
    return most


@_kernel
def best_path(
    values: FloatArray,
    start: Integers,
    least_eta: Integers,
    most_eta: Integers,
    first: Integers,
    places: Integers,
    nodes: Integers,
    slacks: Integers,
    low: Integers,
    high: Integers,
    tie: float,
    moved: Integers,
) -> None:
    """Run the recurrence from the last node back to the first, and forward again for the moves.

    Parameters
    ----------
    values, start, least_eta, most_eta, first, places : arrays
        The tables: see `correlation_tables.TableLayout`.
    nodes : array (c + 1,)
        In the input.
    slacks : array (c,)
        The most that each segment may be stretched.
    low, high : array (c + 1,)
        Output frames that each node may take here.
    tie : float
        Sums that differ by no more count as equal.
    moved : array (c + 1,)
        Filled with each node's output frame.
    """
    segments, widest = len(nodes) - 1, 0
    for k in range(segments + 1):
        widest = max(widest, high[k] - low[k] + 1)
    choices = np.zeros((segments, widest), dtype=np.int64)
    best, following = np.zeros(widest), np.zeros(widest)
    for k in range(segments - 1, -1, -1):
        best, following, span = following, best, nodes[k + 1] - nodes[k]
        for place in range(low[k], high[k] + 1):
            least = max(-slacks[k], least_eta[k], low[k + 1] - place - span)
            most = min(slacks[k], most_eta[k], high[k + 1] - place - span)
            greatest, choice = -np.inf, 0
            for turn in range(2 * max(-least, most) + 1):
                # 0, -1, 1, -2, 2, ...: the first of equals is the least stretch
                eta = -(turn + 1) // 2 if turn % 2 else turn // 2
                if eta < least or eta > most:
                    continue
                cell = start[k] + (eta - least_eta[k]) * places[k] + place - first[k]
                value = values[cell] + following[place + span + eta - low[k + 1]]
                if value > greatest + tie or greatest == -np.inf:
                    greatest, choice = value, eta
            best[place - low[k]] = greatest
            choices[k, place - low[k]] = choice
    moved[0] = high[0]
    for place in range(moved[0] - 1, low[0] - 1, -1):
        # Output begins at its first frame, unless it is better to have begun before.
        if best[place - low[0]] > best[moved[0] - low[0]] + tie:
            moved[0] = place
    for k in range(segments):
        moved[k + 1] = moved[k] + nodes[k + 1] - nodes[k] + choices[k, moved[k] - low[k]]
