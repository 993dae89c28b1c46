"""The GTW experiments: sequences that are what they say, claims judged by their figures, and GTW the best."""

import io
import itertools
import math
import re

import numpy as np
import pytest
from rich.console import Console

from motionary.pipeline.alignment import Itakura, SakoeChiba, dtw, generalized_time_warping
from motionary.pipeline.alignment.bases import monotone_basis
from motionary.pipeline.alignment.generalized_time import time_step
from motionary.pipeline.alignment.procrustes import (
    procrustes_derivative_dtw,
    procrustes_dtw,
    procrustes_motion_warping,
)
from motionary.pipeline.alignment.steps_to_mean import uniform_path
from motionary.workflows.reproduce.claims import Claim, claims_table
from motionary.workflows.reproduce.gtw import (
    PAIRS,
    SETS,
    GtwExperiment,
    GtwMeasurement,
    GtwStudy,
    measure,
    study_gtw,
)
from motionary.workflows.reproduce.gtw_claims import BASELINES, error_claims, growth, set_claims, time_claims
from motionary.workflows.reproduce.gtw_methods import GTW, PAIR_METHODS, PAPER_METHODS, SET_METHODS
from motionary.workflows.reproduce.gtw_report import gtw_report
from motionary.workflows.reproduce.gtw_sequences import (
    ANYWHERE,
    CHOICES,
    LATENT_FRAMES,
    STRETCHES,
    curve_pair,
    known_path,
    spiral_set,
)


def spiral():
    rows = []
    for k in range(LATENT_FRAMES):
        angle = 4 * np.pi * (k / (LATENT_FRAMES - 1)) ** 0.5
        rows.append((angle * np.cos(angle), angle * np.sin(angle)))
    return np.array(rows)


def first_shown(truth):
    """Latent frames at which a sequence's own frames stand, from its column of the truth."""
    return [int(np.argmax(truth >= frame - 1e-9)) for frame in range(round(truth[-1]) + 1)]


@pytest.mark.parametrize("choice", CHOICES)
@pytest.mark.parametrize("latent", [100, 300, 473])
def test_columns_rise_and_are_as_many_as_drawn(choice, latent):
    rng = np.random.default_rng(0)
    for _ in range(50):
        columns = CHOICES[choice](latent, rng)
        assert columns[0] >= 0
        assert columns[-1] < latent
        assert (np.diff(columns) > 0).all()
        assert 0.29 <= len(columns) / latent <= 0.91
    assert choice == ANYWHERE or columns[-1] == latent - 1


def test_the_truth_has_a_row_for_every_latent_frame():
    truth = known_path([np.array([1, 2, 6]), np.array([0, 3, 4, 7])], 8)
    np.testing.assert_allclose(truth[:, 0], [0, 0, 1, 1.25, 1.5, 1.75, 2, 2])
    np.testing.assert_allclose(truth[:, 1], [0, 1 / 3, 2 / 3, 1, 2, 7 / 3, 8 / 3, 3])


@pytest.mark.parametrize("choice", CHOICES)
def test_sets_are_affine_images_of_the_spiral_in_the_time_of_the_truth(choice):
    known = spiral_set(choice, 0, 3)
    assert known.truth.shape == (LATENT_FRAMES, 3)
    maps = []
    for values, truth in zip(known.sequences, known.truth.T, strict=True):
        # The first frame may be held before its own: its latent frame is the last of these.
        held = np.array(first_shown(truth))
        held[0] = np.flatnonzero(truth <= 0)[-1]
        latent = np.column_stack([spiral()[held], np.ones(len(held))])
        found, *_ = np.linalg.lstsq(latent, values[:, :2])
        np.testing.assert_allclose(latent @ found, values[:, :2], atol=1e-9)
        assert np.linalg.matrix_rank(found[:2]) == 2
        assert 1.5 < values[:, 2].std() < 2.5
        maps.append(found)
    assert np.abs(maps[0] - maps[1]).max() > 0.1


def test_pairs_are_one_curve_in_the_time_of_the_truth():
    for number in range(20):
        known = curve_pair(200, 1, number)
        shorter, longer = sorted(known.lengths)
        assert longer - 1 <= 2 * (shorter - 1)
        both = (np.abs(known.truth - known.truth.round()) < 1e-9).all(axis=1)
        both[: 1 + np.flatnonzero((known.truth <= 0).any(axis=1))[-1]] = False  # one of them has not begun
        frames = known.truth[both].round().astype(int)
        assert len(frames) > 10
        one, other = (values[at, 0] for values, at in zip(known.sequences, frames.T, strict=True))
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_sequences_are_seeded():
    first, again = spiral_set(STRETCHES, 4, 2), spiral_set(STRETCHES, 4, 2)
    np.testing.assert_array_equal(first.sequences[1], again.sequences[1])
    for other in (spiral_set(STRETCHES, 4, 3), spiral_set(STRETCHES, 5, 2)):
        assert not np.array_equal(first.truth, other.truth)
    np.testing.assert_array_equal(curve_pair(90, 0, 1).truth, curve_pair(90, 0, 1).truth)
    assert not np.array_equal(curve_pair(90, 0, 1).truth, curve_pair(90, 0, 2).truth)


