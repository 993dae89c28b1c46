"""The space step of iterative motion warping: a scale and an offset for every frame and DOF.

**Hsu, Pulli, Popovic**, *Style translation for human motion*, SIGGRAPH 2005, as [GTW] 5.1 tells it. Per DOF,
for values x of n frames of which step l shows frame f(l), and targets t, the scales a and offsets b of

    min  sum over l of (a x + b at f(l), less t(l))^2
         + lambda_a sum over i of (a(i+1) - a(i))^2 + lambda_b sum over i of (b(i+1) - b(i))^2

Three things keep the minimum where numbers are far apart, as in normal equations they drown each other:

- values are taken from their mean, in units of their greatest deviation, and the offset is measured where the
  mean goes: c = b + a mean. Changes of a and of b then are g (s(i+1) - s(i)), s = (a unit, c), for two g;
- the price y of a change is an unknown of its own, y = lambda g (s(i+1) - s(i)). However large lambda is,
  this only says that there is no change, and lets what the data tell stand;
- corrections are solved for until they are rounding.

These equations join a frame with itself and its neighbours only: four unknowns a frame have three bands on
either side of the diagonal, and all DOFs stand behind one another in one system. Time and memory grow
linearly with frames and DOFs.

What neither targets nor smoothness tell (a frame that no step shows where nothing is smooth) stays nearest to
the best constant scale and offset of its DOF, by the squares of a unit and c, and the scale of a DOF that
does not move is 1. That takes a ridge, whose bias the corrections take out again wherever the equations do
tell something (the proximal point method). The energy is the least but for rounding: that of a x + b as it is
written down in 64 bits, while deviations are more than about 1e-8 of their mean.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dgbtrf, dgbtrs

from motionary.pipeline.alignment.warp import checked_sequence
from motionary.pipeline.motion import FloatArray

_RIDGE, _CORRECTIONS = 1e-10, 4  # beside 1, the square of a row of the data; well clear of rounding
_STILL = 1e-10  # of a DOF's greatest deviation: frames shown that differ by less tell no scale
_BANDS = 3  # on either side of the diagonal


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
        not finite, or a scale would be beyond 64 bits.
    """
    values = checked_sequence(values, "values").astype(np.float64)
    targets = checked_sequence(targets, "targets").astype(np.float64)
    shown = _checked_frames(frames, values, targets)
    smoothness = checked_smoothness(scale_smoothness, offset_smoothness)
    still = np.ptp(values, axis=0) == 0
    mean = np.where(still, values[0], values.mean(axis=0))
    unit = np.where(still, np.where(mean == 0, 1.0, np.abs(mean)), np.abs(values - mean).max(axis=0))
    count = np.bincount(shown, minlength=len(values)).astype(np.float64)
    total = np.zeros_like(values)
    np.add.at(total, shown, targets)
    with np.errstate(over="ignore", invalid="ignore"):  # what is priced beyond any number does not change
        prices = np.stack(
            [(np.sqrt(smoothness[0]) / unit) ** 2, smoothness[1] * (1 + (mean / unit) ** 2)], axis=1
        )
        system = _System(((values - mean) / unit).T, count, total.T, mean / unit, prices)
        place, changes = system.solve(_best_constant((values - mean)[shown] / unit, targets, unit))
        scale = _frames(place[..., 0], changes[..., 0], prices[:, 0]) / unit
        offset = place[..., 1].T - scale * mean
        offset = _frames(offset.T, changes[..., 1], prices[:, 1])
    if not (np.isfinite(scale).all() and np.isfinite(offset).all()):
        raise ValueError(
            "values are so small beside targets that their scale is beyond 64 bits; bring both to a like unit"
        )
    return scale, offset


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


