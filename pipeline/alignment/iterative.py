"""Iterative motion warping (IMW): dynamic time warping that may also scale and move what it warps.

**Hsu, Pulli, Popovic**, *Style translation for human motion*, SIGGRAPH 2005, as [GTW] 5.1 tells it.
Scales and offsets of every frame and DOF of the moving sequence, changing smoothly, and a path are found in
turn, each the best for the other:

    least  sum over the path of |a_i * x_i + b_i - y_k|^2  +  lambda_a |differences of a|^2
                                                           +  lambda_b |differences of b|^2

Neither step raises that sum, which `IterativeWarp.energies` shows. It ends when the path repeats, or where a
step gains less than rounding loses. The first path is that of a = 1, b = 0.

So that offset and unit of either sequence change nothing, each is centred by DOF and divided by its root mean
square over all DOFs first, and the smoothness weighs changes in those units. The rival, the sequences as they
are, begins with a path that an offset of one sequence spoils, and scales about wherever 0 lies. Distances are
squared, as the paper's are; `dtw` adds them as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.dtw import nearest_path
from motionary.pipeline.alignment.path_warp import PathWarp, path_warp
from motionary.pipeline.alignment.scale_and_offset import checked_smoothness, fit_scale_and_offset
from motionary.pipeline.alignment.warp import at_a_clear_size, checked_pair
from motionary.pipeline.alignment.weights import checked_weights
from motionary.pipeline.motion import FloatArray


@dataclass(frozen=True, eq=False)
class IterativeWarp(PathWarp):
    """The warp that iterative motion warping found, with the scales and offsets it goes with.

    Parameters
    ----------
    scale, offset : array (moving frames, dofs)
        ``scale * moving + offset``, warped, is near the reference. The warp itself does not apply them.
    energies : array (steps,)
        What is minimised, in squared units of the centred reference's root mean square, after the first path
        and then after every fit and every path that follows; it does not rise.
    """

    scale: FloatArray
    offset: FloatArray
    energies: FloatArray


@dataclass(frozen=True, eq=False)
class _Standard:
    """A sequence centred by DOF and in units of its own root mean square, unit / 2^exponent."""

    values: FloatArray
    mean: FloatArray
    unit: float
    exponent: int


def iterative_motion_warping(
    moving: FloatArray,
    reference: FloatArray,
    weights: FloatArray | None = None,
    scale_smoothness: float = 100.0,
    offset_smoothness: float = 100.0,
    most_rounds: int = 50,
) -> IterativeWarp:
    """Warp one sequence along the path on which it can be scaled and moved nearest to the reference.

    Parameters
    ----------
    moving : array (n, dofs)
        The sequence to be warped.
    reference : array (m, dofs)
        The sequence whose timing it takes.
    weights : array (dofs,), optional
        Of the squared differences, and of the smoothness of a DOF's scale and offset alike, not negative; 1
        each by default.
    scale_smoothness, offset_smoothness : float
        lambda_a and lambda_b. Scales and offsets follow what lasts longer than about their square root in
        frames; the larger, the nearer to one scale and offset for the whole of a DOF.
    most_rounds : int
        Fits at most, at least 1; they end before that where the path repeats.

    Returns
    -------
    IterativeWarp
        Path and mean times as of `dtw`, the scales and the offsets.

    Raises
    ------
    ValueError
        Shapes disagree, a value is not finite, a smoothness is negative, the sequences are too long
        (n + m above 2^19), or moving ones so small beside their reference that a scale is beyond 64 bits.
    """
    moving, reference = (values.astype(np.float64) for values in checked_pair(moving, reference))
    root = np.sqrt(checked_weights(weights, moving.shape[1]))
    smoothness = checked_smoothness(scale_smoothness, offset_smoothness)
    if most_rounds < 1:
        raise ValueError(f"most_rounds is {most_rounds}; it takes one fit at least")
    own, other = _standard(moving), _standard(reference)
    scale: FloatArray = np.ones(own.values.shape)
    offset: FloatArray = np.zeros(own.values.shape)
    path = nearest_path(own.values * root, other.values * root)
    energies = [_energy(own, other, path, scale, offset, root, smoothness)]
    for _ in range(most_rounds):
        fitted = fit_scale_and_offset(own.values, path[:, 0], other.values[path[:, 1]], *smoothness)
        energy = _energy(own, other, path, *fitted, root, smoothness)
        if energy > energies[-1]:
            break
        scale, offset = fitted
        energies.append(energy)
        nearest = nearest_path((scale * own.values + offset) * root, other.values * root)
        energy = _energy(own, other, nearest, scale, offset, root, smoothness)
        if energy > energies[-1]:
            break
        before, path = path, nearest
        energies.append(energy)
        if np.array_equal(before, path):
            break
    warp = path_warp(path, len(moving))
    scale, offset = _in_their_units(own, other, scale, offset)
    return IterativeWarp(warp.source_time, warp.moving_frames, warp.path, scale, offset, np.array(energies))


def _standard(values: FloatArray) -> _Standard:
    mean = values.mean(axis=0)
    (centred,), exponent = at_a_clear_size(np.where(np.ptp(values, axis=0) == 0, 0.0, values - mean))
    unit = float(np.sqrt((centred**2).mean())) or 1.0
    return _Standard(centred / unit, mean, unit, exponent)


def _in_their_units(
    own: _Standard, other: _Standard, scale: FloatArray, offset: FloatArray
) -> tuple[FloatArray, FloatArray]:
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.ldexp(scale * (other.unit / own.unit), own.exponent - other.exponent)
        offset = np.ldexp(offset * other.unit, -other.exponent) + other.mean - scale * own.mean
    if not (np.isfinite(scale).all() and np.isfinite(offset).all()):
        raise ValueError(
            "moving is so small beside reference that its scale is beyond 64 bits; bring both to a like unit"
        )
    return scale, offset


def _energy(
    own: _Standard,
    other: _Standard,
    path: NDArray[np.int64],
    scale: FloatArray,
    offset: FloatArray,
    root: FloatArray,
    smoothness: tuple[float, float],
) -> float:
    apart = (scale * own.values + offset)[path[:, 0]] - other.values[path[:, 1]]
    changes = (np.diff(scale, axis=0), np.diff(offset, axis=0))
    parts = (1.0, apart), *zip(smoothness, changes, strict=True)
    return float(sum(factor * ((root * part) ** 2).sum() for factor, part in parts))
