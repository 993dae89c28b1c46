import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import banded
from motionary.pipeline.alignment.adaptive import adaptive_dtw, constrained_dtw, eigenposture_coordinates
from motionary.pipeline.alignment.banded import banded_path
from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.evaluation import longest_stay


def halved(values: np.ndarray) -> np.ndarray:
    return np.array([values[i : i + 2].mean(axis=0) for i in range(0, len(values), 2)])


def recursive(x: np.ndarray, y: np.ndarray, radius: int, weight: float) -> np.ndarray:
    """Follow the paper's pseudo code, its window as a set of cells."""
    columns = np.arange(len(y))
    inside = np.ones((len(x), len(y)), dtype=bool)
    if len(x) > radius + 2 and len(y) > radius + 2:
        inside[:] = False
        coarser = weight - 1 if weight > 1 else weight
        for p, q in recursive(halved(x), halved(y), radius, max(coarser, 1.0)):
            inside[
                max(2 * p - radius, 0) : 2 * p + 2 + radius, max(2 * q - radius, 0) : 2 * q + 2 + radius
            ] = True
    first = np.where(inside, columns, len(y)).min(axis=1)
    last = np.where(inside, columns, -1).max(axis=1)
    assert (inside.sum(axis=1) == last - first + 1).all()
    return banded_path(x, y, first, last, weight)


