"""Canonical time warping: its steps against slow ones, sequences of other kinds, and degenerate ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.canonical_time_warping import canonical_time_warping
from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.uniform import uniform

TIME = np.linspace(0, 1, 90)
TRUTH = TIME ** (1 / 1.3) * 89


def curve(time: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(7 * time), np.cos(5 * time) + time, np.sin(11 * time)], axis=1)


def error(warp, truth: np.ndarray = TRUTH) -> float:
    return float(np.abs(warp.source_time - truth).mean())


@given(
    shape=st.tuples(st.integers(2, 16), st.integers(2, 16), st.integers(1, 4), st.integers(1, 4)),
    seed=st.integers(0, 9999),
    regularisation=st.floats(0, 1),
)
@settings(max_examples=60, deadline=None)
def test_no_path_costs_more_than_the_one_before_it(shape: tuple, seed: int, regularisation: float) -> None:
    n, m, dofs, other = shape
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(n, dofs)), rng.normal(size=(m, other))
    warp = canonical_time_warping(moving, reference, regularisation)
    before, after = warp.costs.T
    assert (after <= before + 1e-9).all()
    assert warp.path[0].tolist() == [0, 0]
    assert warp.path[-1].tolist() == [n - 1, m - 1]
    assert warp.reference_frames == m


@pytest.mark.parametrize("seed", range(6))
def test_the_kept_path_is_the_cheapest_in_its_projections(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(25, 3)).cumsum(axis=0), rng.normal(size=(31, 2)).cumsum(axis=0)
    warp = canonical_time_warping(moving, reference, kept=1.0)  # so that all rounds have as many dimensions
    ours, other = warp.embedding.project([moving, reference])
    squared = ((ours[:, None] - other[None]) ** 2).sum(axis=2)
    total = np.full((26, 32), np.inf)
    total[0, 0] = 0
    for i, k in np.ndindex(squared.shape):
        total[i + 1, k + 1] = squared[i, k] + min(total[i, k], total[i, k + 1], total[i + 1, k])
    along = sum(squared[i, k] for i, k in warp.path)
    assert along == pytest.approx(total[-1, -1])
    assert along == pytest.approx(warp.costs[:, 1].min())
    assert len(warp.costs) > 1


@pytest.mark.parametrize("seed", range(3))
def test_mixed_channels_and_noise_are_seen_through(seed: int) -> None:
    """One sequence's channels are turned, scaled and moved, and both have a channel of noise."""
    rng = np.random.default_rng(seed)
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0] * [1.0, 4.0, 0.5]
    moving = np.column_stack([curve(TIME**1.3) @ turned + 5, rng.normal(size=90)])
    reference = np.column_stack([curve(TIME), rng.normal(size=90)])
    free = canonical_time_warping(moving, reference, 0.0, start="uniform")
    held = canonical_time_warping(moving, reference, start="uniform")
    others = min(error(dtw(moving, reference)), error(uniform(moving, reference)))
    assert error(free) < 0.1 * others
    assert error(held) < 0.5 * others


def test_an_offset_is_seen_through_from_the_nearest_path() -> None:
    moving, reference = curve(TIME**1.3) * [1.0, 0.3, 1.5] + [0, 3, 0], curve(TIME)
    assert error(canonical_time_warping(moving, reference)) < 0.2 * error(dtw(moving, reference))


def test_sequences_of_other_dofs_are_aligned() -> None:
    reference = curve(TIME)
    moving = curve(TIME**1.3) @ np.random.default_rng(1).normal(size=(3, 7))
    warp = canonical_time_warping(moving, reference)
    assert error(warp) < 0.25 * error(uniform(moving, reference))
    assert [len(one) for one in warp.embedding.projections] == [7, 3]


def test_offset_and_unit_change_nothing() -> None:
    rng = np.random.default_rng(4)
    moving, reference = rng.normal(size=(2, 40, 3)).cumsum(axis=1)
    warp = canonical_time_warping(moving, reference, 0.3)
    moved = canonical_time_warping(moving + [1.0, -4, 9], reference - 3, 0.3)
    np.testing.assert_array_equal(warp.path, moved.path)
    other = canonical_time_warping(moving[:, :2], reference, 0.3)
    scaled = canonical_time_warping(8 * moving[:, :2], reference / 4, 0.3)
    np.testing.assert_array_equal(other.path, scaled.path)