def test_a_small_study_measures_every_method_and_prints(silent_progress):
    experiment = study_gtw(1, 0, silent_progress, lengths=(60, 90))
    study = experiment.study
    counts = {part: sum(row.part == part for row in study.rows) for part in (SETS, PAIRS)}
    assert counts == {SETS: sum(map(len, SET_METHODS.values())), PAIRS: 2 * len(PAIR_METHODS)}
    assert all(np.isfinite(row.error) and row.error >= 0 and row.seconds >= 0 for row in study.rows)
    table = study.to_arrow()
    assert table.num_rows == len(study.rows)
    assert set(table["method"].to_pylist()) == {*PAIR_METHODS, *SET_METHODS[STRETCHES]}
    said = printed(experiment)
    for name in {*PAIR_METHODS, *SET_METHODS[STRETCHES]}:
        assert name in said
    assert "nan" not in said


def printed(experiment):
    console = Console(file=io.StringIO(), width=250)
    console.print(gtw_report(experiment))
    return console.file.getvalue()


def test_claims_stand_in_a_table_no_wider_than_a_page():
    long = "a word " * 40
    rows = [Claim("it is so", True, "1 of 2"), Claim(long, False, long), Claim("who knows", None, "nothing")]
    console = Console(file=io.StringIO(), width=10_000)
    console.print(claims_table(rows, "A title"))
    lines = [line.rstrip() for line in console.file.getvalue().splitlines()]
    assert lines[0] == "A title"
    assert max(map(len, lines)) <= 140
    verdicts = (
        "it is so  .* holds +1 of 2",
        "a word .* does NOT hold  a word",
        "who knows .* not measured +nothing",
    )
    for verdict in verdicts:
        assert sum(re.fullmatch(verdict + ".*", line) is not None for line in lines) == 1


def made_up(errors, powers, gtw=1.0, baselines=2.0):
    """A study whose pairs' errors (shares of the length) and powers of seconds are given by method."""
    rows = []
    for columns, methods in SET_METHODS.items():
        for number in range(3):
            for name in methods:
                error = gtw if name == GTW else baselines
                rows.append(GtwMeasurement(SETS, columns, LATENT_FRAMES, number, name, error, 1.0))
    for frames in (100, 200, 400, 800):
        for number in range(2):
            for name in PAIR_METHODS:
                error, seconds = errors[name] * frames, (frames / 200) ** powers[name]
                rows.append(GtwMeasurement(PAIRS, STRETCHES, frames, number, name, error, seconds))
    return GtwStudy(rows)


AS_PUBLISHED = {
    "uniform": 0.9, "DTW": 0.1, "DTW-SC": 0.4, "DTW-IP": 0.3, "GN 6": 0.5, "GN 10": 0.4, "GN 14": 0.2
}  # fmt: skip
POWERS = {
    "uniform": 1.0, "DTW": 2.0, "DTW-SC": 1.9, "DTW-IP": 1.8, "GN 6": 0.9, "GN 10": 1.0, "GN 14": 1.1
}  # fmt: skip


def holding(claims):
    return [claim.holds for claim in claims]


def test_claims_that_hold():
    study = made_up(AS_PUBLISHED, POWERS)
    assert holding(set_claims(study) + error_claims(study)) == [True] * 6
    assert "least in 3 of 3 sets" in set_claims(study)[0].here
    assert growth(study).to_dict() == pytest.approx({k: v for k, v in POWERS.items() if k != "uniform"})
    slowest, windows, linear, square, quickest = time_claims(study)
    assert linear.holds
    assert "GN 6 0.90, GN 10 1.00, GN 14 1.10, fitted over 400 to 800 latent frames" in linear.here
    assert square.holds
    # From 200 frames down all take more than DTW, as the powers are made.
    assert not slowest.holds
    assert not windows.holds
    assert not quickest.holds
    assert "at 2 of 4 lengths, always from 400 latent frames on" in slowest.here


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"DTW": 0.25}, 0),
        ({"DTW-IP": 0.19, "DTW-SC": 0.35}, 1),
        ({"DTW-IP": 0.35, "DTW-SC": 0.19}, (1, 2)),
        ({"DTW-IP": 0.45}, 2),
        ({"GN 14": 0.29, "GN 10": 0.25}, 3),
    ],
)
def test_claims_on_errors_that_do_not_hold(changes, place):
    study = made_up({**AS_PUBLISHED, **changes}, POWERS)
    places = place if isinstance(place, tuple) else (place,)
    assert holding(error_claims(study)) == [k not in places for k in range(4)]
    assert "does NOT hold" in printed(GtwExperiment(study, 0))


