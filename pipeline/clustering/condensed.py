"""Condensed distances: the N(N-1)/2 pairs of N clips in scipy's squareform order.

Pair (i, j), i < j, stands at i N - i (i+1) / 2 + j - i - 1: row by row of the upper triangle.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isqrt
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Place = TypeVar("Place", int, NDArray[np.int64])

_BLOCK = 1 << 20


def places_of(first: NDArray[np.int64], second: NDArray[np.int64], clips: int) -> NDArray[np.int64]:
    """Return where pairs stand, given by the places of their clips, first < second."""
    return row_start(first, clips) + second - first - 1


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


def blocks(size: int) -> Iterator[slice]:
    """Divide an array into blocks of a million entries, to look at one after the other."""
    return (slice(start, start + _BLOCK) for start in range(0, size, _BLOCK))


def checked_distances(name: str, condensed: ArrayLike) -> NDArray[np.floating]:
    """Return condensed distances, all finite and not negative; as they are where float32 or float64.

    Raises
    ------
    ValueError
        The array is not condensed, or a distance is wrong; the message calls the array `name` and says which
        pair.
    """
    distances = np.asarray(condensed)
    if distances.dtype not in (np.float32, np.float64):
        distances = distances.astype(np.float64)
    if distances.ndim != 1:
        raise ValueError(
            f"{name} has shape {distances.shape}; it must be condensed, (N(N-1)/2,): "
            "scipy.spatial.distance.squareform turns a square matrix into one"
        )
    clips = clip_count(distances)
    for block in blocks(len(distances)):
        wrong = ~(np.isfinite(distances[block]) & (distances[block] >= 0))
        if wrong.any():
            pair = block.start + int(np.argmax(wrong))
            raise ValueError(
                f"{name}: the distance of {clips_of(pair, clips)} is {distances[pair]}; "
                "distances must be finite and not negative"
            )
    return distances


def clips_of(pair: int, clips: int) -> str:
    """Name the two clips whose distance stands at index `pair`, for a message."""
    first, second = pair_at(pair, clips)
    return f"clips {first} and {second}"


def pair_at(pair: int, clips: int) -> tuple[int, int]:
    """Return the places of the two clips, first < second, whose distance stands at index `pair`."""
    starts = row_start(np.arange(clips), clips)
    first = int(np.searchsorted(starts[:-1], pair, side="right")) - 1
    return first, first + 1 + pair - int(starts[first])


def row_start(clip: Place, clips: int) -> Place:
    """Return where the distances of a clip to the clips after it start."""
    return clip * clips - clip * (clip + 1) // 2
