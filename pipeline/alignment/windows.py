"""Windows: the cells of a cost matrix that a warping path may visit.

    Sakoe-Chiba [Sakoe & Chiba 1978]   a band around the straight line between the corners
    Itakura [Itakura 1975]             a parallelogram: from either corner no further than a slope leads

A cell is a unit square. A band holds the cells whose middle lies near enough to the line, and those that the
line crosses, so that lengths that differ leave a path however narrow it is; a parallelogram holds the cells
that it touches. The rivals bound the middle of a cell alone, which cuts the path where one sequence is the
longer, or bound |i - j|, which shuts out the last cell. Steps are not bounded here, only cells: within a
window a path may still stand still.

Rows are frames of the moving sequence, columns frames of the reference; with their roles exchanged, either
window is transposed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.motion import FloatArray

Limits = tuple[NDArray[np.int64], NDArray[np.int64]]

_ROUNDING = 1e-9  # of places in frames: what lies on the bound is inside
_STEEPEST = 1e15  # frames a frame: as good as upright for any length, and far from overflow


@runtime_checkable
class Window(Protocol):
    """What bounds a path."""

    def limits(self, m: int, n: int) -> Limits:
        """Return the first and the last reference frame (m,) that each of m moving frames may meet.

        Parameters
        ----------
        m, n : int
            Frames of the moving sequence and of the reference.

        Returns
        -------
        first, last : array (m,) int64
            Inclusive.

        Raises
        ------
        ValueError
            No path leads from the first cell to the last.
        """
        ...


@dataclass(frozen=True)
class SakoeChiba:
    """A band around the straight line between the corners.

    Parameters
    ----------
    radius : float
        How far from the line a cell may lie, along the longer sequence and as a share of its length. From 1
        on all cells are inside.

    Raises
    ------
    ValueError
        The radius is negative or not finite.
    """

    radius: float = 0.1

    def __post_init__(self) -> None:
        if not 0 <= self.radius < np.inf:
            raise ValueError(f"radius is {self.radius}; it is a share of the longer length, 0 or more")

    def limits(self, m: int, n: int) -> Limits:
        """Return the first and the last column of every row; there always is a path.

        Parameters
        ----------
        m, n : int
            Frames of the moving sequence and of the reference, at least 1.

        Returns
        -------
        first, last : array (m,) int64
            Inclusive.

        Raises
        ------
        ValueError
            A sequence has no frame.
        """
        _check_lengths(m, n)
        if min(m, n) == 1:
            return np.zeros(m, dtype=np.int64), np.full(m, n - 1)
        slope = (n - 1) / (m - 1)
        steep = max(slope, 1 / slope)
        # Along the longer sequence: what the radius allows, and just less than what the line crosses.
        reach = max(min(self.radius, 1.0) * max(m, n), (1 + steep) / 2 - 2 * _ROUNDING * steep)
        columns = reach * min(slope, 1.0)
        middle = np.arange(m) * slope
        return _whole(middle - columns, middle + columns, n)


@dataclass(frozen=True)
class Itakura:
    """The parallelogram whose sides leave both corners with the greatest slope and the least.

    Parameters
    ----------
    slope : float
        How many times as fast as the other either sequence may pass, 1 or more.

    Raises
    ------
    ValueError
        The slope is under 1 or not finite.
    """

    slope: float = 2.0

    def __post_init__(self) -> None:
        if not 1 <= self.slope < np.inf:
            raise ValueError(f"slope is {self.slope}; it is the greatest ratio of both speeds, 1 or more")

    def limits(self, m: int, n: int) -> Limits:
        """Return the first and the last column of every row.

        Parameters
        ----------
        m, n : int
            Frames of the moving sequence and of the reference, at least 1.

        Returns
        -------
        first, last : array (m,) int64
            Inclusive.

        Raises
        ------
        ValueError
            A sequence has no frame, or the lengths differ by more than the slope allows.
        """
        _check_lengths(m, n)
        slope = min(self.slope, _STEEPEST)
        shorter, longer = min(m, n) - 1, max(m, n) - 1
        if longer > slope * shorter * (1 + _ROUNDING):
            mend = f"a slope of {longer / shorter:.3g} or more" if shorter else "more than one frame of each"
            raise ValueError(
                f"an Itakura window of slope {self.slope:g} leaves no path between {m} moving and {n} "
                f"reference frames: it needs {mend}; else bring them nearer in length first, by `uniform`"
            )
        rows = np.arange(m)
        early, late = _from_corner(rows, slope)
        back_late, back_early = _from_corner(rows[::-1], slope)
        return _whole(np.maximum(early, n - 1 - back_early), np.minimum(late, n - 1 - back_late), n)


def _from_corner(rows: NDArray[np.int64], slope: float) -> tuple[FloatArray, FloatArray]:
    """Bound the columns whose squares meet the two sides that leave the first corner."""
    inside = 0.5 - 2 * _ROUNDING  # half a square: one that is met in a corner alone is not met
    return (rows - inside) / slope - inside, (rows + inside) * slope + inside


def check_window(window: Window | None) -> None:
    """Raise TypeError where this is no window, and not None."""
    if window is not None and (isinstance(window, type) or not isinstance(window, Window)):
        raise TypeError(
            f"window is {window!r}; it must be a window such as SakoeChiba(0.1) or Itakura(2.0), or None"
        )


def _whole(low: FloatArray, high: FloatArray, n: int) -> Limits:
    """Return the first and the last of n columns within each row's bounds."""
    first = np.ceil(np.maximum(low - _ROUNDING, 0)).astype(np.int64)
    last = np.floor(np.minimum(high + _ROUNDING, n - 1)).astype(np.int64)
    return first, last


def _check_lengths(m: int, n: int) -> None:
    if m < 1 or n < 1:
        raise ValueError(f"{m} and {n} frames: a window needs one frame of each sequence or more")