def test_gtw_that_is_not_the_best_is_said_not_to_be():
    assert not any(holding(set_claims(made_up(AS_PUBLISHED, POWERS, gtw=2.5))))


@pytest.mark.parametrize(
    ("changes", "linear", "square"),
    [
        ({"GN 10": 1.3}, False, True),
        ({"GN 6": 0.1, "GN 10": 0.1, "GN 14": 0.1}, True, True),
        ({"DTW": 1.4}, True, False),
        ({"DTW": 2.6}, True, False),
    ],
)
def test_growth_is_bounded_on_both_sides_where_the_paper_bounds_it(changes, linear, square):
    found = time_claims(made_up(AS_PUBLISHED, {**POWERS, **changes}))
    assert holding(found)[2:4] == [linear, square]


def test_a_single_length_has_no_growth():
    study = made_up(AS_PUBLISHED, POWERS)
    single = GtwStudy([row for row in study.rows if row.part == SETS or row.latent_frames == 400])
    assert growth(single).isna().all()
    assert holding(time_claims(single))[2:4] == [None, None]
    assert "DTW -," in printed(GtwExperiment(single, 0))


@pytest.fixture(scope="module")
def spirals():
    return spiral_set(STRETCHES, 0, 0).sequences


def by_gtw(sequences, start="uniform", ends="fixed"):
    return generalized_time_warping(
        sequences, bases={"polynomial": 3, "tanh": 3}, smoothness=0.0, regularisation=0.0, kept=0.9,
        start=start, ends=ends, steps=300,
    ).paths  # fmt: skip


SET_CALLS = {
    "uniform": lambda sequences: uniform_path([len(values) for values in sequences], 300),
    "pDTW": lambda sequences: procrustes_dtw(sequences, 300).path,
    "pDDTW": lambda sequences: procrustes_derivative_dtw(sequences, 300).path,
    "pIMW": lambda sequences: procrustes_motion_warping(sequences, 300).path,
    "GTW": by_gtw,
    "GTW, ends relaxed": lambda sequences: by_gtw(sequences, ends="relaxed"),
    "GTW, coarse start": lambda sequences: by_gtw(sequences, start="coarse"),
}


@pytest.fixture(scope="module")
def curves():
    return curve_pair(600, 0, 18).sequences


def by_gauss_newton(sequences, each):
    steps = math.ceil(1.1 * max(map(len, sequences)))
    bases = [monotone_basis({"polynomial": each, "tanh": each}, len(values), steps) for values in sequences]
    return np.stack([warp.source_time for warp in time_step(sequences, bases).warps], axis=1)


PAIR_CALLS = {
    "uniform": lambda pair: uniform_path(
        [len(values) for values in pair], math.ceil(1.1 * max(map(len, pair)))
    ),
    "DTW": lambda pair: dtw(*pair).path,
    "DTW-SC": lambda pair: dtw(*pair, window=SakoeChiba(0.1)).path,
    "DTW-IP": lambda pair: dtw(*pair, window=Itakura(2.0)).path,
    "GN 6": lambda pair: by_gauss_newton(pair, 3),
    "GN 10": lambda pair: by_gauss_newton(pair, 5),
    "GN 14": lambda pair: by_gauss_newton(pair, 7),
}


@pytest.mark.parametrize("name", SET_CALLS)
def test_a_sets_method_is_what_it_is_called(name, spirals):
    np.testing.assert_array_equal(SET_METHODS[STRETCHES][name](spirals), SET_CALLS[name](spirals))


@pytest.mark.parametrize("name", PAIR_CALLS)
def test_a_pairs_method_is_what_it_is_called(name, curves):
    np.testing.assert_array_equal(PAIR_METHODS[name](curves), PAIR_CALLS[name](curves))


def test_no_two_methods_find_one_path(spirals, curves):
    """So that none can pass for another in the tests above."""
    assert list(SET_CALLS) == list(SET_METHODS[STRETCHES])
    assert list(PAIR_CALLS) == list(PAIR_METHODS)
    for calls, sequences in ((SET_METHODS[STRETCHES], spirals), (PAIR_METHODS, curves)):
        paths = [align(sequences) for align in calls.values()]
        for one, other in itertools.combinations(paths, 2):
            assert not np.array_equal(one, other)


@pytest.mark.slow
@pytest.mark.parametrize("choice", CHOICES)
def test_gtw_is_the_best_of_the_papers_methods(choice):
    assert set(PAPER_METHODS) == {"uniform", *BASELINES, GTW}
    sets = [
        measure(SETS, choice, LATENT_FRAMES, number, spiral_set(choice, 0, number), PAPER_METHODS)
        for number in range(8)
    ]
    errors = {
        name: np.array([row.error for rows in sets for row in rows if row.method == name])
        for name in PAPER_METHODS
    }
    for other in ("uniform", *BASELINES):
        assert errors[GTW].mean() < errors[other].mean()
        assert (errors[GTW] < errors[other]).mean() > 0.7
