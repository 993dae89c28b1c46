"""The CoTW experiment: draws of pairs, measures against slow ones, and all of it on the embedded library."""

import io

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation
from scipy.stats import ttest_ind

from motionary.catalog import Catalog
from motionary.pipeline.alignment import uniform
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.synthetic import ACTIONS as ACTION_NAMES
from motionary.pipeline.synthetic import STYLES, synthetic_library, template_frames
from motionary.workflows.reproduce import cotw as experiment
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw import ANGLES, POSITIONS, study_cotw
from motionary.workflows.reproduce.cotw_measures import (
    FIXED,
    KNOWN,
    METHODS,
    REFERENCES,
    TABLE_3,
    Measurement,
    Measurements,
    known_takes,
    measure_fixed,
    measure_known,
    measure_pair,
    measure_references,
)
from motionary.workflows.reproduce.cotw_report import PAPER, cotw_report, normalised_distance, t_test
from motionary.workflows.reproduce.joint_angles import joint_angles, rotation_vectors
from motionary.workflows.reproduce.labelled import LabelledClips
from motionary.workflows.reproduce.pairs import ANYONE, ONE_PERSON, TWO_PEOPLE, draw_actions

ACTIONS = np.repeat(np.array(list("abcdefgh"), dtype=object), 12)
PEOPLE = np.tile(np.array(["x", "x", "y", "z"], dtype=object), 24)
CLIPS = LabelledClips([f"{name}{i}" for i, name in enumerate(ACTIONS)], ACTIONS, PEOPLE)
SUBJECT = dict(zip(CLIPS.clip_ids, PEOPLE, strict=True))


def test_pairs_are_of_one_action_and_of_whom_they_say():
    drawn = draw_actions(CLIPS, 7, 0)
    assert len(drawn) == 6
    for action in drawn:
        assert list(action.pairs) == [TWO_PEOPLE, ONE_PERSON]
        for people, (moving, reference) in action:
            assert moving != reference
            assert moving[0] == reference[0] == action.name
            assert (SUBJECT[moving] == SUBJECT[reference]) == (people == ONE_PERSON)
        assert all(len(set(pairs)) == 7 for pairs in action.pairs.values())
        assert len(action.members) == 12
    assert {a.name for seed in range(9) for a in draw_actions(CLIPS, 1, seed)} == set("abcdefgh")


def test_all_pairs_are_taken_where_there_are_few():
    (action, *_) = draw_actions(CLIPS, 10_000, 0)
    same = 6 * 5 + 3 * 2 + 3 * 2  # of x, y and z, moving and reference being two roles
    assert [len(pairs) for pairs in action.pairs.values()] == [12 * 11 - same, same]


def test_draws_are_seeded_and_more_keep_the_first():
    few, many, other = (
        [action.pairs[TWO_PEOPLE] for action in draw_actions(CLIPS, *how)] for how in ((3, 5), (9, 5), (3, 6))
    )
    assert few == [pairs[:3] for pairs in many]
    assert few != other


def test_pairs_of_anyone_and_actions_of_a_single_clip():
    clips = LabelledClips(["p", "q", "r", "s", "t"], np.array(list("aabbc"), dtype=object), None)
    drawn = draw_actions(clips, 9, 0)
    assert [action.name for action in drawn] == ["a", "b"]
    assert sorted(drawn[0].pairs[ANYONE]) == [("p", "q"), ("q", "p")]
    # A kind of which only one action has pairs is not there.
    for people, kind in {"xxyyz": ONE_PERSON, "xyxyz": TWO_PEOPLE, "xxxyz": ANYONE}.items():
        known = LabelledClips(clips.clip_ids, clips.classes, np.array(list(people), dtype=object))
        assert [list(action.pairs) for action in draw_actions(known, 9, 0)] == [[kind]] * 2


def turning(frames: int, start: Rotation, place: tuple[float, float, float]) -> Motion:
    """Turn by 10 degrees a frame and walk ahead 2 m a frame, from anywhere."""
    turns = Rotation.from_rotvec(np.outer(10.0 * np.arange(frames), [0, 1, 0]), degrees=True)
    bends = Rotation.from_rotvec(np.outer(-7.0 * np.arange(frames), [1, 0, 0]), degrees=True)
    skeleton = Skeleton(("hips", "spine"), (-1, 0), np.array([[0.0, 0, 0], [0, 1, 0]]))
    root = start.apply(np.outer(np.arange(frames), [0, 0, 2.0])) + place
    # Canonical quaternions leap from one sign to the other at half a turn.
    rotations = np.stack([one.as_quat(canonical=True) for one in (start * turns, bends)], axis=1)
    return Motion("turning", skeleton, 30.0, root, rotations, unit=1.0)


