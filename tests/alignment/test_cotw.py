"""CoTW against an enumeration of every warp and against a memoised recursion, and its promises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import CotwWarp, cotw, uniform
from motionary.pipeline.alignment.correlation_tables import correlation_tables
from motionary.pipeline.alignment.cotw import best_moves, warp_of
from motionary.pipeline.alignment.matched import matched_pair
from motionary.pipeline.alignment.nodes import equal_nodes, stretchable
from motionary.pipeline.alignment.rounding import rounding_level
from motionary.pipeline.alignment.whole_output import WholeOutput
from tests.alignment import naive


def wave(frames: int, dofs: int, seed: int, harmonics: int = 5) -> np.ndarray:
    """A smooth motion: random harmonics of one period."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 1, frames)[:, None]
    phases, sizes = rng.random((harmonics, dofs)), rng.normal(size=(harmonics, dofs))
    return sum(
        size * np.sin(2 * np.pi * ((f + 1) * time + phase))
        for f, (size, phase) in enumerate(zip(sizes, phases, strict=True))
    )


@st.composite
def alignments(draw: st.DrawFn, most_frames: int = 26) -> tuple:
    """Sequences, L, slack and weights; some DOFs constant, some flat in part, some float32."""
    frames = draw(st.integers(4, most_frames))
    length = draw(st.integers(4, frames))
    slack = draw(st.integers(0, min(length - 4, 4)))
    dofs = draw(st.integers(1, 3))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    moving = rng.normal(size=(draw(st.integers(1, 40)), dofs))
    reference = rng.normal(size=(frames, dofs))
    if draw(st.booleans()):
        moving, reference = moving.cumsum(axis=0), reference.cumsum(axis=0)
    flat = draw(st.sampled_from(["none", "moving", "reference", "part"]))
    if flat == "moving":
        moving[:, 0] = rng.normal()
    elif flat == "reference":
        reference[:, 0] = rng.normal()
    elif flat == "part":
        reference[: frames // 2, 0] = 0.1
    if draw(st.booleans()):
        moving, reference = moving.astype(np.float32), reference.astype(np.float32)
    weights = draw(
        st.one_of(st.none(), st.lists(st.sampled_from([0.0, 0.5, 1.0, 2.0]), min_size=dofs, max_size=dofs))
    )
    if weights is not None and not any(weights):
        weights[0] = 1.0
    return moving, reference, length, slack, weights


@given(alignments())
@settings(max_examples=60, deadline=None)
def test_reaches_the_optimum_of_the_recursion(case: tuple) -> None:
    moving, reference, length, slack, weights = case
    warp = cotw(moving, reference, length, slack, weights)
    problem = naive.Problem(moving, reference, length, weights)
    best, _ = problem.best(slack)
    assert warp.objective == pytest.approx(best, abs=1e-9)
    assert (warp.first_frame, warp.nodes.tolist()) == (0, problem.nodes)
    assert problem.objective(tuple(warp.eta.tolist())) == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize(
    ("frames", "length", "slack"),
    [(20, 5, 1), (24, 6, 2), (23, 7, 3), (21, 7, 3), (29, 9, 4), (18, 9, 5), (25, 5, 0)],
)
@pytest.mark.parametrize("seed", range(3))
def test_no_warp_beats_it(frames: int, length: int, slack: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(frames + 5, 2)), rng.normal(size=(frames, 2))
    warp = cotw(moving, reference, length, slack)
    every = naive.Problem(moving, reference, length).enumerate(slack)
    ranked = sorted(every.values())
    assert warp.objective == pytest.approx(ranked[-1], abs=1e-9)
    if len(ranked) > 1 and ranked[-1] - ranked[-2] > 1e-9:
        assert tuple(warp.eta.tolist()) == max(every, key=every.__getitem__)


@given(alignments(most_frames=60))
@settings(max_examples=80, deadline=None)
def test_keeps_its_bounds(case: tuple) -> None:
    moving, reference, length, slack, weights = case
    warp = cotw(moving, reference, length, slack, weights)
    frames = len(reference)
    assert isinstance(warp, CotwWarp)
    assert (warp.segment_length, warp.slack, warp.moving_frames) == (length, slack, len(moving))
    assert len(warp.eta) == max(1, frames // length)
    assert warp.eta.sum() == 0
    assert np.abs(warp.eta).max() <= slack
    assert len(warp.source_time) == frames
    assert (warp.source_time[0], warp.source_time[-1]) == (0, len(moving) - 1)
    if len(moving) > 1:
        assert (np.diff(warp.source_time) > 0).all()
    unmoved = naive.Problem(moving, reference, length, weights).objective((0,) * len(warp.eta))
    assert warp.objective >= unmoved - 1e-9


def test_source_time_follows_the_nodes() -> None:
    """By hand: segments 0-8, 8-16, 16-25 stretched by 2, -3, 1 end at 10, 15, 25; 51 frames, factor 2."""
    nodes = equal_nodes(26, 8)
    np.testing.assert_array_equal(nodes, [0, 8, 16, 25])
    pair = matched_pair(np.zeros((51, 1)), np.zeros((26, 1)), None)
    times = warp_of(pair, WholeOutput(pair), nodes, np.array([0, 10, 15, 25]), 8, 3).source_time
    np.testing.assert_allclose(times[[0, 5, 10, 15, 25]], [0, 8, 16, 32, 50])
    np.testing.assert_allclose(np.diff(times[:11]), 1.6)
    np.testing.assert_allclose(np.diff(times[10:16]), 3.2)
    np.testing.assert_allclose(np.diff(times[15:]), 1.8)


@pytest.mark.parametrize("moving_frames", [100, 173, 61])
@pytest.mark.parametrize("eta", [(6, -9, 3, 0), (-12, 12, 12, -12), (14, 2, -20, 4)])
def test_a_known_warp_is_recovered(moving_frames: int, eta: tuple[int, ...]) -> None:
    nodes = np.array([0, 25, 50, 75, 99])
    moved = nodes + np.append(0, np.cumsum(eta))
    dense = wave(9901, 6, seed=3)
    moving = dense[np.rint(np.linspace(0, 9900, moving_frames)).astype(int)]
    reference = dense[np.rint(np.interp(np.arange(100), moved, nodes) * 100).astype(int)]
    warp = cotw(moving, reference, 25, 21)
    np.testing.assert_array_equal(warp.eta, eta)

    def mean_correlation(shown: np.ndarray) -> float:
        return np.mean([np.corrcoef(shown[:, i], reference[:, i])[0, 1] for i in range(6)])

    assert mean_correlation(warp.apply(moving)) > 0.99
    assert mean_correlation(uniform(moving, reference).apply(moving)) < 0.95
    # Correlation sees neither an offset nor a scale.
    np.testing.assert_array_equal(cotw(7 - 3 * moving, 2 - 5 * reference, 25, 21).eta, eta)


@pytest.mark.parametrize("sign", [1, -1])
def test_nodes_drift_as_far_as_the_ends_allow(sign: int) -> None:
    """Eight segments: the middle node moves by four slacks."""
    eta = sign * np.array([3, 3, 3, 3, -3, -3, -3, -3])
    nodes = equal_nodes(97, 12)
    moved = nodes + np.append(0, np.cumsum(eta))
    dense = wave(9601, 6, seed=4, harmonics=12)
    reference = dense[np.rint(np.interp(np.arange(97), moved, nodes) * 100).astype(int)]
    warp = cotw(dense[::100], reference, 12, 3)
    np.testing.assert_array_equal(warp.eta, eta)
    problem = naive.Problem(dense[::100, :2], reference[:, :2], 12)
    best, _ = problem.best(3)
    assert cotw(dense[::100, :2], reference[:, :2], 12, 3).objective == pytest.approx(best, abs=1e-9)


def test_weights_choose_what_is_aligned() -> None:
    """Two DOFs with opposite known warps: each alone is recovered under its own weight."""
    nodes, dense = np.array([0, 20, 40, 59]), wave(5901, 2, seed=5)
    moving, reference = dense[::100], np.empty((60, 2))
    for dof, eta in enumerate([(8, -8, 0), (-6, 10, -4)]):
        moved = nodes + np.append(0, np.cumsum(eta))
        reference[:, dof] = dense[np.rint(np.interp(np.arange(60), moved, nodes) * 100).astype(int), dof]
    np.testing.assert_array_equal(cotw(moving, reference, 20, 16, [1, 0]).eta, [8, -8, 0])
    np.testing.assert_array_equal(cotw(moving, reference, 20, 16, [0, 2]).eta, [-6, 10, -4])


@pytest.mark.parametrize("open_ends", [False, True])
def test_tables_of_a_larger_slack_serve_smaller_ones(open_ends: bool) -> None:
    moving, reference = wave(70, 4, seed=1), wave(60, 4, seed=2)
    pair, nodes = matched_pair(moving, reference, None), equal_nodes(60, 14)
    shared = correlation_tables(pair, stretchable(nodes, 10, open_ends))
    for slack in range(11):
        moved = best_moves(shared, stretchable(nodes, slack, open_ends), 4.0)
        alone = cotw(moving, reference, 14, slack, open_ends=open_ends)
        np.testing.assert_array_equal(np.diff(moved) - np.diff(nodes), alone.eta)


def test_a_single_segment_is_uniform() -> None:
    moving, reference = wave(33, 2, seed=0), wave(50, 2, seed=1)
    for length in (26, 40, 50):
        warp = cotw(moving, reference, length, length - 4)
        np.testing.assert_array_equal(warp.eta, [0])
        np.testing.assert_array_equal(warp.source_time, uniform(moving, reference).source_time)


def test_no_slack_is_uniform() -> None:
    moving, reference = wave(33, 2, seed=0), wave(50, 2, seed=1)
    np.testing.assert_array_equal(
        cotw(moving, reference, 7, 0).source_time, uniform(moving, reference).source_time
    )


@pytest.mark.parametrize("frames", [1, 2, 3, 4])
@pytest.mark.parametrize("moving_frames", [1, 2, 9])
def test_the_shortest_sequences(frames: int, moving_frames: int) -> None:
    warp = cotw(wave(moving_frames, 2, seed=0), wave(frames, 2, seed=1), frames)
    np.testing.assert_array_equal(warp.eta, [0])
    assert warp.source_time[0] == 0
    assert np.isfinite(warp.objective)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("which", ["moving", "reference"])
def test_a_constant_dof_counts_nothing(dtype: type, which: str) -> None:
    """Nor does one that is constant up to rounding, whose noise would correlate with anything."""
    moving, reference = wave(40, 3, seed=0).astype(dtype), wave(36, 3, seed=1).astype(dtype)
    expected = cotw(moving, reference, 9, 5, [1, 1, 0])
    flat = {"moving": moving, "reference": reference}[which]
    rng = np.random.default_rng(0)
    for level, noise in [(0.0, 0.0), (0.1, 0.0), (1e5, 0.0), (37.7, np.finfo(dtype).eps), (0.0, 1e-14)]:
        column = level * (1 + noise * rng.integers(-1, 2, len(flat))) + (
            noise * rng.normal(size=len(flat)) if not level else 0
        )
        flat[:, 2] = column
        warp = cotw(moving, reference, 9, 5)
        assert warp.objective == pytest.approx(expected.objective, abs=1e-13)
        np.testing.assert_array_equal(warp.eta, expected.eta)


def test_a_small_dof_beside_a_large_one_counts() -> None:
    moving, reference = wave(40, 2, seed=0), wave(36, 2, seed=1)
    scales = np.array([1e4, 1e-4])
    plain, scaled = cotw(moving, reference, 9, 5), cotw(moving * scales, reference * scales, 9, 5)
    assert scaled.objective == pytest.approx(plain.objective, abs=1e-9)
    np.testing.assert_array_equal(scaled.eta, plain.eta)


def test_a_flat_segment_counts_nothing_there_alone() -> None:
    reference = wave(24, 1, seed=1)
    reference[:13] = 0.3
    warp = cotw(reference, reference, 12, 0)
    assert warp.objective == pytest.approx(1.0, abs=1e-12)


def test_an_offset_far_above_the_movement_changes_nothing() -> None:
    moving, reference = wave(40, 3, seed=0), wave(36, 3, seed=1)
    plain = cotw(moving, reference, 9, 5)
    assert cotw(moving + 1e6, reference - 1e6, 9, 5).objective == pytest.approx(plain.objective, abs=1e-7)


@pytest.mark.parametrize("column", [np.zeros(40), np.arange(40.0), 0.1 * np.arange(40)])
def test_ties_do_not_bend_time(column: np.ndarray) -> None:
    """Every warp of a constant counts 0 and every warp of a ramp 1 a segment, up to rounding."""
    values = column[:, None]
    np.testing.assert_array_equal(cotw(values, values, 8, 4).eta, np.zeros(5))


def test_ties_go_to_the_shorter_segment_first() -> None:
    """A pair that is symmetric in time is as well served by (-e, e) as by its mirror image (e, -e)."""
    time = np.linspace(-1, 1, 25)
    moving, reference = np.cos(4 * time)[:, None], np.cos(9 * time)[:, None]
    warp = cotw(moving, reference, 12, 8)
    mirrored = naive.Problem(moving, reference, 12).objective(tuple(-warp.eta))
    assert mirrored == pytest.approx(warp.objective, abs=1e-12)
    assert warp.eta[0] < 0


def test_float32_and_float64_agree() -> None:
    moving, reference = wave(90, 5, seed=0).astype(np.float32), wave(80, 5, seed=1).astype(np.float32)
    single, double = (
        cotw(moving, reference, 20, 16),
        cotw(moving.astype(float), reference.astype(float), 20, 16),
    )
    assert single.objective == double.objective
    assert single.source_time.dtype == np.float64
    np.testing.assert_array_equal(single.eta, double.eta)


def test_inputs_are_left_alone_and_layout_does_not_matter() -> None:
    moving, reference = wave(50, 3, seed=0), wave(40, 3, seed=1)
    before = moving.copy(), reference.copy()
    plain = cotw(moving, reference, 10, 6)
    other = cotw(np.asfortranarray(moving), np.repeat(reference, 2, axis=0)[::2], 10, 6)
    assert plain.objective == other.objective
    np.testing.assert_array_equal(moving, before[0])
    np.testing.assert_array_equal(reference, before[1])


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"moving": np.zeros(20)}, r"moving has shape \(20,\)"),
        ({"reference": np.zeros((0, 2))}, r"reference has shape \(0, 2\)"),
        ({"moving": np.zeros((20, 3))}, "moving has 3 DOFs and reference 2"),
        (
            {"moving": np.where(np.arange(40).reshape(20, 2) == 9, np.nan, 1.0)},
            "moving holds nan at frame 4, DOF 1",
        ),
        ({"segment_length": 3, "slack": 0}, r"segment_length is 3.*4 \.\. 30"),
        ({"segment_length": 31}, r"segment_length is 31.*30 frames"),
        ({"slack": 7}, r"slack is 7 and segment_length 10.*= 6"),
        ({"slack": -1}, "slack is -1"),
        ({"weights": np.ones(3)}, r"weights have shape \(3,\).*2 DOFs"),
        ({"weights": [1, -1]}, "DOF 1 has weight -1"),
        ({"weights": [np.nan, 1]}, "DOF 0 has weight nan"),
        ({"weights": [0, 0]}, "all weights are 0"),
    ],
)
def test_what_cannot_be_aligned_is_refused(change: dict, problem: str) -> None:
    good = {"moving": np.zeros((20, 2)), "reference": np.zeros((30, 2)), "segment_length": 10, "slack": 6}
    with pytest.raises(ValueError, match=problem):
        cotw(**(good | change))


