"""The search against every combination tried by itself, and its promises on real clips."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import CotwWarp, cotw, cotw_search, mean_correlation, uniform
from motionary.pipeline.alignment.warp import interpolate
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import frame_features
from motionary.pipeline.readers import read_motion
from tests.alignment import naive
from tests.alignment.test_cotw import wave


def value(warp: CotwWarp, alpha: float = 0.5) -> float:
    return warp.correlation - alpha * warp.distortion


def moved(warp: CotwWarp) -> list[int]:
    return (warp.first_frame + np.append(0, np.cumsum(np.diff(warp.nodes) + warp.eta))).tolist()


@st.composite
def searches(draw: st.DrawFn) -> tuple:
    """Sequences, weights and alpha, the reference of 1 to 26 frames; some DOFs constant, some float32."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    dofs = draw(st.integers(1, 3))
    moving = rng.normal(size=(draw(st.integers(1, 40)), dofs))
    reference = rng.normal(size=(draw(st.sampled_from([1, 2, 7, 15, 16, 18, 20, 23, 26])), dofs))
    if draw(st.booleans()):
        moving, reference = moving.cumsum(axis=0), reference.cumsum(axis=0)
    if draw(st.booleans()):
        moving[:, 0] = rng.normal()
    if draw(st.booleans()):
        moving, reference = moving.astype(np.float32), reference.astype(np.float32)
    weights = [1.0, *draw(st.lists(st.sampled_from([0.0, 0.5, 2.0]), min_size=dofs - 1, max_size=dofs - 1))]
    return moving, reference, weights, draw(st.sampled_from([0.0, 0.5, 3.0]))


@given(searches())
@settings(max_examples=40, deadline=None)
def test_finds_the_greatest_value_of_the_grid(case: tuple) -> None:
    moving, reference, weights, alpha = case
    # Between few frames all is straight, and all warps of a straight line are equally good to Table 1.
    assume(len(moving) >= len(reference))
    warp = cotw_search(moving, reference, weights, alpha)
    values = naive.search(moving, reference, weights, alpha)
    assert value(warp, alpha) == pytest.approx(max(values.values()), abs=1e-9)
    assert values[warp.segment_length, warp.slack] == pytest.approx(value(warp, alpha), abs=1e-9)
    problem = naive.Problem(moving, reference, warp.segment_length, weights)
    rho, h = naive.whole_output(problem, warp.nodes.tolist(), moved(warp))
    assert (warp.correlation, warp.distortion) == pytest.approx((rho, h), abs=1e-9)
    assert warp.objective == pytest.approx(problem.objective(tuple(warp.eta.tolist())), abs=1e-9)


@given(searches())
@settings(max_examples=60, deadline=None)
def test_is_never_below_length_matching(case: tuple) -> None:
    moving, reference, weights, alpha = case
    warp = cotw_search(moving, reference, weights, alpha, open_ends=len(reference) % 2 == 0)
    matched = interpolate(moving.astype(float), uniform(moving, reference).source_time)
    # In the inputs' dtype a DOF may count as constant that would not in float64, and the other way round.
    if moving.dtype == np.float64:
        assert warp.correlation >= mean_correlation(matched, reference, weights) - 1e-9
    if len(moving) > 1:
        assert (np.diff(warp.source_time) > 0).all()


def test_the_whole_output_is_what_mean_correlation_says() -> None:
    moving, reference = wave(150, 5, seed=0), wave(60, 5, seed=1)
    warp = cotw_search(moving, reference, [1, 2, 0, 1, 0.5])
    matched = interpolate(moving, uniform(moving, reference).source_time)
    shown = interpolate(matched, warp.source_time * 59 / 149)
    assert warp.correlation == pytest.approx(mean_correlation(shown, reference, [1, 2, 0, 1, 0.5]), abs=1e-9)


def test_its_parameters_give_the_same_warp() -> None:
    moving, reference = wave(70, 4, seed=3), wave(60, 4, seed=4)
    for options in ({}, {"open_ends": True}, {"spacing": "boundaries"}):
        found = cotw_search(moving, reference, **options)
        again = cotw(moving, reference, found.segment_length, found.slack, **options)
        np.testing.assert_array_equal(found.eta, again.eta)
        np.testing.assert_array_equal(found.source_time, again.source_time)
        assert found.objective == pytest.approx(again.objective, abs=1e-9)


def test_distortion_weighs_against_correlation() -> None:
    moving, reference = wave(70, 4, seed=3), wave(60, 4, seed=4)
    free, bound = cotw_search(moving, reference, alpha=0.0), cotw_search(moving, reference, alpha=5.0)
    assert free.correlation > bound.correlation
    assert free.distortion > bound.distortion


@pytest.mark.parametrize("effort", ["full", "fast"])
def test_open_ends_are_worth_more_where_ends_differ(effort: str) -> None:
    dense = wave(13001, 6, seed=7)
    moving, reference = dense[::100], dense[1500:11501:100]
    closed = cotw_search(moving, reference, alpha=0.0, effort=effort)
    opened = cotw_search(moving, reference, alpha=0.0, effort=effort, open_ends=True)
    assert opened.correlation > 0.999
    assert closed.correlation < 0.98
    assert np.abs(opened.source_time - 15 - np.arange(101)).mean() < 1.0