class _System:
    """The equations of all DOFs: for each frame s = (p, c), and the prices of both changes to the next.

    Parameters
    ----------
    row : array (dofs, n)
        Of p in the data; that of c is 1.
    count : array (n,)
        Steps that show a frame.
    total : array (dofs, n)
        Their targets' sum.
    mean : array (dofs,)
        In the DOF's unit: b changes by the change of c less `mean` times that of p.
    prices : array (dofs, 2)
        lambda of a change of p, and of b in units of the length of (mean, 1); may be infinite.
    """

    def __init__(
        self, row: FloatArray, count: FloatArray, total: FloatArray, mean: FloatArray, prices: FloatArray
    ) -> None:
        self.row, self.count, self.total = row, count, total
        self.length = np.hypot(1.0, mean)
        self.across, self.along = (-mean / self.length)[:, None], (1 / self.length)[:, None]
        # An equation of a change, change * lambda = price, is divided by what is greater of lambda and 1.
        self.of_change, self.of_price = np.minimum(prices, 1.0), 1 / np.maximum(prices, 1.0)
        self.factor = dgbtrf(self._bands(), _BANDS, _BANDS)[:2]

    def solve(self, known: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return s (dofs, n, 2), and by how much p and b change to the next frame (dofs, n - 1, 2).

        Parameters
        ----------
        known : array (dofs, 2)
            Where s stays wherever nothing tells more.
        """
        found = np.zeros((*self.row.shape, 4))
        found[..., :2] = known[:, None]
        for _ in range(_CORRECTIONS):
            left = self._left_over(found)
            found += dgbtrs(self.factor[0], _BANDS, _BANDS, left.ravel(), self.factor[1])[0].reshape(
                left.shape
            )
        changes = found[:, :-1, 2:] * self.of_price[:, None]
        changes[..., 1] *= self.length[:, None]
        return found[..., :2], changes

    def _bands(self) -> FloatArray:
        """Return the matrix as LAPACK's banded LU takes it."""
        rows = np.zeros((2 * _BANDS + 1, *self.row.shape, 4))  # by place beside the diagonal, by row
        at = {beside: rows[_BANDS + beside] for beside in range(-_BANDS, _BANDS + 1)}
        seen = self.count * self.row
        at[0][..., 0], at[0][..., 1] = seen * self.row + _RIDGE, self.count + _RIDGE
        at[1][..., 0], at[-1][..., 1] = seen, seen
        at[0][..., 2:] = 1.0  # the last frame has no next one: its prices are 0
        at[0][:, :-1, 2:] = -self.of_price[:, None]
        across, along = self.across, self.along
        at[2][:, :-1, 0], at[-2][:, 1:, 0] = -1.0, 1.0
        at[3][:, :-1, 0], at[-1][:, 1:, 0] = -across, across
        at[2][:, :-1, 1], at[-2][:, 1:, 1] = -along, along
        first, second = self.of_change[:, :1], self.of_change[:, 1:]
        at[-2][:, :-1, 2], at[2][:, :-1, 2] = -first, first
        at[-3][:, :-1, 3], at[1][:, :-1, 3] = -second * across, second * across
        at[-2][:, :-1, 3], at[2][:, :-1, 3] = -second * along, second * along
        bands = np.zeros((3 * _BANDS + 1, self.row.size * 4), order="F")
        for beside, values in at.items():
            bands[2 * _BANDS - beside] = np.roll(values.ravel(), beside)
        return bands

    def _left_over(self, found: FloatArray) -> FloatArray:
        """Return right sides less left ones, without the ridge."""
        p, c, of_p, of_b = np.moveaxis(found, -1, 0)
        apart = self.total - self.count * (self.row * p + c)
        pull = np.stack([of_p + self.across * of_b, self.along * of_b], axis=-1)
        left = np.zeros_like(found)
        left[..., 0], left[..., 1] = self.row * apart, apart
        left[..., :2] += pull
        left[:, 1:, :2] -= pull[:, :-1]
        changed = np.diff(found[..., :2], axis=1)
        along_both = np.stack(
            [changed[..., 0], self.across * changed[..., 0] + self.along * changed[..., 1]], axis=-1
        )
        left[:, :-1, 2:] = self.of_price[:, None] * found[:, :-1, 2:] - self.of_change[:, None] * along_both
        return left


def _best_constant(values: FloatArray, targets: FloatArray, unit: FloatArray) -> FloatArray:
    """Return the p and c (dofs, 2) that fit best where they do not change; scale 1 of what does not move."""
    about, level = values.mean(axis=0), targets.mean(axis=0)
    spread = ((values - about) ** 2).sum(axis=0)
    moves = spread > _STILL**2 * len(values)
    slope = np.divide(
        ((values - about) * (targets - level)).sum(axis=0), spread, out=unit.copy(), where=moves
    )
    return np.stack([slope, level - slope * about], axis=1)


def _frames(place: FloatArray, changes: FloatArray, prices: FloatArray) -> FloatArray:
    """Return (n, dofs): what is found for each frame, or where changes are dear the first and its changes.

    So rounding, which differs from frame to frame, is not paid for.
    """
    summed = np.concatenate([place[:, :1], changes], axis=1).cumsum(axis=1)
    return np.where(prices[:, None] >= 1, summed, place).T
