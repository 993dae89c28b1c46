"""Smooth curves through key poses, for actions to be written in.

Monotone cubics (PCHIP) do not overshoot: a foot keyed twice at one place stays there.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from motionary.pipeline.motion import FloatArray


def keys(time: FloatArray, *poses: tuple[float, ...]) -> FloatArray:
    """Join key poses, each a time and one or more values, by monotone cubics.

    Parameters
    ----------
    time : array (F,)
        In the keys' unit; before the first key its pose is held, after the last key the last.
    *poses : tuple of float
        Time and V values each, in order of time.

    Returns
    -------
    array (F,) or (F, V)
        Continuous in value and slope; one axis where V is 1.
    """
    # Keys at rest far outside make the slope at the first and the last key 0.
    table = np.array([poses[0], *poses, poses[-1]], dtype=np.float64)
    table[0, 0] -= 10.0
    table[-1, 0] += 10.0
    curve = PchipInterpolator(table[:, 0], table[:, 1:])(time)
    return curve[:, 0] if table.shape[1] == 2 else curve


def cycle_keys(phase: FloatArray, *poses: tuple[float, ...]) -> FloatArray:
    """Join key poses of a cycle, times in [0, 1), so that it closes smoothly."""
    around = [(time + turn, *values) for turn in (-1, 0, 1) for time, *values in poses]
    return keys(np.mod(phase, 1.0), *around)


def ease(share: FloatArray) -> FloatArray:
    """Go from 0 to 1 with no speed and no acceleration at either end."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)
