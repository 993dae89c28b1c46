"""Euler angles to quaternions, any sequence of axes, without SciPy's cost per rotation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from motionary.pipeline.motion import FloatArray


def quaternions_from_euler(axes: Sequence[int], angles: FloatArray) -> FloatArray:
    """Compose rotations about single axes, intrinsically: the first axis is the outermost.

    Parameters
    ----------
    axes : sequence of int
        k axes, 0 to 2 for x to z, repeats allowed; (2, 1, 0) is Rz Ry Rx.
    angles : array (..., k)
        Radians.

    Returns
    -------
    array (..., 4)
        Unit quaternions x, y, z, w; the identity where k is 0.
    """
    quaternions = np.zeros((*angles.shape[:-1], 4))
    quaternions[..., 3] = 1
    for place, i in enumerate(axes):
        j, k = (i + 1) % 3, (i + 2) % 3
        half = angles[..., place] / 2
        sine, cosine = np.sin(half), np.cos(half)
        old = quaternions.copy()
        quaternions *= cosine[..., None]
        quaternions[..., i] += sine * old[..., 3]
        quaternions[..., j] += sine * old[..., k]
        quaternions[..., k] -= sine * old[..., j]
        quaternions[..., 3] -= sine * old[..., i]
    return quaternions
