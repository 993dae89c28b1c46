"""Low-motion frames merged [DC 4.2].

People tell motions apart by where they move. A run of frames that hardly differ becomes one frame, their
mean, so that standing still weighs no more than its one pose. With d_i = |F_(i+1) - F_i|, the longest run
F_m .. F_k is a group while

- ``sum`` (the paper's text, our default):  d_m + ... + d_(k-1) < epsilon, the sum starting at 0 in each group
- ``mean`` (its equations 4-5):  (d_m + ... + d_(k-1)) / (k - m) < epsilon
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray


@dataclass(frozen=True, eq=False)
class Resampled:
    """Groups of frames and the frame each became.

    Parameters
    ----------
    values : array (G, d) float32
        The mean of each group's frames.
    first, last : array (G,) int
        The group's frames, both ends included.
    """

    values: NDArray[np.float32]
    first: NDArray[np.intp]
    last: NDArray[np.intp]


def merge_low_motion(
    values: FloatArray,
    epsilon: float,
    criterion: Literal["sum", "mean"] = "sum",
    driving: int | None = None,
) -> Resampled:
    """Merge runs of frames that hardly differ [DC 4.2, equations 3-5].

    Parameters
    ----------
    values : array (T, d)
        Feature vectors, a row a frame.
    epsilon : float
        In the features' unit; 0 merges nothing.
    criterion : {"sum", "mean"}
        Which of the paper's two rules bounds a group.
    driving : int, optional
        How many leading columns decide the groups; all by default.

    Returns
    -------
    Resampled
    """
    values = np.asarray(values)
    steps = np.linalg.norm(np.diff(values[:, :driving].astype(np.float64), axis=0), axis=1)
    first = np.array(_group_starts(steps, epsilon, criterion), dtype=np.intp)
    last = np.append(first[1:], len(values)) - 1
    sums = np.add.reduceat(values.astype(np.float64), first, axis=0)
    means = sums / (last - first + 1)[:, None]
    return Resampled(means.astype(np.float32), first, last)


def _group_starts(steps: FloatArray, epsilon: float, criterion: str) -> list[int]:
    starts, total = [0], 0.0
    for frame, step in enumerate(steps.tolist(), start=1):
        total += step
        bound = epsilon if criterion == "sum" else epsilon * (frame - starts[-1])
        if not total < bound:
            starts.append(frame)
            total = 0.0
    return starts