def test_rounding_level_reads_the_dtype() -> None:
    values = np.array([[1.0, 0.0], [-8.0, 1e-9]])
    np.testing.assert_allclose(rounding_level(values), [8e-12, 8e-12])
    np.testing.assert_allclose(rounding_level(values.astype(np.float32)), [32 * 2.0**-23, 8e-12])


@given(alignments(most_frames=24))
@settings(max_examples=60, deadline=None)
def test_open_ends_reach_the_optimum_of_the_recursion(case: tuple) -> None:
    moving, reference, length, slack, weights = case
    warp = cotw(moving, reference, length, slack, weights, open_ends=True)
    problem = naive.Problem(moving, reference, length, weights)
    best, _ = problem.best(slack, open_ends=True)
    assert warp.objective == pytest.approx(best, abs=1e-9)
    assert problem.objective(tuple(warp.eta.tolist()), warp.first_frame) == pytest.approx(best, abs=1e-9)
    assert -slack <= warp.first_frame <= 0
    assert warp.first_frame + len(reference) - 1 + warp.eta.sum() in range(
        len(reference) - 1, len(reference) + slack
    )
    assert warp.objective >= cotw(moving, reference, length, slack, weights).objective - 1e-9


def test_open_ends_find_a_motion_inside_a_longer_one() -> None:
    """The input has a lead-in and a lead-out that the reference has not: the paper must keep them."""
    dense = wave(13001, 6, seed=7)
    moving, reference = dense[::100], dense[1500:11501:100]
    closed = cotw(moving, reference, 25, 21)
    warp = cotw(moving, reference, 25, 21, open_ends=True)
    truth = 15 + np.arange(101)
    assert np.abs(warp.source_time - truth).mean() < 1.0
    assert np.abs(closed.source_time - truth).mean() > 3.0
    assert warp.source_time[0] > 10
    assert warp.source_time[-1] < 120


