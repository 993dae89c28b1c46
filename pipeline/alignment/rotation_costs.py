"""How far rotations are apart: the cost of online alignment, for every two frames of two motions [FP eq. 1].

    sum over joints of 2/pi arccos |p.q|,   0 alike, 1 half a turn apart in a joint

The arccos as printed loses half of its digits where rotations are alike, which is where alignment takes
place; the kernel takes the same angle from its chord.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def rotation_costs(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return how far apart any two frames of two motions are.

    Parameters
    ----------
    a : array (m, J, 4)
        Unit quaternions x, y, z, w, as `motionary.pipeline.joint_rotations` gives them; either of a
        rotation's two will do.
    b : array (n, J, 4)
        Those of the other motion, of the same joints.

    Returns
    -------
    array (m, n)
        From 0, the same, to J, half a turn in every joint.

    Raises
    ------
    ValueError
        One is no such array, or a quaternion is not of length 1 (to .001).
    """
    from motionary.pipeline.alignment.online_kernels import fill_costs

    rows = checked_rotations(a, ("m", "J", 4), "a")
    columns = checked_rotations(b, ("n", rows.shape[1], 4), "b")
    costs = np.empty((len(rows), len(columns)))
    fill_costs(np.ascontiguousarray(columns.transpose(1, 2, 0)), 0, len(columns), rows, costs)
    return costs


def checked_rotations(values: ArrayLike, shape: tuple[int | str, ...], name: str) -> NDArray[np.float64]:
    """Return quaternions in an array of their own, at length 1; a letter in `shape` is any number but 0."""
    from motionary.pipeline.alignment.online_kernels import normalise

    array = np.asarray(values)
    fits = array.ndim == len(shape) and all(
        have == need or (isinstance(need, str) and have)
        for have, need in zip(array.shape, shape, strict=True)
    )
    if not fits or array.dtype.kind not in "fiu":
        wanted = ", ".join(map(str, shape))
        raise ValueError(
            f"{name} has shape {array.shape} and type {array.dtype}; it needs real numbers, ({wanted}), "
            "as `joint_rotations` makes them of a motion"
        )
    quaternions = np.ascontiguousarray(array, dtype=np.float64)
    unit = np.empty_like(quaternions)
    wrong = normalise(quaternions.reshape(-1, 4), unit.reshape(-1, 4))
    if wrong >= 0:
        frame, joint = divmod(wrong, array.shape[-2])
        is_live = array.ndim == 2
        place = f"{name}, joint {joint}" if is_live else f"{name}, frame {frame}, joint {joint}"
        mend = "normalise it, or push None for a live frame that was lost" if is_live else "normalise it"
        said = ", ".join(f"{one:.6g}" for one in quaternions.reshape(-1, 4)[wrong])
        raise ValueError(f"{place} holds the quaternion ({said}); it must have length 1 (x, y, z, w): {mend}")
    return unit
