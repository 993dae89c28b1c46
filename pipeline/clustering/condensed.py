"""Condensed distances: the N(N-1)/2 pairs of N clips in scipy's squareform order.

Pair (i, j), i < j, stands at i N - i (i+1) / 2 + j - i - 1: row by row of the upper triangle.
"""

from __future__ import annotations

from math import isqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray


def places_of(first: NDArray[np.int64], second: NDArray[np.int64], clips: int) -> NDArray[np.int64]:
    """Return where pairs stand, given by the places of their clips, first < second."""
    return first * clips - first * (first + 1) // 2 + second - first - 1


def clip_count(condensed: NDArray[np.floating]) -> int:
    """Return N for a condensed array of N(N-1)/2 distances; none at all means one clip.

    Raises
    ------
    ValueError
        No N fits the length.
    """
    pairs = len(condensed)
    clips = (1 + isqrt(1 + 8 * pairs)) // 2
    if clips * (clips - 1) // 2 != pairs:
        raise ValueError(
            f"{pairs} distances are not a condensed matrix: {clips} clips have {clips * (clips - 1) // 2}, "
            f"{clips + 1} have {clips * (clips + 1) // 2}"
        )
    return clips


def checked_distances(name: str, condensed: ArrayLike) -> NDArray[np.float64]:
    """Return condensed distances as float64, all finite and not negative.

    Raises
    ------
    ValueError
        The array is not condensed, or a distance is wrong; the message calls the array `name` and says which
        pair.
    """
    distances = np.asarray(condensed, dtype=np.float64)
    if distances.ndim != 1:
        raise ValueError(
            f"{name} has shape {distances.shape}; it must be condensed, (N(N-1)/2,): "
            "scipy.spatial.distance.squareform turns a square matrix into one"
        )
    clips = clip_count(distances)
    wrong = ~(np.isfinite(distances) & (distances >= 0))
    if wrong.any():
        pair = int(np.argmax(wrong))
        raise ValueError(
            f"{name}: the distance of {clips_of(pair, clips)} is {distances[pair]}; "
            "distances must be finite and not negative"
        )
    return distances


def clips_of(pair: int, clips: int) -> str:
    """Name the two clips whose distance stands at index `pair`, for a message."""
    rows = np.arange(clips)
    starts = rows * clips - rows * (rows + 1) // 2
    first = int(np.searchsorted(starts[:-1], pair, side="right")) - 1
    return f"clips {first} and {first + 1 + pair - int(starts[first])}"


def distances_of(clip: int, condensed: NDArray[np.float64], clips: int) -> NDArray[np.float64]:
    """Return the row (N,) of one clip: its distance to every clip, infinite to itself."""
    before = np.arange(clip)
    above = places_of(before, np.full(clip, clip), clips)
    start = clip * clips - clip * (clip + 1) // 2
    return np.concatenate([condensed[above], [np.inf], condensed[start : start + clips - clip - 1]])