@pytest.mark.parametrize("start", [Rotation.identity(), Rotation.from_euler("YX", [130, 20], degrees=True)])
def test_angles_are_seen_from_the_first_frame_and_do_not_leap(start):
    angles = joint_angles(turning(34, start, (3.0, 1.0, -2.0)), 30.0)
    time = np.arange(34)
    expected = np.zeros((34, 9))
    expected[:, 2], expected[:, 4], expected[:, 6] = 200 * time, 10 * time, -7 * time
    np.testing.assert_allclose(angles, expected, atol=1e-9)


def test_rotation_vectors_are_scipys_up_to_half_a_turn():
    small = np.random.default_rng(0).uniform(-60, 60, (9, 4, 3))
    quaternions = Rotation.from_rotvec(small.reshape(-1, 3), degrees=True).as_quat().reshape(9, 4, 4)
    np.testing.assert_allclose(rotation_vectors(quaternions), small, atol=1e-9)
    np.testing.assert_allclose(rotation_vectors(-quaternions), small, atol=1e-9)
    assert not rotation_vectors(np.tile([0.0, 0, 0, 1], (3, 1, 1))).any()


def value(rows: list[Measurement], method: str, measure: str) -> float:
    (found,) = [row.value for row in rows if (row.method, row.measure) == (method, measure)]
    return found


def test_a_pair_is_measured_by_every_method():
    rng = np.random.default_rng(0)
    moving, reference = rng.normal(size=(2, 30, 3)).cumsum(axis=1)
    moving[:, 1] = reference[:, 1] = 0.5
    rows = measure_pair("p", "a", ("m", "r"), moving, reference)
    assert {row.method for row in rows} == set(METHODS) == set(PAPER)
    for name, align in METHODS.items():
        shown = align(moving, reference, np.array([1.0, 0, 1])).apply(moving)
        rho = [np.corrcoef(shown[:, dof], reference[:, dof])[0, 1] for dof in (0, 2)]
        assert value(rows, name, "correlation") == pytest.approx(np.mean(rho))
        away = [abs(shown[:, dof] - reference[:, dof]).mean() for dof in (0, 2)]
        assert value(rows, name, "distance") == pytest.approx(np.mean(away))
        assert value(rows, name, "seconds") > 0
    assert value(rows, "CoTW", "segment_length") >= value(rows, "CoTW", "slack") + 4
    same = measure_pair("p", "a", ("m", "m"), moving, moving)
    assert all(value(same, name, "correlation") == pytest.approx(1) for name in METHODS)
    assert all(value(same, name, "distance") == 0 for name in METHODS)


def test_table_3_is_for_references_of_two_segments():
    moving, reference = np.random.default_rng(0).normal(size=(2, 80, 2)).cumsum(axis=1)
    rows = measure_fixed("a", ("m", "r"), moving, reference)
    assert {row.part for row in rows} == {FIXED}
    assert TABLE_3 == (40, 20)
    assert measure_fixed("a", ("m", "r"), moving, reference[:79]) == []


def test_known_warps_are_known():
    takes = known_takes(synthetic_library())
    assert {take.action for take in takes} == set(ACTION_NAMES)
    assert not any(take.is_mirrored for take in takes)
    jump = next(one for one in takes if one.action == "jump" and one.motion.fps == 30)
    # Slowly: the take's time at which it shows each frame of the template, and the even time beside it.
    frames = template_frames("jump")
    truth = [np.interp(frame, jump.warp, np.arange(len(jump.warp))) for frame in range(frames)]
    even = uniform(np.zeros((len(jump.warp), 1)), np.zeros((frames, 1))).source_time
    assert value(measure_known(jump), "UTW", "error") == pytest.approx(np.abs(even - truth).mean())


def test_references_are_compared_on_the_clips_that_were_not_chosen():
    time = np.linspace(0, 2 * np.pi, 40)
    shifts = (0.0, 0.1, -0.1, 0.7)
    clips = [np.stack([np.sin(time + shift), np.cos(2 * time + shift)], axis=1) for shift in shifts]
    rows = measure_references("a", list("pqrs"), clips)
    kinds = ["similarity index", "mean", "median", "minimum", "maximum"]
    assert list(dict.fromkeys(row.method for row in rows)) == kinds
    assert {row.reference for row in rows} == {"q", None}
    chosen = [np.mean([np.corrcoef(clips[1][:, d], clips[k][:, d])[0, 1] for d in (0, 1)]) for k in (0, 2, 3)]
    assert value(rows, "similarity index", "correlation") == pytest.approx(np.mean(chosen))
    assert value(rows, "mean", "correlation") > value(rows, "maximum", "correlation")
    assert value(rows, "mean", "roughness") < value(rows, "maximum", "roughness")


