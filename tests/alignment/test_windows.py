from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.windows import Itakura, SakoeChiba, Window

lengths = st.integers(1, 40)


def cells(window: Window, m: int, n: int) -> np.ndarray:
    first, last = window.limits(m, n)
    columns = np.arange(n)
    return (columns >= first[:, None]) & (columns <= last[:, None])


def has_path(inside: np.ndarray) -> bool:
    """Tell whether unit steps lead from corner to corner, cell by cell."""
    reached = np.zeros_like(inside)
    for i, j in np.ndindex(inside.shape):
        before = [(i - 1, j - 1), (i - 1, j), (i, j - 1)]
        begun = (i, j) == (0, 0) or any(reached[p, q] for p, q in before if p >= 0 and q >= 0)
        reached[i, j] = inside[i, j] and begun
    return bool(reached[-1, -1])


def slow_band(m: int, n: int, radius: Fraction) -> np.ndarray:
    """Keep cells whose middle is near the line, along the longer sequence, and those that it crosses."""
    if m > n:
        return slow_band(n, m, radius).T
    inside = np.ones((m, n), dtype=bool)
    for i, j in np.ndindex(m, n):
        if m > 1:
            slope = Fraction(n - 1, m - 1)
            away = abs(j - i * slope)
            inside[i, j] = away <= radius * n or away < (1 + slope) / 2
    return inside


def slow_parallelogram(m: int, n: int, slope: Fraction) -> np.ndarray:
    """Keep cells whose open square meets all four half-planes."""
    inside = np.zeros((m, n), dtype=bool)
    half = Fraction(1, 2)
    for i, j in np.ndindex(m, n):
        sides = []
        for x, y in ((i, j), (m - 1 - i, n - 1 - j)):
            sides += [y - half < slope * (x + half), y + half > (x - half) / slope]
        inside[i, j] = all(sides)
    return inside


@given(m=lengths, n=lengths, radius=st.sampled_from([0.0, 0.05, 0.1, 0.25, 1.0]))
@settings(max_examples=150, deadline=None)
def test_a_band_is_what_its_definition_says_and_always_has_a_path(m: int, n: int, radius: float) -> None:
    inside = cells(SakoeChiba(radius), m, n)
    np.testing.assert_array_equal(inside, slow_band(m, n, Fraction(str(radius))))
    np.testing.assert_array_equal(inside.T, cells(SakoeChiba(radius), n, m))
    assert has_path(inside)


@given(m=lengths, n=lengths, slope=st.sampled_from([1.0, 1.5, 2.0, 3.0]))
@settings(max_examples=150, deadline=None)
def test_a_parallelogram_has_a_path_just_where_its_slope_admits_the_lengths(
    m: int, n: int, slope: float
) -> None:
    shorter, longer = min(m, n) - 1, max(m, n) - 1
    if longer > slope * shorter:
        with pytest.raises(ValueError, match=f"no path between {m} moving and {n} reference frames"):
            Itakura(slope).limits(m, n)
        return
    inside = cells(Itakura(slope), m, n)
    np.testing.assert_array_equal(inside, slow_parallelogram(m, n, Fraction(str(slope))))
    np.testing.assert_array_equal(inside.T, cells(Itakura(slope), n, m))
    assert has_path(inside)


def test_worked_examples() -> None:
    np.testing.assert_array_equal(cells(SakoeChiba(0), 6, 6), np.eye(6, dtype=bool))
    np.testing.assert_array_equal(cells(Itakura(1), 6, 6), np.eye(6, dtype=bool))
    first, last = SakoeChiba(0.1).limits(100, 100)
    assert (first[50], last[50], first[3], last[99]) == (40, 60, 0, 99)
    first, last = Itakura(2.0).limits(101, 101)
    assert (first[0], last[0], first[100], last[100]) == (0, 1, 99, 100)
    assert (first[50], last[50]) == (25, 75)
    assert cells(SakoeChiba(1.0), 7, 19).all()


def test_what_leaves_no_path_says_which_slope_would() -> None:
    with pytest.raises(ValueError, match="a slope of 3 or more; else .* `uniform`"):
        Itakura(2.0).limits(11, 31)
    assert has_path(cells(Itakura(3.0), 11, 31))
    with pytest.raises(ValueError, match="more than one frame of each"):
        Itakura(2.0).limits(1, 5)
    assert cells(Itakura(2.0), 1, 1).all()


@pytest.mark.parametrize("radius", [-0.1, np.nan, np.inf])
def test_a_band_needs_a_width(radius: float) -> None:
    with pytest.raises(ValueError, match="radius is"):
        SakoeChiba(radius)


@pytest.mark.parametrize("slope", [0.5, np.nan, np.inf])
def test_a_parallelogram_needs_a_slope(slope: float) -> None:
    with pytest.raises(ValueError, match="slope is"):
        Itakura(slope)


@pytest.mark.parametrize("window", [SakoeChiba(), Itakura()])
def test_nothing_has_no_window(window: Window) -> None:
    with pytest.raises(ValueError, match="0 and 3 frames"):
        window.limits(0, 3)


@pytest.mark.parametrize("greatest", [1.7e308, np.float64(1.7e308)])
def test_a_window_of_any_size_holds_all_cells(greatest: float) -> None:
    for window in (SakoeChiba(greatest), Itakura(greatest)):
        assert cells(window, 40, 7).all()
