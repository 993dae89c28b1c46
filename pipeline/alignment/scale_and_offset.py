"""The space step of iterative motion warping: a scale and an offset for every frame and DOF.

**Hsu, Pulli, Popovic**, *Style translation for human motion*, SIGGRAPH 2005, as [GTW] 5.1 tells it. Per DOF,
for values x of n frames of which step l shows frame f(l), and targets t, the scales a and offsets b of

    min  sum over l of (a x + b at f(l), less t(l))^2
         + lambda_a sum over i of (a(i+1) - a(i))^2 + lambda_b sum over i of (b(i+1) - b(i))^2

The normal equations join a frame with itself and its neighbours only: two unknowns a frame, interleaved, have
two bands beside the diagonal, and all DOFs stand behind one another in one system. Time and memory grow
linearly with frames and DOFs.

What neither targets nor smoothness tell (scale against offset in a DOF that does not move, a frame that no
step shows where nothing is smooth) comes out nearest to scale 1 and offset 0, each measured in its own unit.
That takes a ridge, and steps of refinement that take its bias out again wherever the equations do tell
something (the proximal point method).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from motionary.pipeline.alignment.warp import checked_sequence
from motionary.pipeline.motion import FloatArray

_RIDGE, _REFINEMENTS = 1e-10, 3  # the ridge is a share of the diagonal; both keep well clear of rounding
_LEAST = 1e-150  # what is below cannot be squared


def fit_scale_and_offset(
    values: FloatArray,
    frames: ArrayLike,
    targets: FloatArray,
    scale_smoothness: float,
    offset_smoothness: float,
) -> tuple[FloatArray, FloatArray]:
    """Fit a sequence's scales and offsets to the targets that its frames meet.

    Parameters
    ----------
    values : array (n, dofs)
        The sequence to be scaled and moved.
    frames : array (L,) of int
        The frame of `values` that is shown at each step, in any order, any number of times.
    targets : array (L, dofs)
        What is to be shown there.
    scale_smoothness, offset_smoothness : float
        lambda_a, in squared units of `values`, and lambda_b: how much a change from frame to frame costs. Not
        negative; 0 leaves the frames to themselves.

    Returns
    -------
    scale, offset : array (n, dofs)
        `scale * values + offset` is near the targets.

    Raises
    ------
    ValueError
        Shapes disagree, a frame is not one of `values`, a value is not finite, a smoothness is negative or
        not finite.
    """
    values = checked_sequence(values, "values").astype(np.float64)
    targets = checked_sequence(targets, "targets").astype(np.float64)
    shown = _checked_frames(frames, values, targets)
    smoothness = checked_smoothness(scale_smoothness, offset_smoothness)
    unit = np.abs(values).max(axis=0)
    unit = np.where(unit > _LEAST, unit, 1.0)
    # Unknowns (dofs, n, 2): the scale in the DOF's own unit, so that both are of a kind, and the offset.
    shape = (values.shape[1], len(values), 2)
    count = np.bincount(shown, minlength=len(values)).astype(np.float64)
    total = np.zeros_like(values)
    np.add.at(total, shown, targets)
    row = np.stack([(values / unit).T, np.ones(shape[:2])], axis=2)
    own_smoothness = np.stack([smoothness[0] / unit**2, np.full(len(unit), smoothness[1])], axis=1)
    bands = _normal_equations(row, count, own_smoothness)
    known = np.zeros(shape)
    known[..., 0] = unit[:, None]
    fitted = _solve(bands, (row * total.T[..., None]).ravel(), known.ravel()).reshape(shape)
    return fitted[..., 0].T / unit, fitted[..., 1].T.copy()


def checked_smoothness(scale_smoothness: float, offset_smoothness: float) -> tuple[float, float]:
    """Return both, or raise ValueError where one is negative or not finite."""
    both = {"scale_smoothness": scale_smoothness, "offset_smoothness": offset_smoothness}
    for name, value in both.items():
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"{name} is {value}; it must be finite and not negative")
    return float(scale_smoothness), float(offset_smoothness)


def _checked_frames(frames: ArrayLike, values: FloatArray, targets: FloatArray) -> NDArray[np.int64]:
    shown = np.asarray(frames)
    if shown.shape != (len(targets),) or not np.issubdtype(shown.dtype, np.integer):
        raise ValueError(
            f"frames have shape {shown.shape} and type {shown.dtype}; there are {len(targets)} targets, "
            f"so it must be ({len(targets)},), whole numbers"
        )
    if targets.shape[1] != values.shape[1]:
        raise ValueError(
            f"values have {values.shape[1]} DOFs and targets {targets.shape[1]}; they must have the same"
        )
    if shown.min() < 0 or shown.max() >= len(values):
        raise ValueError(
            f"frames run from {shown.min()} to {shown.max()}; values have 0 to {len(values) - 1}"
        )
    return shown.astype(np.int64)


def _normal_equations(row: FloatArray, count: FloatArray, smoothness: FloatArray) -> FloatArray:
    """Return the diagonal and the two bands under it, (3, unknowns): LAPACK's lower form."""
    bands = np.zeros((3, *row.shape))
    bands[0] = row**2 * count[:, None]
    bands[1, ..., 0] = row[..., 0] * row[..., 1] * count
    neighbours = smoothness[:, None]
    bands[0, :, 1:] += neighbours
    bands[0, :, :-1] += neighbours
    bands[2, :, :-1] = -neighbours
    return bands.reshape(3, -1)


def _solve(bands: FloatArray, right: FloatArray, known: FloatArray) -> FloatArray:
    """Solve the equations, and stay at what is known wherever they leave it open."""
    ridged = bands.copy()
    ridged[0] += _RIDGE * np.where(bands[0] > 0, bands[0], 1.0)
    factor = cholesky_banded(ridged, lower=True)
    for _ in range(_REFINEMENTS):
        known = known + cho_solve_banded((factor, True), right - _product(bands, known))
    return known


def _product(bands: FloatArray, vector: FloatArray) -> FloatArray:
    product = bands[0] * vector
    for k in (1, 2):
        product[k:] += bands[k, :-k] * vector[:-k]
        product[:-k] += bands[k, :-k] * vector[k:]
    return product
