import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from motionary.catalog import Catalog
from motionary.pipeline.alignment.adaptive import adaptive_dtw, eigenposture_coordinates
from motionary.pipeline.alignment.dtw import dtw
from motionary.pipeline.alignment.postures import linearised_postures, posture_weights
from motionary.pipeline.evaluation import jerk, longest_stay, path_deviation
from motionary.pipeline.synthetic import synthetic_library
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce import adaptive_dtw as experiment
from motionary.workflows.reproduce.adaptive_dtw import (
    Library,
    comparable_pairs,
    pairs_to_join,
    study_adaptive_dtw,
)
from motionary.workflows.reproduce.adaptive_dtw_measures import (
    ADAPTIVE,
    CONSTRAINED,
    LIMITED,
    METHODS,
    SEQUENCES,
    SETTINGS,
    TAKES,
    WITH_SETTINGS,
    measure_known,
    measure_pair,
)
from motionary.workflows.reproduce.adaptive_dtw_report import PAPER, adaptive_dtw_report, claims
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw_measures import KNOWN, Measurement, Measurements
from motionary.workflows.reproduce.labelled import LabelledClips


@pytest.fixture(scope="module")
def conducted(silent_progress) -> Conducted[Measurements]:
    """Conduct it on the walks and jumps of one rig alone."""
    library = synthetic_library()
    takes = [take for take in library if take.action in ("walk", "jump") and take.convention == "mixamo"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "synthetic_library", lambda: takes)
        return study_adaptive_dtw(None, "action", 1, 0, silent_progress)


def test_a_pair_is_measured_by_every_method():
    takes = [take for take in synthetic_library() if take.action == "walk" and take.convention == "mixamo"]
    moving, reference = takes[0].motion, takes[1].motion
    rows = measure_pair(TAKES, "walk", ("m", "r"), moving, reference, 30.0)
    found = {(row.method, row.measure): row.value for row in rows}
    assert {name for name, _ in found} == set(METHODS)
    before, after = linearised_postures(moving, reference, 30.0)
    weights = posture_weights(reference.skeleton)
    one, other = eigenposture_coordinates(before, after, weights)
    warp, plain = adaptive_dtw(before, after, weights), dtw(one, other)
    assert found[ADAPTIVE, "stay"] == longest_stay(warp.path)
    assert found[ADAPTIVE, "deviation"] == path_deviation(warp.source_time, plain.source_time) > 0
    assert found[ADAPTIVE, "jerk"] == pytest.approx(jerk(warp.apply(one)) / jerk(other))
    assert found[ADAPTIVE, "distance"] == pytest.approx(
        np.sqrt(((warp.apply(one) - other) ** 2).sum(axis=1)).mean()
    )
    assert found["DTW", "deviation"] == 0
    assert found[LIMITED, "stay"] <= 2
    assert all(found[name, "seconds"] > 0 for name in METHODS)


def test_lengths_too_different_for_short_stays_leave_that_method_out():
    motion = synthetic_library()[0].motion
    short = motion.sampled(np.arange(6.0))
    rows = measure_pair(TAKES, "a", ("m", "r"), short, motion, motion.fps)
    assert {row.method for row in rows} == set(METHODS) - {LIMITED}
    still = replace(short, rotations=np.repeat(short.rotations[:1], 6, axis=0))
    assert measure_pair(TAKES, "a", ("m", "r"), motion, still, motion.fps) == []


def test_only_clips_of_the_same_joints_are_paired():
    clips = LabelledClips(list("pqrst"), np.array(list("aaabb"), dtype=object), None)
    joints = {"p": ("x", "y"), "q": ("y", "x"), "r": ("x", "z"), "s": ("x",)}  # t is of markers
    library = Library(clips, joints, lambda clip_id: None, 30.0, ())
    pairs = comparable_pairs(library, 9, 0)
    assert {name: sorted(of) for name, of in pairs.items()} == {"a": [("p", "q"), ("q", "p")]}
    assert comparable_pairs(library, 1, 0)["a"] == pairs["a"][:1]


