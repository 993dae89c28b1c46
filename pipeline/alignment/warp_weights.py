"""What weights of a basis may be, L a <= b, and which are nearest to a path [GTW 4.2].

The rows of L: weights of rising functions are at least 0, the path begins at frame 0 or later and ends at
frame n - 1 or earlier. The last two are relaxed, as in the paper, so that a path may show a part of its
sequence; ``"fixed"`` ends are first and last frames, which then meet as in DTW.

One row is added. With relaxed ends, eq. 3 is least where every sequence stands still at a moment in which
all agree, so a path must run through `least_share` of its sequence: q(l) a - q(1) a >= least_share (n - 1).
A warp that covers less has collapsed, and no weights lead to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from motionary.pipeline.alignment.bases import Basis
from motionary.pipeline.alignment.quadratic_programme import solve_programme
from motionary.pipeline.motion import FloatArray

Ends = Literal["relaxed", "fixed"]
LEAST_SHARE = 0.5


@dataclass(frozen=True, eq=False)
class WeightLimits:
    """Linear constraints on weights a: ``equal @ a == exact`` and ``rows @ a <= bounds``.

    Parameters
    ----------
    rows : array (r, k)
        L.
    bounds : array (r,)
        b.
    equal : array (e, k)
        Of fixed ends; no row where ends are relaxed.
    exact : array (e,)
        Where those are.
    """

    rows: FloatArray
    bounds: FloatArray
    equal: FloatArray
    exact: FloatArray


def weight_limits(basis: Basis, ends: Ends = "relaxed", least_share: float = LEAST_SHARE) -> WeightLimits:
    """Return what the weights of one sequence must keep to.

    Parameters
    ----------
    basis : Basis
    ends : {"relaxed", "fixed"}
        Whether the path may begin later than the first frame and end before the last.
    least_share : float
        Share of the sequence that the path runs through at least, above 0 and at most 1.

    Raises
    ------
    ValueError
        A setting is none of these.
    """
    if ends not in ("relaxed", "fixed"):
        raise ValueError(f"ends is {ends!r}; it must be 'relaxed' or 'fixed'")
    if not 0 < least_share <= 1:
        raise ValueError(f"least_share is {least_share}; it must be above 0 and at most 1")
    last = basis.frames - 1
    first_row, last_row = basis.values[0], basis.values[-1]
    signs = -np.eye(basis.values.shape[1])[basis.free :]
    if ends == "fixed":
        # Without a constant function every path begins at frame 0, and an equation of zeros is none.
        begins = first_row[None][: basis.free]
        return WeightLimits(
            signs,
            np.zeros(len(signs)),
            np.concatenate([begins, last_row[None]]),
            np.append(np.zeros(len(begins)), last),
        )
    rows = np.concatenate([signs, [-first_row, last_row, first_row - last_row]])
    bounds = np.concatenate([np.zeros(len(signs)), [0.0, last, -least_share * last]])
    return WeightLimits(rows, bounds, np.zeros((0, basis.values.shape[1])), np.zeros(0))


def ends_of_each(ends: Ends | Sequence[Ends], sequences: int) -> tuple[Ends, ...]:
    """Return the kind of ends of every sequence, given one for all or one each.

    Raises
    ------
    ValueError
        There are other than `sequences` of them.
    """
    each: tuple[Ends, ...] = (ends,) * sequences if isinstance(ends, str) else tuple(ends)
    if len(each) != sequences:
        raise ValueError(f"ends has {len(each)} entries; there are {sequences} sequences")
    return each


def joined_limits(limits: Sequence[WeightLimits]) -> WeightLimits:
    """Return the constraints of several sequences as those of their weights one after the other."""
    return WeightLimits(
        block_diag(*(one.rows for one in limits)),
        np.concatenate([one.bounds for one in limits]),
        block_diag(*(one.equal for one in limits)),
        np.concatenate([one.exact for one in limits]),
    )


def nearest_weights(basis: Basis, path: FloatArray, limits: WeightLimits) -> FloatArray:
    """Return the permitted weights whose path is nearest to one that is given, by squared differences.

    Parameters
    ----------
    basis : Basis
    path : array (l,)
        Frames of the sequence.
    limits : WeightLimits
        Of the basis.

    Returns
    -------
    array (k,)

    Raises
    ------
    ValueError
        The path has another number of steps, or leaves the sequence.
    UnsolvedError
        No weights were found.
    """
    steps = len(basis.values)
    path = np.asarray(path, dtype=np.float64)
    if path.shape != (steps,) or not (path >= 0).all() or not (path <= basis.frames - 1).all():
        raise ValueError(
            f"a path has shape {path.shape}; it needs ({steps},), frames from 0 to {basis.frames - 1}"
        )
    # In units of the sequence's length, as in the time step.
    scaled, wanted = basis.values / (basis.frames - 1), path / (basis.frames - 1)
    return solve_programme(
        scaled.T @ scaled, -scaled.T @ wanted, limits.rows, limits.bounds, limits.equal, limits.exact
    )
