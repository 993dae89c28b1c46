"""Procrustes warping: the step against every way there is, J as the paper sums it, and what moves nothing."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motionary.pipeline.alignment.procrustes import (
    procrustes_derivative_dtw,
    procrustes_dtw,
    procrustes_motion_warping,
)
from motionary.pipeline.alignment.steps_to_mean import one_frame_a_step, uniform_path
from motionary.pipeline.evaluation.paths import path_error

METHODS = (procrustes_dtw, procrustes_derivative_dtw, procrustes_motion_warping)
FINITE = st.floats(-9, 9, width=32) | st.integers(-2, 2).map(float)


@st.composite
def few_sequences(draw):
    dofs = draw(st.integers(1, 3))
    lengths = draw(st.lists(st.integers(1, 8), min_size=2, max_size=4))
    return [draw(arrays(np.float64, (frames, dofs), elements=FINITE)) for frames in lengths]


def curves(shares=(0.8, 1.3), frames=(40, 50), latent=60):
    """One curve at two uneven speeds, and its path: latent time u is frame (n - 1) u^share."""
    u = np.linspace(0, 1, latent)
    truth = np.stack([(n - 1) * u**share for n, share in zip(frames, shares, strict=True)], axis=1)
    sequences = []
    for n, share in zip(frames, shares, strict=True):
        time = np.linspace(0, 1, n) ** (1 / share)
        sequences.append(np.stack([np.sin(5 * time) + time, np.cos(7 * time)], axis=1))
    return sequences, truth


def pairwise_objective(shown):
    """J of the paper: half the squared distances of all ordered pairs."""
    return sum(((a - b) ** 2).sum() / 2 for a, b in itertools.product(shown, repeat=2))


def every_way(frames, steps):
    for goes_on in itertools.combinations(range(1, steps), frames - 1):
        yield np.cumsum(np.isin(np.arange(steps), goes_on))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_one_frame_a_step_is_the_cheapest_of_all_ways(data):
    frames = data.draw(st.integers(1, 5))
    steps = data.draw(st.integers(frames, 8))
    costs = data.draw(arrays(np.float64, (frames, steps), elements=st.integers(0, 5).map(float)))
    path = one_frame_a_step(costs)
    assert path[0] == 0
    assert path[-1] == frames - 1
    assert set(np.diff(path)) <= {0, 1}
    least = min(costs[way, np.arange(steps)].sum() for way in every_way(frames, steps))
    assert costs[path, np.arange(steps)].sum() == least


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=60, deadline=None)
@given(few_sequences(), st.integers(0, 3))
def test_any_sequences_get_a_path_and_the_objective_never_rises(method, sequences, spare):
    steps = max(map(len, sequences)) + spare
    found = method(sequences, steps)
    assert found.path.shape == (steps, len(sequences))
    assert (found.path[0] == 0).all()
    assert found.path[-1].tolist() == [len(values) - 1 for values in sequences]
    assert set(np.diff(found.path, axis=0).ravel()) <= {0, 1}
    assert np.isfinite(found.mean).all()
    objectives = found.objectives
    assert (np.diff(objectives) <= 1e-9 * (1 + objectives[:-1])).all()
    assert [warp.moving_frames for warp in found.warps] == [len(values) for values in sequences]
    np.testing.assert_array_equal(np.stack([warp.source_time for warp in found.warps], axis=1), found.path)


@pytest.mark.parametrize("method", METHODS)
def test_the_objective_never_rises_on_longer_walks(method):
    rounds = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        walks = [rng.normal(size=(rng.integers(20, 40), 2)).cumsum(axis=0) for _ in range(4)]
        smoothness = {"scale_smoothness": 50.0} if method is procrustes_motion_warping else {}
        objectives = method(walks, 45, **smoothness).objectives
        assert (np.diff(objectives) <= 1e-9 * objectives[:-1]).all()
        rounds += len(objectives)
    assert rounds > 36  # it does take turns


def test_scales_and_offsets_are_the_least_of_the_objective():
    # As many steps as frames leave one path, so the first round's fit, to the mean as it came, is the last.
    rng = np.random.default_rng(2)
    walks = [rng.normal(size=(12, 2)).cumsum(axis=0) for _ in range(4)]
    found = procrustes_motion_warping(walks, 12, scale_smoothness=3.0, offset_smoothness=0.5)
    assert len(found.objectives) == 1

    def objective(scale, offset):
        apart = scale * walks[1] + offset - np.mean(walks, axis=0)
        rough = [(np.diff(one, axis=0) ** 2).sum() for one in (scale, offset)]
        return 4 * (apart**2).sum() + 3 * rough[0] + 0.5 * rough[1]

    at = [found.scales[1], found.offsets[1]]
    for which in (0, 1):
        for cell in np.ndindex(12, 2):
            nudge = [np.zeros((12, 2)), np.zeros((12, 2))]
            nudge[which][cell] = 1e-3
            up, down = (objective(at[0] + k * nudge[0], at[1] + k * nudge[1]) for k in (1, -1))
            assert (up - down) / 2e-3 == pytest.approx(0, abs=1e-6)


def test_the_objective_is_the_papers_sum_over_pairs():
    sequences, _ = curves()
    sequences.append(sequences[0][::2] * 1.1)
    plain = procrustes_dtw(sequences)
    shown = [warp.apply(values) for warp, values in zip(plain.warps, sequences, strict=True)]
    assert plain.objectives[-1] == pytest.approx(pairwise_objective(shown))
    start = uniform_path([len(values) for values in sequences], len(plain.path))
    evenly = [values[frames] for values, frames in zip(sequences, start.T, strict=True)]
    assert plain.objectives[-1] < pairwise_objective(evenly) / 4

    shaped = procrustes_motion_warping(sequences, scale_smoothness=3.0, offset_smoothness=0.5)
    shown, roughness = [], 0.0
    for i, values in enumerate(sequences):
        scale, offset = shaped.scales[i], shaped.offsets[i]
        shown.append((scale * values + offset)[shaped.path[:, i]])
        roughness += 3 * (np.diff(scale, axis=0) ** 2).sum() + 0.5 * (np.diff(offset, axis=0) ** 2).sum()
    assert shaped.objectives[-1] == pytest.approx(pairwise_objective(shown) + roughness)
    np.testing.assert_allclose(shaped.mean, np.mean(shown, axis=0))


def test_speeds_are_recovered():
    sequences, truth = curves()
    start = uniform_path([40, 50], 60)
    assert path_error(procrustes_dtw(sequences, 60).path, truth) < path_error(start, truth) / 4
    assert path_error(procrustes_derivative_dtw(sequences, 60).path, truth) < path_error(start, truth) / 2


def test_the_derivatives_are_keogh_and_pazzanis():
    rng = np.random.default_rng(7)
    walks = [rng.normal(size=(frames, 2)).cumsum(axis=0) for frames in (12, 15)]
    estimates = []
    for walk in walks:
        inner = [
            ((walk[i] - walk[i - 1]) + (walk[i + 1] - walk[i - 1]) / 2) / 2 for i in range(1, len(walk) - 1)
        ]
        estimates.append(np.array([inner[0], *inner, inner[-1]]))
    found, expected = procrustes_derivative_dtw(walks), procrustes_dtw(estimates)
    np.testing.assert_array_equal(found.path, expected.path)
    np.testing.assert_allclose(found.mean, expected.mean, atol=1e-12)


def test_an_offset_moves_nothing_of_derivatives_and_much_of_frames():
    sequences, truth = curves()
    moved = [sequences[0] + [3.0, -2.0], sequences[1]]
    still = procrustes_derivative_dtw(sequences, 60)
    np.testing.assert_array_equal(procrustes_derivative_dtw(moved, 60).path, still.path)
    plain = path_error(procrustes_dtw(sequences, 60).path, truth)
    assert path_error(procrustes_dtw(moved, 60).path, truth) > 4 * plain


def test_motion_warping_takes_up_a_scale_and_an_offset():
    sequences, _ = curves((1.0, 1.0))
    moved = [sequences[0] * 2 + 1, sequences[1]]
    found = procrustes_motion_warping(moved, 55, scale_smoothness=100.0, offset_smoothness=100.0)
    shown = [
        (scale * values + offset)[frames]
        for scale, values, offset, frames in zip(
            found.scales, moved, found.offsets, found.path.T, strict=True
        )
    ]
    assert np.abs(shown[0] - shown[1]).max() < 0.15
    assert np.abs(np.ptp(found.scales[0], axis=0)).max() < 0.1
    assert (found.scales[0].mean(axis=0) < 0.7 * found.scales[1].mean(axis=0)).all()


@pytest.mark.parametrize("method", METHODS)
def test_equal_sequences_stay_even_and_meet(method):
    values = np.random.default_rng(0).normal(size=(9, 2)).cumsum(axis=0)
    found = method([values, values, values], 9)
    np.testing.assert_array_equal(found.path, np.repeat(np.arange(9)[:, None], 3, axis=1))
    assert found.objectives[-1] == pytest.approx(0, abs=1e-18)


@pytest.mark.parametrize("method", METHODS)
def test_what_cannot_be_warped_is_refused(method):
    good = np.zeros((4, 2))
    with pytest.raises(ValueError, match="there are 1 sequences"):
        method([good])
    with pytest.raises(ValueError, match="sequence 0 has 2 DOFs and sequence 1 3"):
        method([good, np.zeros((4, 3))])
    with pytest.raises(ValueError, match="there are 4 steps and the longest sequence has 5 frames"):
        method([good, np.zeros((5, 2))], 4)
    with pytest.raises(ValueError, match="sequence 1 holds nan at frame 2, DOF 1"):
        method([good, np.where(np.arange(8).reshape(4, 2) == 5, np.nan, 0)])
    with pytest.raises(ValueError, match="sequence 1 has shape"):
        method([good, np.zeros((0, 2))])


def test_a_negative_smoothness_is_refused():
    with pytest.raises(ValueError, match="offset_smoothness is -1"):
        procrustes_motion_warping([np.zeros((4, 2))] * 2, offset_smoothness=-1)