def test_a_person_with_a_rig_of_their_own_is_compared_with_themselves():
    ids = [f"{action}{who}{take}" for action in "ab" for who in "pq" for take in "12"]
    classes, who = (np.array([one[place] for one in ids], dtype=object) for place in (0, 1))
    joints = {one: (one[1], "y") for one in ids}
    pairs = comparable_pairs(Library(LabelledClips(ids, classes, who), joints, None, 30.0, ()), 9, 0)
    assert {name: sorted(of) for name, of in pairs.items()} == {
        action: [
            (f"{action}{one}", f"{action}{other}")
            for one, other in (("p1", "p2"), ("p2", "p1"), ("q1", "q2"), ("q2", "q1"))
        ]
        for action in "ab"
    }


def test_pairs_of_two_people_come_first():
    ids = [f"a{who}{take}" for who in "pq" for take in "123"]
    who = np.array([one[1] for one in ids], dtype=object)
    clips = LabelledClips(ids, np.array(["a"] * 6, dtype=object), who)
    library = Library(clips, dict.fromkeys(ids, ("x",)), None, 30.0, ())
    (every,) = comparable_pairs(library, 99, 3).values()
    assert len(set(every)) == len(every) == 30
    assert [one[1] == other[1] for one, other in every] == [False] * 18 + [True] * 12
    (some,) = comparable_pairs(library, 20, 3).values()
    assert some == every[:20]
    assert comparable_pairs(library, 20, 4)["a"] != some


def test_six_actions_are_drawn_of_those_that_can_be_compared():
    ids = [f"{action}{take}" for action in "abcdefghijkl" for take in "12"]
    clips = LabelledClips(ids, np.array([one[0] for one in ids], dtype=object), None)
    joints = {one: ("x",) if one[0] in "aceghikl" or one[1] == "1" else ("z",) for one in ids}
    drawn = [set(comparable_pairs(Library(clips, joints, None, 30.0, ()), 1, seed)) for seed in range(9)]
    assert all(len(one) == 6 for one in drawn)
    assert set.union(*drawn) == set("aceghikl")


def test_pairs_are_joined_rig_by_rig():
    joints = {f"{rig}{k}": (rig,) for rig in "xy" for k in range(9)}
    library = Library(None, joints, None, 30.0, ())
    x, y = ([(f"{rig}{k}", f"{rig}{k + 1}") for k in range(4)] for rig in "xy")
    pairs = {"a": [x[0], y[0], x[1]], "b": [y[1], x[2]], "c": [x[3]]}
    assert pairs_to_join(library, pairs) == [[x[0], x[2], x[3]], [y[0], y[1]]]


def test_an_error_of_any_other_method_is_not_passed_over():
    def broken(moving, reference):
        raise ValueError("what is wrong")

    motion = synthetic_library()[0].motion
    with pytest.raises(ValueError, match="what is wrong"):
        measure_pair(TAKES, "a", ("m", "r"), motion, motion, 30.0, methods={ADAPTIVE: broken})
    assert measure_pair(TAKES, "a", ("m", "r"), motion, motion, 30.0, methods={LIMITED: broken}) == []


def test_the_experiment_has_every_part(conducted):
    study = conducted.study
    rows = study.to_arrow().to_pandas()
    assert set(rows.part) == {TAKES, SEQUENCES, SETTINGS, KNOWN}
    assert not rows.isna().any(axis=None)
    assert not rows.duplicated(["part", "action", "moving", "reference", "method", "measure"]).any()
    assert set(study.of(SETTINGS, "stay").columns) == set(WITH_SETTINGS)
    assert (study.of(TAKES, "deviation")["DTW"] == 0).all()
    # Takes joined, a walk and a jump: names and lengths say so.
    ((_, moving, reference),) = study.of(SEQUENCES, "stay").index
    assert "walk" in moving
    assert "jump" in moving
    assert " + " in reference
    errors = study.of(KNOWN, "error").mean()
    assert errors["DTW"] < errors[ADAPTIVE] < errors[CONSTRAINED]