@pytest.mark.parametrize(("frames", "segments"), [(100, 3), (100, 15), (11, 2), (59, 7), (30, 1), (8, 2)])
def test_the_number_of_segments_is_kept(frames: int, segments: int) -> None:
    warp = cotw(wave(40, 2, seed=0), wave(frames, 2, seed=1), segments=segments)
    length = frames // segments
    assert len(warp.eta) == segments
    np.testing.assert_array_equal(np.diff(warp.nodes)[:-1], length)
    assert (warp.segment_length, warp.slack) == (length, max(length - 4, 0))


def test_boundaries_are_where_the_reference_pauses() -> None:
    """Three strokes with pauses at 20 to 23 and 35 to 38: equal nodes at 20 and 40 go there."""
    pace = np.ones(61)
    pace[[21, 22, 23, 36, 37, 38]] = 0.02
    reference = np.sin(np.cumsum(pace) / 7)[:, None] * [1.0, -0.5]
    warp = cotw(wave(50, 2, seed=1), reference, 20, 10, spacing="boundaries")
    np.testing.assert_array_equal(warp.nodes, [0, 21, 36, 60])
    problem = naive.Problem(wave(50, 2, seed=1), reference, 20, nodes=warp.nodes.tolist())
    assert warp.objective == pytest.approx(problem.best(10)[0], abs=1e-9)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({}, "give segment_length or segments"),
        ({"segment_length": 8, "segments": 2}, "give segment_length or segments"),
        ({"segments": 0}, r"segments is 0; a reference of 30 frames has 1 \.\. 7"),
        ({"segments": 8}, r"segments is 8.*1 \.\. 7 segments of at least 4 frames"),
        ({"segment_length": 10, "spacing": "even"}, "spacing is 'even'; it must be 'equal' or"),
    ],
)
def test_unclear_segments_are_refused(options: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        cotw(np.zeros((20, 2)), np.zeros((30, 2)), **options)
