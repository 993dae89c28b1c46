import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.dtw import derivative_dtw, derivatives, dtw, nearest_path
from motionary.pipeline.alignment.windows import Itakura, SakoeChiba


def slow_derivatives(values: np.ndarray) -> np.ndarray:
    """Estimate one frame after another, as Keogh and Pazzani print it."""
    found = np.zeros(values.shape)
    for i in range(1, len(values) - 1):
        found[i] = ((values[i] - values[i - 1]) + (values[i + 1] - values[i - 1]) / 2) / 2
    found[0], found[-1] = found[1], found[-2]
    return found


@given(frames=st.integers(3, 30), dofs=st.integers(1, 4), seed=st.integers(0, 10_000))
@settings(max_examples=50, deadline=None)
def test_derivatives_are_the_published_estimate(frames: int, dofs: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(frames, dofs))
    np.testing.assert_allclose(derivatives(values), slow_derivatives(values), atol=1e-12)


def test_derivatives_of_few_frames() -> None:
    assert derivatives(np.array([[3.0, 1.0]])).tolist() == [[0.0, 0.0]]
    assert derivatives(np.array([[3.0], [5.0]])).tolist() == [[2.0], [2.0]]
    assert derivatives(np.array([[0], [1], [4]])).tolist() == [[1.5]] * 3
    line = np.arange(9.0)[:, None] * [2.0, -1.0]
    np.testing.assert_array_equal(derivatives(line), np.tile([2.0, -1.0], (9, 1)))


def test_an_offset_changes_nothing_for_derivatives_and_much_for_frames() -> None:
    rng = np.random.default_rng(1)
    reference = np.round(rng.normal(size=(40, 3)).cumsum(axis=0) * 64)
    moving = reference[np.sort(rng.integers(0, 40, 50))]
    offset = np.array([512.0, -256.0, 64.0])
    kept = derivative_dtw(moving, reference)
    np.testing.assert_array_equal(derivative_dtw(moving + offset, reference).path, kept.path)
    assert not np.array_equal(dtw(moving + offset, reference).path, dtw(moving, reference).path)


def test_derivatives_find_a_warp_again_below_an_offset() -> None:
    time = np.linspace(0, 1, 120)
    curve = lambda t: np.stack([np.sin(9 * t), np.cos(7 * t)], axis=1)  # noqa: E731
    truth = time ** (1 / 1.3) * 119
    errors = {
        align.__name__: np.abs(align(curve(time**1.3) + 1.5, curve(time)).source_time - truth).mean()
        for align in (dtw, derivative_dtw)
    }
    assert errors["derivative_dtw"] < 3 < errors["dtw"]


@given(m=st.integers(10, 30), n=st.integers(10, 20), seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_window_holds_the_path(m: int, n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    moving, reference = (rng.normal(size=(frames, 2)).cumsum(axis=0) for frames in (m, n))
    for window in (SakoeChiba(0.1), Itakura(4.0)):
        first, last = window.limits(m, n)
        for align in (dtw, derivative_dtw):
            path = align(moving, reference, np.array([1.0, 0.5]), window).path
            assert ((path[:, 1] >= first[path[:, 0]]) & (path[:, 1] <= last[path[:, 0]])).all()
    everywhere = dtw(moving, reference, window=SakoeChiba(1.0))
    np.testing.assert_array_equal(everywhere.path, dtw(moving, reference).path)


def test_weights_and_derivatives_go_together() -> None:
    moving, reference = np.random.default_rng(4).normal(size=(2, 30, 3)).cumsum(axis=1)
    weights = np.array([1.0, 0.0, 4.0])
    kept = derivative_dtw(moving[:, [0, 2]], reference[:, [0, 2]], weights[[0, 2]])
    np.testing.assert_array_equal(derivative_dtw(moving, reference, weights).path, kept.path)


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 6), (6, 1), (2, 5), (2, 2)])
def test_few_frames_have_a_warp(m: int, n: int) -> None:
    rng = np.random.default_rng(m * n)
    moving, reference = rng.normal(size=(m, 2)), rng.normal(size=(n, 2))
    for align in (dtw, derivative_dtw):
        for window in (None, SakoeChiba()):
            warp = align(moving, reference, window=window)
            assert warp.reference_frames == n
            assert warp.path[-1].tolist() == [m - 1, n - 1]


def test_a_constant_channel_has_a_warp_and_what_is_no_number_none() -> None:
    flat = np.ones((7, 2))
    np.testing.assert_array_equal(
        derivative_dtw(flat, flat + 5).path, np.repeat(np.arange(7)[:, None], 2, axis=1)
    )
    broken = flat.copy()
    broken[3, 1] = np.nan
    for align in (dtw, derivative_dtw):
        with pytest.raises(ValueError, match="moving holds nan at frame 3, DOF 1"):
            align(broken, flat)
    with pytest.raises(ValueError, match="values holds nan"):
        derivatives(broken)
    with pytest.raises(ValueError, match="no path between 7 moving and 3"):
        dtw(flat, flat[:3], window=Itakura(2.0))


@pytest.mark.parametrize("align", [dtw, derivative_dtw, nearest_path])
@pytest.mark.parametrize(
    ("dtype", "exponent"), [("f8", -400), ("f8", -996), ("f8", -1020), ("f4", -100), ("f4", 120)]
)
def test_the_unit_changes_nothing_however_small_or_large(align, dtype: str, exponent: int) -> None:
    rng = np.random.default_rng(5)
    moving, reference = (rng.normal(size=(n, 3)).cumsum(axis=0).astype(dtype) for n in (30, 25))
    path = [getattr(warp, "path", warp) for warp in (
        align(moving, reference), align(np.ldexp(moving, exponent), np.ldexp(reference, exponent))
    )]  # fmt: skip
    np.testing.assert_array_equal(*path)
    if align is dtw:
        window = SakoeChiba(0.3)
        small = dtw(np.ldexp(moving, exponent), np.ldexp(reference, exponent), window=window)
        np.testing.assert_array_equal(small.path, dtw(moving, reference, window=window).path)


@pytest.mark.parametrize("window", [0.1, "itakura", SakoeChiba, Itakura])
@pytest.mark.parametrize("align", [dtw, derivative_dtw])
def test_what_is_no_window_is_refused(align, window) -> None:
    with pytest.raises(TypeError, match=r"window is .*; it must be .* SakoeChiba\(0.1\) or Itakura\(2.0\)"):
        align(np.zeros((4, 1)), np.zeros((4, 1)), window=window)
