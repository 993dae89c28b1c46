from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import banded_kernels
from motionary.pipeline.alignment.banded import banded_path
from motionary.pipeline.alignment.windows import SakoeChiba
from motionary.pipeline.distances import cost_matrix, dtw_path

Cell = tuple[int, int]


def everything(m: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(m, dtype=int), np.full(m, n - 1)


def exact_path(cost: np.ndarray, first: np.ndarray, last: np.ndarray, weight: Fraction) -> list[Cell] | None:
    """Follow the recurrence in fractions: the least (total, length), diagonal before down before across."""
    best: dict[Cell, tuple[tuple[Fraction, int], Cell | None]] = {}
    for i, j in np.ndindex(cost.shape):
        if not first[i] <= j <= last[i]:
            continue
        come = [
            ((best[cell][0][0] * factor, best[cell][0][1]), cell)
            for cell, factor in (((i - 1, j - 1), 1), ((i - 1, j), weight), ((i, j - 1), weight))
            if cell in best
        ]
        if come:
            (total, length), before = min(come, key=lambda one: one[0])
        elif (i, j) == (0, 0):
            total, length, before = Fraction(0), 0, None
        else:
            continue
        best[i, j] = (total + Fraction(float(cost[i, j])), length + 1), before
    end: Cell | None = (cost.shape[0] - 1, cost.shape[1] - 1)
    if end not in best:
        return None
    path = []
    while end is not None:
        path.append(end)
        end = best[end][1]
    return path[::-1]


def exact_total(cost: np.ndarray, path: np.ndarray, weight: Fraction) -> Fraction:
    total = Fraction(float(cost[0, 0]))
    for (i, j), (p, q) in zip(path[:-1], path[1:], strict=True):
        total = total * (1 if p > i and q > j else weight) + Fraction(float(cost[p, q]))
    return total


@st.composite
def clips(draw, whole: bool = False) -> tuple[np.ndarray, np.ndarray]:
    m, n, d = (draw(st.integers(1, most)) for most in (20, 20, 3))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    a, b = (rng.normal(size=(frames, d)) * 1.5 for frames in (m, n))
    if whole:
        a, b = np.round(a[:, :1]), np.round(b[:, :1])
    kind = draw(st.sampled_from([np.float32, np.float64]))
    return a.astype(kind), b.astype(kind)


@st.composite
def windows(draw, m: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    first, last = np.sort(rng.integers(0, n, (2, m)), axis=0)
    first[0], last[-1] = 0, n - 1
    return first, last


@given(pair=st.one_of(clips(), clips(whole=True)))
@settings(max_examples=100, deadline=None)
def test_all_cells_at_weight_1_give_the_path_of_dtw(pair: tuple[np.ndarray, np.ndarray]) -> None:
    a, b = pair
    path = banded_path(a, b, *everything(len(a), len(b)))
    np.testing.assert_array_equal(path, dtw_path(cost_matrix(a, b)))


@given(data=st.data(), weight=st.sampled_from([1, 2, 3]))
@settings(max_examples=120, deadline=None)
def test_whole_costs_give_the_exact_path_in_any_window(data, weight: int) -> None:
    a, b = data.draw(clips(whole=True))
    first, last = data.draw(windows(len(a), len(b)))
    expected = exact_path(cost_matrix(a, b), first, last, Fraction(weight))
    if expected is None:
        with pytest.raises(ValueError, match="leaves no path"):
            banded_path(a, b, first, last, weight)
    else:
        assert list(map(tuple, banded_path(a, b, first, last, weight).tolist())) == expected


@given(pair=clips(), weight=st.sampled_from([1.0, 1.25, 1.7, 4.0]))
@settings(max_examples=80, deadline=None)
def test_any_costs_give_the_least_total_up_to_rounding(
    pair: tuple[np.ndarray, np.ndarray], weight: float
) -> None:
    a, b = pair
    window = everything(len(a), len(b))
    cost, factor = cost_matrix(a, b), Fraction(weight)
    least = exact_total(cost, np.array(exact_path(cost, *window, factor)), factor)
    found = exact_total(cost, banded_path(a, b, *window, weight), factor)
    assert least <= found <= least * (1 + Fraction(1, 10**6))


@pytest.mark.parametrize(("weight", "frames"), [(2.0, 1500), (8.0, 700), (1e6, 90)])
def test_stays_that_overflow_a_float_are_told_apart(weight: float, frames: int) -> None:
    rng = np.random.default_rng(3)
    a, b = np.round(rng.normal(size=(3, 1)) * 4), np.round(rng.normal(size=(frames, 1)) * 4)
    path = banded_path(a, b, *everything(3, frames), weight)
    cost, factor = cost_matrix(a, b), Fraction(weight)
    expected = np.array(exact_path(cost, *everything(3, frames), factor))
    least, found = exact_total(cost, expected, factor), exact_total(cost, path, factor)
    assert Fraction(np.finfo(np.float64).max) < least <= found <= least * (1 + Fraction(1, 10**9))


def test_a_stay_is_cheapest_where_little_has_been_accumulated() -> None:
    # What the recurrence does, and the reason for a window: all standing still goes to the beginning.
    time = np.linspace(0, 1, 120)[:, None]
    path = banded_path(np.sin(9 * time[::2]), np.sin(9 * time) + 0.3, *everything(60, 120), 2.0)
    straight = np.flatnonzero((np.diff(path, axis=0) == 0).any(axis=1))
    assert len(straight) >= 60
    assert path[straight, 0].max() < 4


@given(pair=clips(), radius=st.sampled_from([0.0, 0.1, 0.4]))
@settings(max_examples=60, deadline=None)
def test_a_path_keeps_to_its_window(pair: tuple[np.ndarray, np.ndarray], radius: float) -> None:
    a, b = pair
    first, last = SakoeChiba(radius).limits(len(a), len(b))
    path = banded_path(a, b, first, last)
    assert ((path[:, 1] >= first[path[:, 0]]) & (path[:, 1] <= last[path[:, 0]])).all()
    # The least total among those: costs outside are as good as infinite.
    cost = cost_matrix(a, b).astype(float)
    columns = np.arange(len(b))
    outside = (columns < first[:, None]) | (columns > last[:, None])
    walled = np.where(outside, 1e3 * (1 + cost.max()), cost)
    expected = walled[tuple(dtw_path(walled).T)].sum()
    assert walled[tuple(path.T)].sum() == pytest.approx(expected, rel=1e-9)


def test_only_the_windows_cells_are_computed(monkeypatch) -> None:
    computed = []
    fill = banded_kernels.fill_costs
    monkeypatch.setattr(
        banded_kernels, "fill_costs", lambda *all_: computed.append(len(all_[-1])) or fill(*all_)
    )
    values = np.random.default_rng(0).normal(size=(20_000, 2)).cumsum(axis=0)
    first, last = SakoeChiba(0.001).limits(20_000, 20_000)
    banded_path(values, values[::-1], first, last)
    assert computed == [(last - first + 1).sum()]
    assert computed[0] < 41 * 20_000


def test_what_cannot_be_sought_is_refused() -> None:
    a, b = np.zeros((3, 1)), np.zeros((4, 1))
    with pytest.raises(ValueError, match="slope_weight is 0.5"):
        banded_path(a, b, [0, 0, 0], [3, 3, 3], 0.5)
    with pytest.raises(ValueError, match="slope_weight is nan"):
        banded_path(a, b, [0, 0, 0], [3, 3, 3], np.nan)
    with pytest.raises(ValueError, match="last has shape \\(2,\\)"):
        banded_path(a, b, [0, 0, 0], [3, 3])
    with pytest.raises(ValueError, match="first has shape \\(3,\\) and type float64"):
        banded_path(a, b, [0.0, 0, 0], [3, 3, 3])
    with pytest.raises(ValueError, match="from column 2 to 1 in row 1"):
        banded_path(a, b, [0, 2, 0], [3, 1, 3])
    with pytest.raises(ValueError, match="within 0 to 3"):
        banded_path(a, b, [0, 0, 0], [3, 4, 3])
    with pytest.raises(ValueError, match="must go from 0 to 3"):
        banded_path(a, b, [0, 0, 0], [3, 3, 2])
    with pytest.raises(ValueError, match="leaves no path through 3 and 4 frames"):
        banded_path(a, b, [0, 3, 3], [1, 3, 3])
    with pytest.raises(ValueError, match="dimension"):
        banded_path(a, np.zeros((4, 2)), [0, 0, 0], [3, 3, 3])
    with pytest.raises(ValueError, match="not a finite number"):
        banded_path(a * np.nan, b, [0, 0, 0], [3, 3, 3])