def warped_curves(m: int, n: int, dofs: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    speeds, phases = rng.uniform(2, 9, dofs), rng.uniform(0, 6, dofs)
    curve = lambda t: np.sin(t[:, None] * speeds + phases)  # noqa: E731
    moving = curve(np.linspace(0, 1, m) ** 1.4) + 0.02 * rng.normal(size=(m, dofs))
    return moving, curve(np.linspace(0, 1, n)) + 0.02 * rng.normal(size=(n, dofs))


@given(
    m=st.integers(1, 60),
    n=st.integers(1, 60),
    radius=st.integers(0, 6),
    weight=st.sampled_from([1.0, 1.5, 2.0, 3.0]),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=40, deadline=None)
def test_the_path_is_that_of_the_papers_recursion(
    m: int, n: int, radius: int, weight: float, seed: int
) -> None:
    moving, reference = warped_curves(m, n, 5, seed)
    warp = adaptive_dtw(moving, reference, components=3, radius=radius, slope_weight=weight)
    x, y = eigenposture_coordinates(moving, reference, components=3)
    np.testing.assert_array_equal(warp.path, recursive(x, y, radius, weight))
    assert warp.path[0].tolist() == [0, 0]
    assert warp.path[-1].tolist() == [m - 1, n - 1]


def test_weights_fall_by_one_a_level_and_not_under_1(monkeypatch) -> None:
    used = []
    kept = banded.banded_path
    monkeypatch.setattr(
        banded, "banded_path", lambda *all_: used.append((len(all_[0]), all_[-1])) or kept(*all_)
    )
    adaptive_dtw(*warped_curves(100, 90, 3, 0), radius=1, slope_weight=2.5)
    assert used == [(4, 1.0), (7, 1.0), (13, 1.0), (25, 1.0), (50, 1.5), (100, 2.5)]


def test_a_radius_of_all_frames_at_weight_1_is_dtw_of_the_coordinates() -> None:
    moving, reference = warped_curves(80, 70, 6, 2)
    exact = dtw(*eigenposture_coordinates(moving, reference))
    np.testing.assert_array_equal(
        adaptive_dtw(moving, reference, radius=80, slope_weight=1.0).path, exact.path
    )
    np.testing.assert_array_equal(constrained_dtw(moving, reference, slope_weight=1.0).path, exact.path)


def test_a_sequence_aligned_with_itself_follows_the_diagonal() -> None:
    values = np.random.default_rng(0).normal(size=(333, 9)).cumsum(axis=0).astype(np.float32)
    for warp in (adaptive_dtw(values, values), constrained_dtw(values, values)):
        np.testing.assert_array_equal(warp.source_time, np.arange(333))


def test_a_planted_warp_is_found_with_shorter_stays_than_in_a_single_constrained_level() -> None:
    n = 400
    moving, reference = warped_curves(300, n, 12, 5)
    truth = np.linspace(0, 1, n) ** (1 / 1.4) * 299
    warps = {"adaptive": adaptive_dtw(moving, reference), "constrained": constrained_dtw(moving, reference)}
    errors = {name: np.abs(warp.source_time - truth).mean() for name, warp in warps.items()}
    stays = {name: longest_stay(warp.path) for name, warp in warps.items()}
    assert errors["adaptive"] < 4 < errors["constrained"] / 3
    assert stays["adaptive"] < stays["constrained"] / 3


def test_coordinates_are_those_of_a_whitened_pca() -> None:
    rng = np.random.default_rng(7)
    mixing = rng.normal(size=(6, 6)) * np.array([5.0, 3, 2, 1, 0.5, 0.1])[:, None]
    reference, moving = rng.normal(size=(50, 6)) @ mixing, rng.normal(size=(40, 6)) @ mixing
    weights = np.array([1.0, 0.5, 2.0, 0.0, 1.0, 3.0])
    x, y = eigenposture_coordinates(moving, reference, weights, components=3)
    np.testing.assert_allclose(y.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(y.T @ y / 50, np.eye(3), atol=1e-9)
    # From the covariance, not from the singular values.
    scaled = (reference - reference.mean(axis=0)) * np.sqrt(weights)
    variances, axes = np.linalg.eigh(scaled.T @ scaled / 50)
    others = (moving - reference.mean(axis=0)) * np.sqrt(weights)
    for k in range(3):
        expected = np.concatenate([scaled, others]) @ axes[:, -1 - k] / np.sqrt(variances[-1 - k])
        found = np.concatenate([y[:, k], x[:, k]])
        assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-9


def test_four_principal_postures_count_where_no_number_is_given() -> None:
    rng = np.random.default_rng(3)
    moving, reference = rng.normal(size=(50, 9)), rng.normal(size=(40, 9))
    assert eigenposture_coordinates(moving, reference)[1].shape == (40, 4)
    for align in (adaptive_dtw, constrained_dtw):
        given, four, eight = (
            align(moving, reference, slope_weight=1.0, **number).path
            for number in ({}, {"components": 4}, {"components": 8})
        )
        np.testing.assert_array_equal(given, four)
        assert not np.array_equal(given, eight)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_what_does_not_vary_is_no_component(kind: type) -> None:
    rng = np.random.default_rng(2)
    one = rng.normal(size=(60, 1)).cumsum(axis=0)
    collinear = np.concatenate([one, 3 * one + 1, np.full((60, 1), 0.1)], axis=1).astype(kind)
    x, y = eigenposture_coordinates(collinear[:45], collinear)
    assert x.shape == (45, 1)
    assert y.shape == (60, 1)
    assert np.isfinite(adaptive_dtw(collinear[:45], collinear).source_time).all()


def test_one_frame_or_a_still_reference_has_the_shortest_path() -> None:
    moving = np.random.default_rng(1).normal(size=(30, 3))
    for frames in (1, 20, 30):
        warp = adaptive_dtw(moving, np.full((frames, 3), 0.1))
        assert len(warp.path) == 30
        assert longest_stay(warp.path) >= 30 - frames
    assert adaptive_dtw(moving[:1], moving).source_time.tolist() == [0.0] * 30
    assert adaptive_dtw(moving, moving, np.zeros(3)).path.tolist() == [[k, k] for k in range(30)]


def test_what_cannot_be_aligned_is_refused() -> None:
    values = np.random.default_rng(0).normal(size=(9, 2))
    broken = values.copy()
    broken[4, 1] = np.nan
    for align in (adaptive_dtw, constrained_dtw):
        with pytest.raises(ValueError, match="reference holds nan at frame 4, DOF 1"):
            align(values, broken)
        with pytest.raises(ValueError, match="moving has 2 DOFs and reference 1"):
            align(values, values[:, :1])
        with pytest.raises(ValueError, match="components is 0"):
            align(values, values, components=0)
        for weight in (0.5, -3.0, np.nan, np.inf, 2.0**257):
            with pytest.raises(
                ValueError, match=rf"slope_weight is {re.escape(str(weight))}; .* from 1 to 1\.1"
            ):
                align(values, values, slope_weight=weight)
        align(values, values[::2], slope_weight=2.0**256)
        with pytest.raises(ValueError, match="weights have shape"):
            align(values, values, np.ones(3))
    with pytest.raises(ValueError, match="radius is -1"):
        adaptive_dtw(values, values, radius=-1)


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e140])
def test_the_smallest_and_the_largest_values_warp_as_others_do(size: float) -> None:
    rng = np.random.default_rng(5)
    moving, reference = rng.normal(size=(30, 4)).cumsum(axis=0), rng.normal(size=(36, 4)).cumsum(axis=0)
    expected = adaptive_dtw(moving, reference).path
    np.testing.assert_array_equal(adaptive_dtw(moving * size, reference * size).path, expected)


@pytest.mark.parametrize(
    ("setting", "problem"), [({"components": 2.5}, "components is 2.5"), ({"radius": 1.5}, "radius is 1.5")]
)
def test_numbers_of_postures_and_frames_are_whole(setting: dict[str, float], problem: str) -> None:
    values = np.random.default_rng(6).normal(size=(12, 3))
    with pytest.raises(ValueError, match=problem):
        adaptive_dtw(values, values, **setting)
