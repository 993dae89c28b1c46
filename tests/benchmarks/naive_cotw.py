"""Correlation-optimized time warping as one writes it first: a memoised recursion and NumPy [CoTW 3].

Every stretch of a segment is interpolated and correlated for itself, all DOFs of it at once. It is what
`alignment.py` times the kernels against, and shares no code with them.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def naive_cotw(
    moving: Array, reference: Array, segment_length: int, slack: int
) -> tuple[float, tuple[int, ...]]:
    """Return the greatest objective and the eta that has it, of equals the least stretch, as `cotw`."""
    last = len(reference) - 1
    source = stretched(moving, last)
    segments = max(1, len(reference) // segment_length)
    nodes = [*range(0, segments * segment_length, segment_length), last]

    @cache
    def best(k: int, start: int) -> tuple[float, tuple[int, ...]]:
        """Of the segments from k on, the first of which begins at an output frame."""
        if k == segments:
            return (0.0, ()) if start == last else (-np.inf, ())
        segment = source[nodes[k] : nodes[k + 1] + 1]
        greatest, choice = -np.inf, ()
        for eta in sorted(range(-slack, slack + 1), key=abs):
            end = start + len(segment) - 1 + eta
            rest, etas = best(k + 1, end) if end <= last else (-np.inf, ())
            if rest == -np.inf:
                continue
            shown = stretched(segment, end - start)
            value = summed_correlation(shown, reference[start : end + 1]) + rest
            if value > greatest:
                greatest, choice = value, (eta, *etas)
        return greatest, choice

    return best(0, 0)


def stretched(values: Array, span: int) -> Array:
    """Interpolate linearly to `span` frames from the first to the last."""
    times = np.arange(span + 1) * ((len(values) - 1) / span)
    before = np.minimum(times.astype(int), len(values) - 2)
    share = (times - before)[:, None]
    return values[before] * (1 - share) + values[before + 1] * share


def summed_correlation(a: Array, b: Array) -> float:
    """Sum Pearson's correlations over the DOFs; 0 where either does not vary."""
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    powers = (a * a).sum(axis=0) * (b * b).sum(axis=0)
    varies = powers > 0
    return float(((a * b).sum(axis=0)[varies] / np.sqrt(powers[varies])).sum())
