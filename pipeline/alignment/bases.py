"""Warps as sums of monotone functions, p = Q a [GTW 4.2].

A basis holds k functions of l steps, each rising from 0 at the first to n - 1 at the last, n being the frames
of the sequence that is warped; weights of 0 or more make a path that never falls. The constant one, n - 1 at
every step, lets a path begin later than frame 0. Frames count from 0 (the paper's from 1). So weights have no
unit: those of a sequence serve for the same sequence at another rate.

The paper names the families and not their parameters. Here x goes from 0 to 1 over the steps, and of k
functions of a family the j-th (from 1) is

- ``polynomial``: x^b with b = 1, 2, 1/2, 3, 1/3, ..., so that one of them is the straight line;
- ``exponential``: exp(2 j x), and ``logarithm``: log(1 + (exp(2 j) - 1) x), its inverse;
- ``tanh``: tanh(2 k (x - c)), c = (j - 1/2) / k: steps side by side that together are nearly a line;
- ``ispline``: the sum of the cubic B-splines from the j-th on, over equal knots (of degree k where k < 3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.interpolate import BSpline

from motionary.pipeline.motion import FloatArray

USUAL_BASES: Mapping[str, int] = MappingProxyType({"constant": 1, "polynomial": 3, "tanh": 3})
"""Three tanh and three polynomial functions [GTW 5.2], and the constant one for sub-sequences."""

MORE_BASES: Mapping[str, int] = MappingProxyType({"constant": 1, "polynomial": 5, "tanh": 5})
"""Five of each, as [GTW 5.3] takes."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Functions that make a warp of one sequence.

    Parameters
    ----------
    values : array (l, k)
        Q: each column rises from 0 to `frames` - 1, or is `frames` - 1 throughout.
    free : int
        How many of the columns, from the first on, are constant: their weights may have any sign.
    frames : int
        n, frames of the sequence that is warped.
    """

    values: FloatArray
    free: int
    frames: int

    def path(self, weights: FloatArray) -> FloatArray:
        """Return Q a (l,), the frame shown at each step; rounding neither leaves 0 .. n - 1 nor falls."""
        return np.maximum.accumulate(np.clip(self.values @ weights, 0, self.frames - 1))


def monotone_basis(bases: Mapping[str, int], frames: int, steps: int) -> Basis:
    """Make a basis by name and number.

    Parameters
    ----------
    bases : mapping of str to int
        How many functions of each family: "constant" (1 at most), "polynomial", "exponential", "logarithm",
        "tanh", "ispline". At least one must rise.
    frames : int
        n, of the sequence that is warped.
    steps : int
        l.

    Returns
    -------
    Basis
        The constant function first, the others in the order of `bases`.

    Raises
    ------
    ValueError
        A name is none of these, a number is not positive, there are two constants or no function that rises.
    """
    for name, number in bases.items():
        if name != "constant" and name not in FAMILIES:
            raise ValueError(
                f"there is no basis {name!r}; there are 'constant', {', '.join(map(repr, FAMILIES))}"
            )
        if number < 1 or (name == "constant" and number > 1):
            raise ValueError(
                f"{number} functions are asked of basis {name!r}; "
                + ("a second constant would be the first" if name == "constant" else "at least 1 is needed")
            )
    x = np.linspace(0, 1, steps) if steps > 1 else np.zeros(1)
    rising = [FAMILIES[name](x, number) for name, number in bases.items() if name != "constant"]
    if not rising:
        raise ValueError(f"bases {dict(bases)} hold no function that rises; add one, as 'polynomial': 1")
    free = bases.get("constant", 0)
    columns = np.concatenate([np.ones((steps, free)), *rising], axis=1)
    return Basis(columns * (frames - 1), free, frames)


def _polynomial(x: FloatArray, number: int) -> FloatArray:
    place = np.arange(1, number + 1)
    whole = 1.0 + place // 2  # 1, 2, 2, 3, 3, ...
    exponents = np.where(place % 2, 1 / whole, whole)
    return x[:, None] ** exponents


def _exponential(x: FloatArray, number: int) -> FloatArray:
    rate = 2.0 * np.arange(1, number + 1)
    return np.expm1(x[:, None] * rate) / np.expm1(rate)


def _logarithm(x: FloatArray, number: int) -> FloatArray:
    rate = 2.0 * np.arange(1, number + 1)
    return np.log1p(np.expm1(rate) * x[:, None]) / rate


def _tanh(x: FloatArray, number: int) -> FloatArray:
    centres = (np.arange(number) + 0.5) / number
    rising = np.tanh(2 * number * (x[:, None] - centres))
    first, last = np.tanh(-2 * number * centres), np.tanh(2 * number * (1 - centres))
    return (rising - first) / (last - first)


def _ispline(x: FloatArray, number: int) -> FloatArray:
    degree = min(3, number)
    inner = np.linspace(0, 1, number - degree + 2)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    bumps = BSpline.design_matrix(x, knots, degree).toarray()  # (l, number + 1)
    return np.cumsum(bumps[:, :0:-1], axis=1)[:, ::-1]


FAMILIES: Mapping[str, Callable[[FloatArray, int], FloatArray]] = MappingProxyType(
    {
        "polynomial": _polynomial,
        "exponential": _exponential,
        "logarithm": _logarithm,
        "tanh": _tanh,
        "ispline": _ispline,
    }
)
"""Functions of x (l,) and k that rise from 0 to 1: (l, k)."""
