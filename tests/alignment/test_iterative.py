"""Iterative motion warping: its linear solve against a dense one, and what it must find and keep."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.iterative import iterative_motion_warping
from motionary.pipeline.alignment.scale_and_offset import fit_scale_and_offset


def dense_fit(values, frames, targets, lambda_a, lambda_b):
    """Solve by rows of the definition, a DOF at a time; of all solutions the nearest to scale 1, offset 0."""
    n = len(values)
    scale, offset = np.empty(values.shape), np.empty(values.shape)
    for dof in range(values.shape[1]):
        rows, right = [], []
        for step, frame in enumerate(frames):
            rows.append(np.zeros(2 * n))
            rows[-1][[frame, n + frame]] = values[frame, dof], 1
            right.append(targets[step, dof])
        for first, weight in ((0, lambda_a), (n, lambda_b)):
            for i in range(n - 1):
                rows.append(np.zeros(2 * n))
                rows[-1][[first + i, first + i + 1]] = -np.sqrt(weight), np.sqrt(weight)
                right.append(0.0)
        known = np.repeat([1.0, 0.0], n)
        matrix = np.array(rows)
        found = known + np.linalg.lstsq(matrix, np.array(right) - matrix @ known, rcond=1e-10)[0]
        scale[:, dof], offset[:, dof] = found[:n], found[n:]
    return scale, offset


@given(
    frames=st.integers(2, 14), steps=st.integers(8, 30), seed=st.integers(0, 9999), units=st.floats(1e-3, 1e3)
)
@settings(max_examples=40, deadline=None)
def test_the_solve_is_the_dense_one(frames: int, steps: int, seed: int, units: float) -> None:
    rng = np.random.default_rng(seed)
    values, shown = rng.normal(size=(frames, 3)), rng.integers(0, frames, steps)
    shown[:2] = 0, frames - 1  # of one frame alone, scale and offset could not be told apart
    targets = rng.normal(size=(steps, 3))
    found = fit_scale_and_offset(values * units, shown, targets, 7.0 * units**2, 3.0)
    expected = dense_fit(values, shown, targets, 7.0, 3.0)
    np.testing.assert_allclose(found[0] * units, expected[0], rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("smoothness", [(0.0, 0.0), (0.0, 5.0), (5.0, 0.0), (1e7, 1e7)])
def test_what_is_left_open_still_fits(smoothness: tuple[float, float]) -> None:
    rng = np.random.default_rng(0)
    values, shown = rng.normal(size=(9, 3)), np.sort(rng.integers(0, 9, 7))
    values[:, 1], values[:, 2] = 0, 4
    targets = rng.normal(size=(7, 3))
    scale, offset = fit_scale_and_offset(values, shown, targets, *smoothness)
    dense_scale, dense_offset = dense_fit(values, shown, targets, *smoothness)
    fitted, expected = (scale * values + offset)[shown], (dense_scale * values + dense_offset)[shown]
    np.testing.assert_allclose(fitted, expected, atol=1e-4)
    assert (scale[:, 1] == 1).all()  # of what is 0, no target tells a scale
    if smoothness == (0.0, 0.0):
        unseen = np.setdiff1d(np.arange(9), shown)
        assert len(unseen)
        for dof, slope in (
            (0, np.polyfit(values[shown, 0], targets[:, 0], 1)),
            (1, (1, targets[:, 1].mean())),
        ):
            np.testing.assert_allclose(scale[unseen, dof], slope[0], rtol=1e-9)
            np.testing.assert_allclose(offset[unseen, dof], slope[1], rtol=1e-9)


def fitted_energy(scale, offset, values, shown, targets, lambda_a, lambda_b) -> float:
    apart = (scale * values + offset)[shown] - targets
    changes = lambda_a * (np.diff(scale, axis=0) ** 2).sum() + lambda_b * (np.diff(offset, axis=0) ** 2).sum()
    return float((apart**2).sum() + changes)


LAMBDAS = st.one_of(st.just(0.0), st.floats(-6, 12).map(lambda power: 10.0**power))


@given(
    shape=st.tuples(st.integers(1, 25), st.integers(1, 40)),
    seed=st.integers(0, 9999),
    powers=st.tuples(st.floats(-6, 6), st.floats(-6, 6)),
    offsets=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)),
    lambdas=st.tuples(LAMBDAS, LAMBDAS),
)
@settings(max_examples=150, deadline=None)
def test_no_least_squares_solution_costs_less(
    shape: tuple, seed: int, powers: tuple, offsets: tuple, lambdas: tuple
) -> None:
    """The energy is that of a dense solution at the most, but for the rounding of what is written down."""
    rng = np.random.default_rng(seed)
    n, steps = shape
    own, other = (10.0**power for power in powers)
    values = own * (rng.normal(size=(n, 1)).cumsum(axis=0) + offsets[0])
    shown = np.sort(rng.integers(0, n, steps))
    targets = other * rng.normal(size=(steps, 1)).cumsum(axis=0) + offsets[1]
    case = values, shown, targets, *lambdas
    scale, offset = fit_scale_and_offset(*case)
    dense = np.inf
    for unit in (1.0, np.abs(values).max()):  # of both the better one
        known = dense_fit(values / unit, shown, targets, lambdas[0] / unit**2, lambdas[1])
        dense = min(dense, fitted_energy(known[0] / unit, known[1], *case))
    greatest, moved = np.abs(scale).max(), np.abs(offset).max()
    written = steps * (greatest * np.abs(values).max() + moved) ** 2
    rounding = 1e-30 * (written + n * (lambdas[0] * greatest**2 + lambdas[1] * moved**2))
    about = targets - targets.mean(axis=0)
    most = (np.sqrt(dense * (1 + 1e-9)) + np.sqrt(rounding)) ** 2 + 1e-10 * (about**2).sum()
    assert fitted_energy(scale, offset, *case) <= most


@pytest.mark.parametrize("lambdas", [(1e5, 1e4), (1.0, 1e9), (1e18, 1.0), (1e18, 1e18), (1e300, 1e300)])
def test_the_larger_the_smoothness_the_nearer_to_one_scale_and_offset(lambdas: tuple[float, float]) -> None:
    rng = np.random.default_rng(7)
    values = rng.normal(size=(25, 5)) + 1000
    targets = 3 * values - 7 + 0.1 * rng.normal(size=(25, 5))
    case = values, np.arange(25), targets, *lambdas
    scale, offset = fit_scale_and_offset(*case)
    about = values - values.mean(axis=0)
    slope = (about * targets).sum(axis=0) / (about**2).sum(axis=0)
    constant = ((targets - targets.mean(axis=0) - slope * about) ** 2).sum()
    assert fitted_energy(scale, offset, *case) <= constant * (1 + 1e-9)
    if min(lambdas) >= 1e18:
        np.testing.assert_allclose(np.ptp(scale, axis=0) + np.ptp(offset, axis=0), 0, atol=1e-13)
        np.testing.assert_allclose(scale[0], slope, rtol=1e-9)


def test_a_scale_beyond_all_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match="beyond 64 bits"):
        fit_scale_and_offset(np.array([[0.0], [5e-324]]), [0, 1], np.array([[0.0], [1e9]]), 0.0, 0.0)
    with pytest.raises(ValueError, match="beyond 64 bits"):
        iterative_motion_warping(1e-310 * curve(TIME), 1e140 * curve(TIME))


@given(
    seed=st.integers(0, 9999),
    scale=st.sampled_from([1e-8, 1.0, 1e8]),
    offset=st.sampled_from([0.0, 1e6, 1e12]),
    lambdas=st.tuples(LAMBDAS, LAMBDAS),
)
@settings(max_examples=60, deadline=None)
def test_no_step_raises_the_energy_at_any_scale(
    seed: int, scale: float, offset: float, lambdas: tuple
) -> None:
    rng = np.random.default_rng(seed)
    moving, reference = (rng.normal(size=(n, 2)).cumsum(axis=0) for n in (22, 31))
    warp = iterative_motion_warping(scale * moving + offset, reference, None, *lambdas)
    assert (np.diff(warp.energies) <= 0).all()
    assert len(warp.energies) > 1


def test_any_real_numbers_are_read() -> None:
    rng = np.random.default_rng(8)
    moving, reference = rng.normal(size=(2, 20, 2)).cumsum(axis=1)
    # From end to end further than half and single precision reach.
    moving, reference = (one - (one.max(axis=0) + one.min(axis=0)) / 2 for one in (moving, reference))
    for one, other in (
        (moving > 0, reference > 0),
        ((1.2e4 * moving).astype(np.float16), (1.2e4 * reference).astype(np.float16)),
        ((6e37 * moving).astype(np.float32), (6e37 * reference).astype(np.float32)),
    ):
        warp = iterative_motion_warping(one, other)
        expected = iterative_motion_warping(one.astype(np.float64), other.astype(np.float64))
        np.testing.assert_array_equal(warp.path, expected.path)
        assert np.isfinite(warp.scale).all()


@pytest.mark.parametrize("exponents", [(-700, -700), (-996, -996), (0, -900), (-900, 0)])
def test_the_unit_changes_nothing_however_small(exponents: tuple[int, int]) -> None:
    moving, reference = np.random.default_rng(9).normal(size=(2, 30, 2)).cumsum(axis=1)
    warp = iterative_motion_warping(moving, reference)
    small = iterative_motion_warping(np.ldexp(moving, exponents[0]), np.ldexp(reference, exponents[1]))
    np.testing.assert_array_equal(warp.path, small.path)
    np.testing.assert_allclose(np.ldexp(small.scale, exponents[0] - exponents[1]), warp.scale, rtol=1e-9)


def test_the_solve_takes_long_sequences() -> None:
    values = np.random.default_rng(0).normal(size=(20_000, 3)).cumsum(axis=0)
    scale, offset = fit_scale_and_offset(values, np.arange(20_000), 2 * values + 5, 100.0, 100.0)
    np.testing.assert_allclose(scale, 2, rtol=1e-6)
    np.testing.assert_allclose(offset, 5, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"frames": [0, 1]}, r"there are 3 targets, so it must be \(3,\)"),
        ({"frames": [0.0, 1.0, 2.0]}, "type float64"),
        ({"frames": [0, 1, 5]}, "run from 0 to 5; values have 0 to 4"),
        ({"frames": [-1, 1, 2]}, "run from -1"),
        ({"targets": np.zeros((3, 1))}, "values have 2 DOFs and targets 1"),
        ({"targets": np.full((3, 2), np.nan)}, "targets holds nan"),
        ({"scale_smoothness": -1.0}, "scale_smoothness is -1"),
        ({"offset_smoothness": np.inf}, "offset_smoothness is inf"),
    ],
)
def test_what_cannot_be_fitted_is_refused(change: dict, problem: str) -> None:
    usual = {
        "values": np.zeros((5, 2)), "frames": [0, 1, 2], "targets": np.zeros((3, 2)),
        "scale_smoothness": 1.0, "offset_smoothness": 1.0,
    }  # fmt: skip
    with pytest.raises(ValueError, match=problem):
        fit_scale_and_offset(**(usual | change))


def curve(time: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(7 * time), np.cos(5 * time) + time, time**2], axis=1)


TIME = np.linspace(0, 1, 90)
SCALE, OFFSET = np.array([0.4, 3.0, 1.5]), np.array([5.0, -2.0, 30.0])


def test_a_known_scale_and_offset_are_recovered() -> None:
    reference = curve(TIME)
    moving = (curve(TIME**1.3) - OFFSET) / SCALE
    warp = iterative_motion_warping(moving, reference)
    truth = TIME ** (1 / 1.3) * 89
    assert (
        np.abs(warp.source_time - truth).mean()
        < 0.5
        < np.abs(dtw(moving, reference).source_time - truth).mean()
    )
    np.testing.assert_allclose(warp.scale, np.broadcast_to(SCALE, (90, 3)), rtol=0.1)
    shown = warp.apply(warp.scale * moving + warp.offset)
    assert np.abs(shown - reference).mean() < 0.01


def test_an_exact_copy_is_recovered_exactly() -> None:
    reference = curve(TIME)
    warp = iterative_motion_warping((reference - 7) / 4, reference)
    np.testing.assert_array_equal(warp.source_time, np.arange(90))
    np.testing.assert_allclose(warp.scale, 4, rtol=1e-9)
    np.testing.assert_allclose(warp.offset, 7, rtol=1e-9)
    assert warp.energies == pytest.approx(0, abs=1e-15)


@given(
    shape=st.tuples(st.integers(1, 16), st.integers(1, 16), st.integers(1, 3)),
    seed=st.integers(0, 9999),
    smoothness=st.tuples(st.floats(0, 1e4), st.floats(0, 1e4)),
)
@settings(max_examples=60, deadline=None)
def test_no_step_raises_the_energy(shape: tuple, seed: int, smoothness: tuple) -> None:
    n, m, dofs = shape
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(n, dofs)).cumsum(axis=0), rng.normal(size=(m, dofs)).cumsum(axis=0)
    warp = iterative_motion_warping(moving, reference, rng.uniform(0, 2, dofs), *smoothness)
    assert (np.diff(warp.energies) <= 0).all()
    assert warp.path[0].tolist() == [0, 0]
    assert warp.path[-1].tolist() == [n - 1, m - 1]
    assert np.isfinite(warp.scale).all()
    assert np.isfinite(warp.offset).all()


def test_the_energy_is_that_of_the_definition() -> None:
    rng = np.random.default_rng(1)
    moving, reference = rng.normal(size=(2, 30, 2)).cumsum(axis=1)
    weights = np.array([1.0, 3.0])
    warp = iterative_motion_warping(moving, reference, weights, 20.0, 50.0)
    unit = np.sqrt(((reference - reference.mean(0)) ** 2).mean())
    own_unit = np.sqrt(((moving - moving.mean(0)) ** 2).mean())
    energy = 0.0
    for i, k in warp.path:
        energy += (weights * ((warp.scale[i] * moving[i] + warp.offset[i] - reference[k]) / unit) ** 2).sum()
    middle = warp.scale * moving.mean(0) + warp.offset  # where the sequence's mean goes
    for i in range(29):
        energy += 20 * (weights * ((warp.scale[i + 1] - warp.scale[i]) * own_unit / unit) ** 2).sum()
        energy += 50 * (weights * ((middle[i + 1] - middle[i]) / unit) ** 2).sum()
    assert energy == pytest.approx(warp.energies[-1])
    assert warp.energies[-1] < warp.energies[0]


def test_offset_and_unit_change_nothing() -> None:
    rng = np.random.default_rng(2)
    moving, reference = rng.normal(size=(2, 40, 3)).cumsum(axis=1)
    warp = iterative_motion_warping(moving, reference)
    moved = iterative_motion_warping(8 * moving + [1.0, -4, 9], reference / 4 - 3)
    np.testing.assert_array_equal(warp.path, moved.path)
    np.testing.assert_allclose(moved.scale, warp.scale / 32, rtol=1e-6, atol=1e-8)


def test_weights_are_of_squared_differences() -> None:
    rng = np.random.default_rng(3)
    moving, reference = rng.normal(size=(2, 40, 3)).cumsum(axis=1)
    weights = np.array([2.0, 1.0, 0.0])
    without = iterative_motion_warping(moving[:, [0, 0, 1]], reference[:, [0, 0, 1]])
    weighted = iterative_motion_warping(moving[:, [0, 1, 0]], reference[:, [0, 1, 0]], weights)
    np.testing.assert_array_equal(without.path, weighted.path)


@pytest.mark.parametrize(
    ("moving", "reference"),
    [
        (np.ones((1, 2)), np.ones((1, 2))),
        (np.ones((1, 2)), curve(TIME)[:, :2]),
        (curve(TIME)[:, :2], np.full((1, 2), 3.0)),
        (np.full((9, 2), 0.1), np.full((7, 2), 0.3)),
        (curve(TIME)[:, [0, 0]], curve(TIME)[:, [1, 1]]),
        (1e149 * curve(TIME), 1e-149 * curve(TIME)),
    ],
)
def test_degenerate_sequences_give_a_result(moving: np.ndarray, reference: np.ndarray) -> None:
    warp = iterative_motion_warping(moving, reference)
    shown = warp.scale * moving + warp.offset
    assert np.isfinite(shown).all()
    assert warp.reference_frames == len(reference)


def test_what_cannot_be_warped_is_refused() -> None:
    values = curve(TIME)
    with pytest.raises(ValueError, match="moving has 2 DOFs and reference 3"):
        iterative_motion_warping(values[:, :2], values)
    with pytest.raises(ValueError, match="reference holds nan at frame 0"):
        iterative_motion_warping(values, np.full((4, 3), np.nan))
    with pytest.raises(ValueError, match="scale_smoothness is -1"):
        iterative_motion_warping(values, values, scale_smoothness=-1.0)
    with pytest.raises(ValueError, match="most_rounds is 0"):
        iterative_motion_warping(values, values, most_rounds=0)