@pytest.mark.parametrize("frames", [97, 130, 200, 333])
@pytest.mark.parametrize("open_ends", [False, True])
@pytest.mark.parametrize("spacing", ["equal", "boundaries"])
def test_the_fast_search_keeps_the_constraints(frames: int, open_ends: bool, spacing: str) -> None:
    moving, reference = wave(150, 3, seed=frames), wave(frames, 3, seed=1)
    warp = cotw_search(moving, reference, effort="fast", open_ends=open_ends, spacing=spacing)
    places = moved(warp)
    assert warp.segment_length >= 8
    assert np.abs(warp.eta).max() <= warp.slack <= warp.segment_length - 4
    assert (np.diff(places) >= 3).all()
    if open_ends:
        assert -warp.slack <= places[0] <= 0
        assert frames - 1 <= places[-1] <= frames - 1 + warp.slack
    else:
        assert (places[0], places[-1]) == (0, frames - 1)
    problem = naive.Problem(moving, reference, warp.segment_length, nodes=warp.nodes.tolist())
    assert (warp.correlation, warp.distortion) == pytest.approx(
        naive.whole_output(problem, warp.nodes.tolist(), places), abs=1e-9
    )
    assert warp.objective == pytest.approx(problem.objective(tuple(warp.eta.tolist()), places[0]), abs=1e-9)


def test_the_fast_search_recovers_a_known_warp() -> None:
    nodes, eta = np.array([0, 60, 120, 180, 240, 299]), np.array([20, -31, 8, 22, -19])
    placed = nodes + np.append(0, np.cumsum(eta))
    dense = wave(29901, 6, seed=3)
    reference = dense[np.rint(np.interp(np.arange(300), placed, nodes) * 100).astype(int)]
    warp = cotw_search(dense[::100], reference, alpha=0.0, effort="fast")
    assert np.abs(warp.source_time - np.interp(np.arange(300), placed, nodes)).mean() < 1.0
    assert warp.correlation > 0.99


@pytest.mark.slow
def test_the_fast_search_loses_little_on_real_clips(shared_data) -> None:
    """At most .01 of eq. 8's value; walks, whose strides are many, are the hardest."""
    files = sorted((shared_data / "bandai").glob("dataset-1_walk_*_001.bvh"))[:7]
    poses = [frame_features(read_motion(file), FeatureConfig(epsilon=0.0)).values[:, :57] for file in files]
    reference = poses.pop(1)
    assert len(reference) > 96
    losses = [
        value(cotw_search(one, reference)) - value(cotw_search(one, reference, effort="fast"))
        for one in poses
    ]
    assert max(losses) <= 0.01


@pytest.mark.parametrize("effort", ["full", "fast"])
def test_where_nothing_correlates_no_warp_is_tried(effort: str, monkeypatch) -> None:
    def searched(*arguments):
        raise AssertionError("searched")

    monkeypatch.setattr("motionary.pipeline.alignment.search.all_warps", searched)
    monkeypatch.setattr("motionary.pipeline.alignment.search.refined_warps", searched)
    walk = np.random.default_rng(0).normal(size=(120, 3)).cumsum(axis=0)
    apart = walk * [1.0, 0, 1], walk[:110] * [0.0, 1, 1], [1.0, 2.0, 0.0]
    for moving, reference, weights in ((walk[:1], walk, None), (walk, np.ones((90, 3)), None), apart):
        warp = cotw_search(moving, reference, weights, effort=effort)
        np.testing.assert_allclose(warp.source_time, uniform(moving, reference).source_time, atol=1e-12)
        assert (warp.segment_length, warp.slack) == (len(reference), 0)
        assert (warp.correlation, warp.distortion, warp.objective) == (0, 0, 0)
        assert warp.eta.tolist() == [0]


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"effort": "quick"}, "effort is 'quick'; it must be 'full' or 'fast'"),
        ({"alpha": -0.5}, "alpha is -0.5; it must be finite and not negative"),
        ({"alpha": np.nan}, "alpha is nan"),
        ({"weights": [0, 0]}, "all weights are 0; the mean correlation needs one that is not"),
        ({"spacing": "even"}, "spacing is 'even'"),
    ],
)
def test_what_cannot_be_searched_is_refused(options: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        cotw_search(np.zeros((20, 2)), np.zeros((10, 2)), **options)


def test_a_grid_that_would_not_end_is_refused() -> None:
    with pytest.raises(ValueError, match=r"a reference of 2001 frames would take hours .* effort='fast'"):
        cotw_search(np.zeros((20, 2)), np.zeros((2001, 2)))


def test_open_ends_keep_what_is_seen_of_the_first_and_last_segment() -> None:
    for seed in range(40):
        rng = np.random.default_rng(seed)
        moving = rng.normal(size=(int(rng.integers(20, 200)), 2)).cumsum(axis=0)
        reference = rng.normal(size=(int(rng.integers(97, 180)), 2)).cumsum(axis=0)
        warp = cotw_search(moving, reference, effort="fast", open_ends=True)
        places = moved(warp)
        assert (np.abs(warp.eta) <= warp.slack).all()
        assert places[1] >= 4
        assert places[-2] <= len(reference) - 1 - 3
