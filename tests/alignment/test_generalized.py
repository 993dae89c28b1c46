import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import mean_correlation
from motionary.pipeline.alignment.bases import USUAL_BASES, Basis, monotone_basis
from motionary.pipeline.alignment.generalized import generalized_pair, generalized_time_warping
from motionary.pipeline.alignment.generalized_time import _GaussNewton, time_step, warp_steps
from motionary.pipeline.alignment.quadratic_programme import UnsolvedError, solve_programme
from motionary.pipeline.alignment.warp_weights import joined_limits, weight_limits
from motionary.pipeline.evaluation.paths import path_error
from motionary.workflows.reproduce.gtw_sequences import STRETCHES, spiral_set

THREE = {"tanh": 3, "polynomial": 3}


def curve(time: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(7 * time), np.cos(5 * time), time**2], axis=1)


def random_problem(seed: int) -> tuple[list[np.ndarray], list[Basis], list[np.ndarray]]:
    """Three sequences in one space, and weights within their limits."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(5, 40, size=3)
    bases = [monotone_basis({"constant": 1, **THREE}, int(n), 45) for n in lengths]
    weights = []
    for _ in lengths:
        rising = rng.dirichlet(np.ones(6)) * rng.uniform(0.6, 0.9)
        weights.append(np.append(rng.uniform(0, 1 - rising.sum()), rising))
    return [rng.normal(size=(n, 2)).cumsum(axis=0) for n in lengths], bases, weights


def equation_3(
    sequences: list[np.ndarray], bases: list[Basis], weights: list[np.ndarray], smoothness: float
) -> float:
    """Sum up eq. 3 pair by pair, step by step."""
    shown, total = [], 0.0
    for values, basis, own in zip(sequences, bases, weights, strict=True):
        path = basis.values @ own
        shown.append([np.interp(path, np.arange(len(values)), column) for column in values.T])
        total += smoothness * sum((path[t] - path[t - 1]) ** 2 for t in range(1, len(path)))
    for one in shown:
        for other in shown:
            total += 0.5 * np.sum((np.array(one) - np.array(other)) ** 2)
    return total


def equation_6(
    sequences: list[np.ndarray], bases: list[Basis], weights: list[np.ndarray], smoothness: float
) -> tuple[np.ndarray, np.ndarray]:
    """Build H and f as they are printed, from the dense G of eq. 4, by finite differences of the path."""
    stretched, values_at, penalties, pulls = [], [], [], []
    small = 1e-6
    for values, basis, own in zip(sequences, bases, weights, strict=True):
        path = basis.values @ own
        at = [[np.interp(path + s, np.arange(len(values)), c) for c in values.T] for s in (-small, 0, small)]
        slope = (np.array(at[2]) - np.array(at[0])) / (2 * small)  # (d, l)
        stretched.append((slope.T[:, :, None] * basis.values[:, None, :]).reshape(-1, basis.values.shape[1]))
        values_at.append(np.array(at[1]).T.ravel())
        steps = len(path)
        differences = np.eye(steps)[1:] - np.eye(steps)[:-1]
        penalty = smoothness * (differences @ basis.values).T @ (differences @ basis.values)
        penalties.append(penalty)
        pulls.append(penalty @ own)
    m = len(sequences)
    hessian = np.block([[-(one.T @ other) for other in stretched] for one in stretched])
    slope = np.concatenate(
        [one.T @ (m * mine - sum(values_at)) for one, mine in zip(stretched, values_at, strict=True)]
    ) + np.concatenate(pulls)
    start = 0
    for one, penalty in zip(stretched, penalties, strict=True):
        block = slice(start, start + one.shape[1])
        hessian[block, block] += m * one.T @ one + penalty
        start = block.stop
    return hessian, slope


def gauss_newton(sequences: list[np.ndarray], bases: list[Basis], smoothness: float) -> _GaussNewton:
    limits = joined_limits([weight_limits(basis) for basis in bases])
    return _GaussNewton(sequences, bases, limits, smoothness)


@given(seed=st.integers(0, 10_000), smoothness=st.sampled_from([0.0, 0.3]))
@settings(max_examples=25, deadline=None)
def test_the_programme_is_that_of_equation_6(seed: int, smoothness: float) -> None:
    sequences, bases, weights = random_problem(seed)
    step = gauss_newton(sequences, bases, smoothness)
    at = step.at(np.concatenate(weights))
    assert at.error == pytest.approx(equation_3(sequences, bases, weights, smoothness))
    hessian, slope = step.programme(at)
    expected = equation_6(sequences, bases, weights, smoothness)
    np.testing.assert_allclose(hessian, expected[0], rtol=1e-5, atol=1e-5 * np.abs(expected[0]).max())
    np.testing.assert_allclose(slope, expected[1], rtol=1e-5, atol=1e-5 * np.abs(expected[1]).max())


def test_twice_f_is_the_slope_of_equation_3() -> None:
    sequences, bases, weights = random_problem(7)
    step = gauss_newton(sequences, bases, 0.2)
    joined, small = np.concatenate(weights), 1e-7
    _, slope = step.programme(step.at(joined))
    for place in range(len(joined)):
        ahead, behind = joined.copy(), joined.copy()
        ahead[place] += small
        behind[place] -= small
        difference = (step.at(ahead).error - step.at(behind).error) / (2 * small)
        assert difference == pytest.approx(2 * slope[place], rel=1e-3, abs=1e-3 * np.abs(slope).max())


@given(
    seed=st.integers(0, 10_000),
    ends=st.sampled_from(["relaxed", "fixed"]),
    smoothness=st.sampled_from([0.0, 0.01]),
    bases=st.sampled_from([THREE, USUAL_BASES, {"ispline": 6}, {"exponential": 3, "logarithm": 3}]),
)
@settings(max_examples=30, deadline=None)
def test_the_time_step_never_raises_equation_3(
    seed: int, ends: str, smoothness: float, bases: dict[str, int]
) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.normal(size=(int(n), 2)).cumsum(axis=0) for n in rng.integers(2, 50, size=3)]
    functions = [monotone_basis(bases, len(values), 55) for values in sequences]
    found = time_step(sequences, functions, smoothness=smoothness, ends=ends)
    assert (np.diff(found.errors) < 0).all()
    final = equation_3(sequences, functions, list(found.weights), smoothness)
    assert final == pytest.approx(found.errors[-1], rel=1e-4, abs=1e-6)
    for warp, values in zip(found.warps, sequences, strict=True):
        span = warp.source_time[-1] - warp.source_time[0]
        assert span >= (0.5 if ends == "relaxed" else 1) * (len(values) - 1) - 1e-3
    # Of functions as alike as these the solver gives up now and then, and the step ends where it stands.
    gave_up = bases == {"exponential": 3, "logarithm": 3} and "ended as MaxIterations" in found.ended
    assert gave_up or found.ended in {"converged", "no descent", "iterations"}


@pytest.mark.parametrize("name", ["polynomial", "exponential", "logarithm", "tanh", "ispline"])
def test_one_function_a_warp_recovers_a_planted_warp(name: str) -> None:
    # What the second sequence shows along its only function is the first four fifths of the first, evenly.
    frames, steps = 120, 132
    straight, bent = (
        monotone_basis({"polynomial": 1}, frames, steps),
        monotone_basis({name: 1}, frames, steps),
    )
    even = np.linspace(0, 0.8, steps)
    planted = np.interp(np.arange(frames), bent.path(np.ones(1)), even)
    sequences = [curve(np.linspace(0, 1, frames)), curve(planted)]
    found = time_step(sequences, [straight, bent], ends=("relaxed", "fixed"))
    assert found.errors[0] > 1000 * found.errors[-1]
    assert found.weights[0][0] == pytest.approx(0.8, abs=0.002)
    np.testing.assert_allclose(found.warps[0].source_time, even * (frames - 1), atol=0.3)


def test_a_planted_warp_of_one_function_is_found_across_dimensions() -> None:
    time = np.linspace(0, 1, 150)
    rng = np.random.default_rng(2)
    mixed = curve(time**2) @ rng.normal(size=(3, 5)) + 4
    found = generalized_time_warping([curve(time), mixed], {"polynomial": 3}, regularisation=0.0)
    truth = np.stack([time, time**0.5], axis=1) * 149
    assert path_error(found.paths, truth) < 0.6
    assert found.correlation > 0.999
    uniform = np.stack([time, time], axis=1) * 149
    assert path_error(uniform, truth) > 10


@pytest.mark.parametrize("number", range(2))
def test_random_sets_of_the_experiment_come_nearer_to_the_truth(number: int) -> None:
    one = spiral_set(STRETCHES, 0, number)
    found = generalized_time_warping(one.sequences, THREE, regularisation=0.0)
    uniform = np.stack([np.linspace(0, n - 1, 300) for n in one.lengths], axis=1)
    assert path_error(found.paths, one.truth) < 0.6 * path_error(uniform, one.truth)
    assert found.correlation > 0.99


@given(seed=st.integers(0, 10_000), regularisation=st.sampled_from([0.0, 0.1]))
@settings(max_examples=8, deadline=None)
def test_each_step_keeps_to_its_own_aim(seed: int, regularisation: float) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.normal(size=(int(n), 3)).cumsum(axis=0) for n in rng.integers(20, 60, size=3)]
    found = generalized_time_warping(sequences, regularisation=regularisation, ends="relaxed", rounds=6)
    assert found.rounds
    for turn in found.rounds:
        assert (np.diff(turn.errors) < 0).all()
        assert turn.trace >= turn.trace_before - 1e-9
    assert found.correlation <= 1 + 1e-9


def test_a_coarse_start_is_never_worse_than_a_uniform_one() -> None:
    for number in (0, 2):  # the coarse start alone would win the first and lose the second
        sequences = spiral_set(STRETCHES, 5, number).sequences
        coarse, uniform = (
            generalized_time_warping(sequences, THREE, start=start, rounds=5)
            for start in ("coarse", "uniform")
        )
        size = min(len(one.embedding.correlations) for one in (coarse, uniform))
        traces = [one.embedding.spectrum[:size].sum() for one in (coarse, uniform)]
        assert traces[0] >= traces[1]


def test_a_motion_is_found_within_a_longer_sequence() -> None:
    rng = np.random.default_rng(1)
    whole = np.stack(
        [np.convolve(rng.normal(size=324), np.hanning(25), mode="valid") for _ in range(5)], axis=1
    )
    first, frames = 110, 90
    part = whole[first : first + frames]
    steps = warp_steps([len(whole)])
    found = {
        begin: generalized_time_warping(
            [whole, part],
            start=[np.linspace(begin, begin + frames - 1, steps), np.linspace(0, frames - 1, steps)],
            regularisation=0.1,
            ends=("relaxed", "fixed"),
            least_share=0.2,
        )
        for begin in (0, 102, 210)
    }
    assert max(found, key=lambda begin: found[begin].correlation) == 102
    shown, motion = found[102].paths.T
    np.testing.assert_allclose(shown - motion, first, atol=0.5)
    np.testing.assert_allclose(motion[[0, -1]], [0, frames - 1], atol=1e-3)


def test_a_collapsed_warp_is_refused() -> None:
    # Two sequences that cross once: standing still there is eq. 3's least value.
    time = np.linspace(-1, 1, 80)[:, None]
    sequences = [time, -time]
    bases = [monotone_basis({"constant": 1, "polynomial": 1}, 80, 88) for _ in sequences]
    for share in (0.2, 0.7):
        found = time_step(sequences, bases, ends="relaxed", least_share=share)
        spans = [np.ptp(warp.source_time) for warp in found.warps]
        np.testing.assert_allclose(spans, share * 79, atol=0.1)


def test_smoothness_evens_a_warp_out() -> None:
    time = np.linspace(0, 1, 100)
    sequences = [curve(time), curve(time**1.6)]
    unevenness = []
    for smoothness in (0.0, 1.0, 1e4):
        found = generalized_time_warping(sequences, smoothness=smoothness, regularisation=0.0, rounds=5)
        unevenness.append(sum(np.diff(path, 2) @ np.diff(path, 2) for path in found.paths.T))
    assert unevenness[0] > unevenness[1] > unevenness[2]


def test_a_pair_is_brought_to_the_references_frames() -> None:
    time = np.linspace(0, 1, 80)
    moving, reference = curve(time**1.4), curve(time)[:, :2]
    warp = generalized_pair(moving, reference)
    assert (warp.moving_frames, warp.reference_frames) == (80, 80)
    errors = [np.abs(one - 79 * time ** (1 / 1.4)).mean() for one in (warp.source_time, 79 * time)]
    assert errors[0] < 1.5 < errors[1] / 4
    assert mean_correlation(warp.apply(moving[:, :2]), reference) > 0.99


@pytest.mark.parametrize("regularisation", [0.0, 0.1])
def test_constant_and_collinear_channels_do_no_harm(regularisation: float) -> None:
    time = np.linspace(0, 1, 60)
    first, second = curve(time), curve(time**1.3)
    with_more = np.hstack([first, np.full((60, 1), 0.1), first[:, :1] * 2])
    found = generalized_time_warping([with_more, second], regularisation=regularisation)
    assert found.correlation > 0.99
    assert np.isfinite(found.paths).all()


@given(shape=st.tuples(*[st.integers(2, 9)] * 2, *[st.integers(1, 4)] * 2), seed=st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_short_sequences_give_a_result(shape: tuple[int, int, int, int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    sequences = [rng.normal(size=shape[::2]), rng.normal(size=shape[1::2])]
    warp = generalized_pair(*sequences)
    assert (warp.moving_frames, warp.reference_frames) == shape[:2]


@pytest.mark.parametrize(
    ("second", "options", "problem"),
    [
        (np.ones((1, 2)), {}, "sequence 1 has one frame"),
        (np.full((9, 2), 0.1), {}, "sequence 1 does not vary over its 9 frames"),
        (np.array([[0.0], [np.nan]]), {}, "sequence 1 holds nan at frame 1"),
        (np.zeros(4), {}, r"sequence 1 has shape \(4,\)"),
        (np.eye(4), {"rounds": 0}, "rounds is 0"),
        (np.eye(4), {"steps": 1}, "steps is 1"),
        (np.eye(4), {"smoothness": -1.0}, "smoothness is -1"),
        (np.eye(4), {"start": "fine"}, "start is 'fine'"),
        (np.eye(4), {"start": [np.zeros(6)]}, "start has 1 paths; there are 2"),
        (np.eye(4), {"start": [np.zeros(6), np.zeros(7)]}, r"it needs \(6,\)"),
        (np.eye(4), {"ends": "open"}, "ends is 'open'"),
        (np.eye(4), {"ends": ["fixed"]}, "ends has 1 entries; there are 2 sequences"),
        (np.eye(4), {"least_share": 0.0}, "least_share is 0"),
        (np.eye(4), {"regularisation": 2.0}, "regularisation is 2"),
        (np.eye(4), {"bases": {"step": 1}}, "no basis 'step'"),
    ],
)
def test_what_cannot_be_aligned_is_refused(second: np.ndarray, options: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        generalized_time_warping([np.eye(5), second], **options)


def test_the_time_step_refuses_what_does_not_fit() -> None:
    basis = monotone_basis({"tanh": 2}, 5, 8)
    with pytest.raises(ValueError, match="there are 1 sequences"):
        time_step([np.eye(5)], [basis])
    with pytest.raises(ValueError, match="2 sequences and 1 bases"):
        time_step([np.eye(5), np.eye(5)], [basis])
    with pytest.raises(ValueError, match="sequence 1 has 4 frames, its basis is for 5"):
        time_step([np.eye(5), np.eye(4)], [basis, basis])
    with pytest.raises(ValueError, match="sequence 1 has 2 dimensions and sequence 0 5"):
        time_step([np.eye(5), np.eye(5)[:, :2]], [basis, basis])
    with pytest.raises(ValueError, match="sequence 0 has one frame"):
        time_step([np.ones((1, 1)), np.eye(5)[:, :1]], [monotone_basis({"tanh": 2}, 1, 8), basis])


def test_a_programme_without_solution_is_an_error() -> None:
    # x <= -1 and x >= 1.
    rows, none = np.array([[1.0], [-1.0]]), np.zeros((0, 1))
    with pytest.raises(UnsolvedError, match="1 weights ended as PrimalInfeasible"):
        solve_programme(np.eye(1), np.zeros(1), rows, np.array([-1.0, -1.0]), none, np.zeros(0))


def test_a_time_step_says_when_a_programme_was_not_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    def unsolved(*_: object) -> np.ndarray:
        raise UnsolvedError("ended as NumericalError")

    time = np.linspace(0, 1, 30)
    bases = [monotone_basis({"polynomial": 3}, 30, 33) for _ in range(2)]
    sequences = [curve(time), curve(time**1.5)]
    weights = time_step(sequences, bases, iterations=1).weights
    monkeypatch.setattr("motionary.pipeline.alignment.generalized_time.solve_programme", unsolved)
    found = time_step(sequences, bases, weights)
    assert found.ended == "ended as NumericalError"
    assert len(found.errors) == 1
    np.testing.assert_array_equal(np.concatenate(found.weights), np.concatenate(weights))