def test_a_known_warp_is_measured_against_its_truth():
    take = next(one for one in synthetic_library() if one.action == "jump" and one.convention == "mixamo")
    rows = {row.method: row.value for row in measure_known(take)}
    assert set(rows) == set(METHODS)
    assert rows["DTW"] < 3
    even = replace(take, warp=np.linspace(take.warp[0], take.warp[-1], len(take.warp)))
    assert rows["DTW"] < {row.method: row.value for row in measure_known(even)}["DTW"]


def test_the_report_sets_ours_beside_what_the_paper_says(conducted):
    shown = io.StringIO()
    Console(file=shown, width=200).print(adaptive_dtw_report(conducted))
    text = shown.getvalue()
    assert all(len(line) <= 200 for line in text.splitlines())
    for words in (
        *PAPER.values(),
        "Known warps",
        "radius 3, K 5",
        "prints\nno numbers",
        "seed 0",
        "stands still for less",
    ):
        assert words in text
    assert "Pairs of takes: 2, of 2 of 2 actions; of sequences of takes joined: 1." in text
    stay = conducted.study.of(TAKES, "stay")[ADAPTIVE].mean()
    (line, *_) = [line for line in text.splitlines() if line.startswith(ADAPTIVE)]
    assert f" {stay:.1f} " in line


def test_claims_are_judged_by_the_numbers():
    def judged(stay: float, rough: float, away: float) -> list[bool]:
        values = {"stay": stay, "jerk": rough, "deviation": away}
        rows = [
            Measurement(SEQUENCES, "all", "m", "r", name, measure, value if name == ADAPTIVE else 5.0)
            for name in METHODS
            for measure, value in values.items()
        ]
        return [one.holds for one in claims(Measurements(rows))]

    assert judged(4, 4, 4) == [True] * 4
    assert judged(6, 4, 4) == [False, True, True, True]
    assert judged(4, 6, 6) == [True, False, False, False]


def test_claims_compare_what_both_methods_align_and_print_it():
    """Where LIMITED finds no path, adaptive DTW lies far away; that must not count against it."""
    away = {"r1": {ADAPTIVE: 2.0, LIMITED: 3.0, CONSTRAINED: 8.5}, "r2": {ADAPTIVE: 9.0, CONSTRAINED: 6.5}}
    rows = [
        Measurement(SEQUENCES, "several", "m", reference, name, measure, values.get(name, 1.0))
        for reference, values in away.items()
        for name in ("DTW", *values)
        for measure in ("stay", "jerk", "deviation")
    ]
    *_, limited, constrained = claims(Measurements(rows))
    assert limited.claim.endswith("than constrained DTW, 2 steps")
    assert limited.holds
    assert limited.here == "deviation 2.00 against 3.00, means over 1 of 2 sequences"
    assert constrained.claim.endswith("than constrained DTW, K 2")
    assert constrained.holds
    assert constrained.here == "deviation 5.50 against 7.50, means over 2 sequences"
    without = [row for row in rows if row.method != LIMITED]
    untold = claims(Measurements(without))[2]
    assert untold.holds is None
    assert "constrained DTW, 2 steps aligns none" in untold.here


def test_a_catalog_of_other_rigs_is_refused_and_one_of_the_same_read(
    demo_catalog, silent_progress, monkeypatch
):
    catalog = Catalog.open(demo_catalog)
    library = experiment._catalogued(catalog, "action")
    pairs = comparable_pairs(library, 2, 0)
    assert len(pairs) > 2
    for of_action in pairs.values():
        for pair in of_action:
            motions = [library.read(one) for one in pair]
            assert motions[0].skeleton.names == motions[1].skeleton.names
    monkeypatch.setattr(experiment, "comparable_pairs", lambda *_: {})
    with pytest.raises(UserError, match="leave out CATALOG"):
        study_adaptive_dtw(catalog, "action", 1, 0, silent_progress)