def test_without_regularisation_more_dofs_than_frames_agree_along_any_path() -> None:
    rng = np.random.default_rng(5)
    moving = curve(TIME[::3] ** 1.3) @ rng.normal(size=(3, 57)) + 0.01 * rng.normal(size=(30, 57))
    reference = curve(TIME[::3]) @ rng.normal(size=(3, 57)) + 0.01 * rng.normal(size=(30, 57))
    free = canonical_time_warping(moving, reference, 0.0, start="uniform")
    assert len(free.costs) == 1
    np.testing.assert_array_equal(free.source_time, np.arange(30))
    held = canonical_time_warping(moving, reference, start="uniform")
    truth = TIME[::3] ** (1 / 1.3) * (29 * 89 / 87)
    assert error(held, truth) < 0.5 * error(free, truth)


def test_rounds_end() -> None:
    rng = np.random.default_rng(6)
    moving, reference = rng.normal(size=(2, 40, 3)).cumsum(axis=1)
    assert len(canonical_time_warping(moving, reference, most_rounds=1).costs) == 1
    assert len(canonical_time_warping(moving, reference).costs) < 50


@pytest.mark.parametrize("dofs", [[0, 0, 1], [0, 3, 1], [3, 0, 3]])
def test_constant_and_collinear_dofs_add_nothing(dofs: list[int]) -> None:
    channels = np.column_stack([curve(TIME**1.3), np.full(90, 0.1)])
    warp = canonical_time_warping(channels[:, dofs], curve(TIME))
    assert np.isfinite(warp.costs).all()
    assert np.isfinite(warp.embedding.correlations).all()
    constant = [place for place, dof in enumerate(dofs) if dof == 3]
    np.testing.assert_allclose(warp.embedding.projections[0][constant], 0, atol=1e-12)


@pytest.mark.parametrize("other", [np.full((9, 3), 0.1), np.ones((1, 3)), np.ones((1, 5)), np.zeros((4, 1))])
def test_what_stands_still_correlates_with_nothing(other: np.ndarray) -> None:
    for moving, reference in ((other, curve(TIME)), (curve(TIME), other), (other, other)):
        warp = canonical_time_warping(moving, reference)
        assert warp.reference_frames == len(reference)
        assert warp.costs.shape == (0, 2)
        assert [one.shape for one in warp.embedding.projections] == [
            (moving.shape[1], 0),
            (reference.shape[1], 0),
        ]


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"moving": np.full((4, 3), np.nan)}, "moving holds nan at frame 0"),
        ({"reference": np.zeros((0, 3))}, "reference has shape"),
        ({"regularisation": 1.5}, "regularisation is 1.5"),
        ({"kept": 0.0}, "kept is 0"),
        ({"most_rounds": 0}, "most_rounds is 0"),
        ({"start": "dtw"}, "start is 'dtw'; it must be"),
        ({"start": "nearest", "moving": curve(TIME)[:, :2]}, "moving has 2 DOFs and reference 3"),
    ],
)
def test_what_cannot_be_aligned_is_refused(change: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        canonical_time_warping(**({"moving": curve(TIME), "reference": curve(TIME)} | change))


@pytest.mark.parametrize("exponents", [(-700, -700), (-960, -960), (0, -900), (-900, 0)])
def test_the_unit_changes_nothing_however_small(exponents: tuple[int, int]) -> None:
    rng = np.random.default_rng(7)
    moving, reference = rng.normal(size=(30, 3)).cumsum(axis=0), rng.normal(size=(25, 2)).cumsum(axis=0)
    tiny = np.ldexp(moving, exponents[0]), np.ldexp(reference, exponents[1])
    warp, small = canonical_time_warping(moving, reference), canonical_time_warping(*tiny)
    np.testing.assert_array_equal(warp.path, small.path)
    np.testing.assert_allclose(small.costs, warp.costs, rtol=1e-9)
    for ours, theirs in zip(
        small.embedding.project(tiny), warp.embedding.project((moving, reference)), strict=True
    ):
        np.testing.assert_allclose(np.abs(ours), np.abs(theirs), rtol=1e-7, atol=1e-9)


def test_what_is_too_small_to_be_projected_is_refused() -> None:
    with pytest.raises(ValueError, match="so small that its projection is beyond 64 bits"):
        canonical_time_warping(1e-318 * curve(TIME), curve(TIME))
