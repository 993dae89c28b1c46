"""Where the joints of a live motion will be turned next: dead reckoning from its last two frames [FP 3.2].

    q(t + k) = q(t) (q(t - e)^-1 q(t))^(k / e),    e the frames between the two

so every joint goes on at the angular velocity it had, about the axis it had, the shorter way round. The paper
extrapolates three Euler angles in the same manner; the rotation itself has no angles that jump at half a turn
and no gimbal lock, and is the same whichever of its two quaternions is given.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray


def forecast(previous: FloatArray, latest: FloatArray, frames: int, elapsed: int = 1) -> NDArray[np.float64]:
    """Forecast the rotations of joints.

    Parameters
    ----------
    previous, latest : array (J, 4)
        Unit quaternions x, y, z, w of two frames.
    frames : int
        How many to forecast.
    elapsed : int
        Frames from `previous` to `latest`; more than 1 where some between them were lost.

    Returns
    -------
    array (frames, J, 4)
        Those after `latest`.

    Raises
    ------
    ValueError
        Shapes disagree, or a number of frames is out of range.
    """
    from motionary.pipeline.alignment.online_kernels import extrapolate

    previous, latest = np.asarray(previous, dtype=np.float64), np.asarray(latest, dtype=np.float64)
    if previous.shape != latest.shape or latest.ndim != 2 or latest.shape[1] != 4:
        raise ValueError(f"frames have shapes {previous.shape} and {latest.shape}; both must be (joints, 4)")
    if frames < 0 or elapsed < 1:
        raise ValueError(f"frames is {frames}, at least 0; elapsed is {elapsed}, at least 1")
    shown = np.empty((frames + 2, *latest.shape))
    shown[0], shown[1] = previous, latest
    extrapolate(shown, elapsed)
    return shown[2:]