def test_the_t_test_is_scipys():
    better, worse = (pd.Series(one) for one in np.random.default_rng(0).normal(size=(2, 6)))
    expected = ttest_ind(better, worse)
    assert t_test(better, worse) == pytest.approx((expected.statistic, expected.pvalue))
    t, p = t_test(better, pd.Series([-3.0] * 6))  # as the distances of UTW, without a warning
    assert t > 0
    assert p < 0.01
    assert np.isnan(t_test(pd.Series([1.0, 1.0]), pd.Series([1.0, 1.0]))[0])


def test_the_papers_t_tests_follow_from_its_means():
    """Means and deviations as printed give its t, up to their rounding: two samples of six, pooled."""
    rng = np.random.default_rng(0)
    for name, shown in {"UTW": 5.53, "DTW": 3.46, "DDTW": 2.37, "CTW": 3.45}.items():
        t = []
        for _ in range(4000):
            slip = rng.uniform(-0.005, 0.005, 4)
            (a, s), (b, u) = PAPER["CoTW"].correlation, PAPER[name].correlation
            t.append((a + slip[0] - b - slip[1]) / np.sqrt(((s + slip[2]) ** 2 + (u + slip[3]) ** 2) / 6))
        assert min(t) < shown < max(t), name
        assert f"t {shown}" in PAPER[name].correlation_test


@pytest.fixture(scope="module")
def conducted(demo_catalog, silent_progress) -> Conducted[Measurements]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiment, "synthetic_library", lambda: synthetic_library()[:: 2 * len(STYLES) - 1])
        return study_cotw(Catalog.open(demo_catalog), "action", 2, 0, silent_progress)


def test_the_experiment_has_every_part(conducted):
    study = conducted.study
    parts = [f"{dofs}, {people}" for dofs in (POSITIONS, ANGLES) for people in (TWO_PEOPLE, ONE_PERSON)]
    # Takes of one person in one action are in two skeletons here, so their angles do not compare.
    assert set(study.of_pairs) <= set(parts)
    assert study.of_pairs[:2] == parts[:2]
    rows = study.to_arrow().to_pandas()
    assert set(rows.part) == {*study.of_pairs, FIXED, KNOWN, REFERENCES}
    assert not rows.drop(columns=["moving", "reference"]).isna().any(axis=None)
    assert not rows.duplicated(["part", "action", "moving", "reference", "method", "measure"]).any()
    main = study.of_pairs[0]
    distance = normalised_distance(study, main)
    assert len(distance) == 6
    assert (distance.max(axis=1) == 1).all()
    correlation = study.by_action(main, "correlation").mean()
    assert correlation["UTW"] < min(correlation["DTW"], correlation["CoTW"])
    errors = study.of(KNOWN, "error").mean()
    assert max(errors["CoTW"], errors["CTW"]) < errors["DTW"] < errors["UTW"]
    assert errors["DDTW"] < errors["DTW"]
    distortion = study.of(main, "distortion").mean()
    assert distortion["CoTW"] < distortion["CoTW, alpha 0"]


def test_an_actions_mean_is_over_its_pairs():
    rows = [
        Measurement("p", action, moving, "r", "UTW", "distance", number)
        for action, moving, number in (("a", "1", 1.0), ("a", "2", 2.0), ("b", "1", 4.0))
    ]
    assert Measurements(rows).by_action("p", "distance")["UTW"].to_dict() == {"a": 1.5, "b": 4.0}
    assert Measurements(rows).of("p", "correlation").empty


def test_the_report_sets_ours_beside_the_papers(conducted):
    shown = io.StringIO()
    Console(file=shown, width=200).print(cotw_report(conducted))
    text = shown.getvalue()
    lines = text.splitlines()
    assert all(len(line) <= 200 for line in lines)
    assert len(lines) < 80
    for words in (
        "Figure 8",
        "Figure 10",
        "Figure 11",
        "Table 3",
        "Known warps",
        "6 actions (action), seed 0",
    ):
        assert words in text
    (cotw,) = [line for line in lines if line.startswith("CoTW") and "0.65 ± 0.15" in line]
    mean = conducted.study.by_action(conducted.study.of_pairs[0], "correlation")["CoTW"].mean()
    assert f"{mean:.2f} ±" in cotw
    (dtw,) = [line for line in lines if line.startswith("DTW") and "0.76 ± 0.16" in line]
    assert "t 3.46, p < .01" in dtw
    for name in PAPER:
        assert sum(line.startswith(f"{name} ") for line in lines) >= 2
