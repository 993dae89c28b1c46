"""The papers' experiments: draws, scores against slow references, and the command on the embedded library."""

import io
import json
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import pdist, squareform
from sklearn.metrics import silhouette_score

from motionary.catalog import Catalog
from motionary.pipeline.clustering import average_linkage, complete_linkage, cut_tree, ward_linkage
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import motion_features
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce import dtw_curve
from motionary.workflows.reproduce.better import (
    CHOSEN,
    DEFAULT,
    features_with_velocity,
    flexible_linkage,
    locally_scaled,
)
from motionary.workflows.reproduce.combinations import StudiedDistance, pairs_among
from motionary.workflows.reproduce.draws import PAPER_SIZES, RULES, WHOLE, draw
from motionary.workflows.reproduce.dtw_curve import Experiment, study_dtw_curve
from motionary.workflows.reproduce.labelled import labelled_clips
from motionary.workflows.reproduce.report import report
from motionary.workflows.reproduce.scores import MEASURES, score_set
from motionary.workflows.reproduce.silhouette import silhouette_cut
from motionary.workflows.reproduce.study import Combination, mean_of, run_study

BIG = np.repeat(list("abcdefgh"), 30)
CLASSES = np.array(["a"] * 25 + ["b"] * 8 + ["c"] * 6 + ["d"] * 3)


@pytest.fixture
def motionary(motionary):
    """Run a command and read what it prints as bytes."""
    return partial(motionary, binary=True)


def sizes(rule: str, number: int, classes: np.ndarray = BIG, seed: int = 0) -> list[int]:
    chosen = draw(classes, rule, seed, number)
    assert (np.diff(chosen) > 0).all()
    return np.unique(classes[chosen], return_counts=True)[1].tolist()


def test_a_draw_respects_its_sizes():
    seen = [sizes("6-20", number) for number in range(40)]
    assert {len(one) for one in seen} == {6}
    assert {size for one in seen for size in one} == set(range(6, 21))
    assert all(sorted(sizes("paper", number)) == sorted(PAPER_SIZES) for number in range(9))
    assert all(sorted(sizes("one large", number)) == [5, 5, 5, 5, 5, 20] for number in range(9))
    assert sizes(WHOLE, 0) == [30] * 8
    # Every class comes, and each may be the large one.
    assert {kind for n in range(40) for kind in BIG[draw(BIG, "6-20", 0, n)]} == set("abcdefgh")
    largest = [np.unique(BIG[draw(BIG, "one large", 0, n)], return_counts=True) for n in range(60)]
    assert {names[counts.argmax()] for names, counts in largest} == set("abcdefgh")


def test_a_small_class_gives_all_it_has_and_a_smaller_one_is_not_drawn():
    for rule in RULES:
        for number in range(20):
            kinds, counts = np.unique(CLASSES[draw(CLASSES, rule, 0, number)], return_counts=True)
            assert kinds.tolist() == ["a", "b", "c"]
            assert (counts <= [20, 8, 6]).all()
    assert sizes(WHOLE, 0, CLASSES) == [25, 8, 6, 3]


def test_a_draw_is_seeded():
    for rule in RULES:
        first = draw(BIG, rule, 3, 5)
        assert first.tolist() == draw(BIG, rule, 3, 5).tolist()
        assert first.tolist() != draw(BIG, rule, 4, 5).tolist()
        assert first.tolist() != draw(BIG, rule, 3, 6).tolist()


def test_what_cannot_be_drawn():
    with pytest.raises(ValueError, match="1 classes have 6 clips or more"):
        draw(["a"] * 9 + ["b"] * 5, "6-20", 0, 0)
    with pytest.raises(ValueError, match="rule is '7-9'"):
        draw(BIG, "7-9", 0, 0)


def test_pairs_of_some_clips_are_their_sub_matrix():
    condensed = np.random.default_rng(0).random(45)
    chosen = np.array([0, 2, 3, 7, 9])
    expected = squareform(squareform(condensed)[np.ix_(chosen, chosen)])
    assert condensed[pairs_among(chosen, 10)].tolist() == expected.tolist()


@pytest.mark.parametrize("method", [complete_linkage, average_linkage, ward_linkage])
@pytest.mark.parametrize("seed", range(4))
def test_silhouettes_are_scikit_learns(method, seed):
    points = np.random.default_rng(seed).normal(size=(24, 2)).round(1)
    condensed = pdist(points)
    Z = method(condensed)
    levels = silhouette_cut(Z, condensed)
    assert levels.kappa.tolist() == list(range(23, 1, -1))
    expected = [
        silhouette_score(squareform(condensed), cut_tree(Z, n_clusters=kappa), metric="precomputed")
        for kappa in levels.kappa
    ]
    np.testing.assert_allclose(levels.score, expected, atol=1e-12)
    assert levels.score[levels.kappa == levels.n_clusters][0] == pytest.approx(max(expected), abs=0.02)


def test_flexible_linkage_without_beta_is_scipys_weighted():
    condensed = pdist(np.random.default_rng(1).normal(size=(30, 3)))
    ours, theirs = flexible_linkage(condensed, beta=0.0), linkage(condensed, "weighted")
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_flexible_linkage_by_the_definition():
    condensed = pdist(np.random.default_rng(2).normal(size=(14, 2)))
    square = squareform(condensed)
    distance = {frozenset((i, j)): square[i, j] for i in range(14) for j in range(i)}
    for node, row in enumerate(flexible_linkage(condensed), start=14):
        pair = min(distance, key=distance.__getitem__)
        height = distance.pop(pair)
        i, j = pair
        assert set(row[:2]) == pair
        assert row[2] == pytest.approx(height)
        for k in {one for both in distance for one in both} - pair:
            near = distance.pop(frozenset((i, k))), distance.pop(frozenset((j, k)))
            distance[frozenset((k, node))] = 0.625 * sum(near) - 0.25 * height


def test_local_scales():
    square = squareform(pdist(np.random.default_rng(3).normal(size=(9, 2))))
    scale = [sorted(row)[4] for row in square]  # the clip itself, then ceil(log2 9) = 4 others
    scaled = squareform(locally_scaled(squareform(square)))
    for i in range(9):
        for j in range(9):
            assert scaled[i, j] == pytest.approx(square[i, j] / np.sqrt(scale[i] * scale[j]))
    assert np.isfinite(locally_scaled(np.zeros(6))).all()


def test_velocity_stands_beside_the_pose(demo_catalog):
    motion = Catalog.open(demo_catalog).motion("walk/walk_neutral_alex_01.bvh")
    config = FeatureConfig(epsilon=0.0)
    plain = motion_features(motion, config)
    assert features_with_velocity(motion, config, 0.0).tolist() == plain.tolist()
    more = features_with_velocity(motion, config, 0.05)
    assert more.shape == (len(plain), 59 + 57)
    assert more[:, :59].tolist() == plain.tolist()
    by_hand = 0.05 * (plain[11, 5] - plain[9, 5]) * 30 / 2
    assert more[10, 59 + 5] == pytest.approx(by_hand, abs=1e-6)
    merging = FeatureConfig(epsilon=0.1)
    assert len(features_with_velocity(motion, merging, 0.05)) == len(motion_features(motion, merging))


def test_a_perfect_distance_scores_best_and_a_random_one_does_not():
    known = np.array(["a"] * 6 + ["b"] * 8, dtype=object)
    who = np.array(["x", "y"] * 7, dtype=object)
    apart = squareform((known[:, None] != known[None, :]) * 1.0)
    rng = np.random.default_rng(0)
    perfect = score_set(StudiedDistance("d", apart + rng.random(len(apart)) / 9), known, who)
    random = score_set(StudiedDistance("d", rng.random(len(apart))), known, who)
    assert list(perfect) == ["complete", "average", "ward"]
    for by_measure in perfect.values():
        assert set(by_measure) == set(MEASURES)
        for name in MEASURES:
            if name not in ("ari_modularity", "true_strip"):
                assert by_measure[name] == pytest.approx(1.0), name
        assert by_measure["true_strip"] > 0.5
    assert all(one["ari"] < 0.5 and one["mean_average_precision"] < 0.9 for one in random.values())
    low, high = apart, apart + 0.1
    assert list(score_set(StudiedDistance("f", low, (low, high)), known, who)) == ["fuzzy"]
    alone = score_set(StudiedDistance("d", apart), known, np.full(14, "x", dtype=object))
    assert np.isnan(alone["ward"]["nearest_neighbour"])


def test_a_study_takes_differences_set_by_set():
    known = CLASSES.astype(object)
    rng = np.random.default_rng(0)
    good = squareform((known[:, None] != known[None, :]) * 1.0) + rng.random(len(known) * 41 // 2)
    distances = {"f": [StudiedDistance("good", good), StudiedDistance("bad", rng.random(len(good)))]}
    steps = []
    study = run_study(distances, known, None, 5, 0, lambda: steps.append(1))
    assert len(steps) == len(study.sets) == 3 * 5 + 1
    a, b = Combination("f", "good", "ward"), Combination("f", "bad", "ward")
    difference = study.mean("paper", a, "ari", minus=b)
    assert difference.value == pytest.approx(
        study.mean("paper", a, "ari").value - study.mean("paper", b, "ari").value
    )
    assert difference.low < difference.value < difference.high
    assert study.mean(WHOLE, a, "ari").low is None
    assert len(study.to_arrow()) == 4 * 6


def test_means_have_normal_intervals():
    values = np.array([0.1, 0.4, np.nan, 0.7])
    mean = mean_of(values)
    half = 1.96 * np.std([0.1, 0.4, 0.7], ddof=1) / np.sqrt(3)
    assert (mean.low, mean.value, mean.high) == pytest.approx((0.4 - half, 0.4, 0.4 + half))
    assert np.isnan(mean_of(np.array([np.nan])).value)


@pytest.fixture(scope="module")
def conducted(demo_catalog, silent_progress) -> Experiment:
    return study_dtw_curve(Catalog.open(demo_catalog), "action", 2, 0, silent_progress)


@pytest.mark.slow
def test_the_command_has_every_combination_and_the_same_figures_each_time(motionary, demo_catalog, conducted):
    code, out, err = motionary("reproduce", "dtw-curve", demo_catalog, "--draws", 2, "--format", "json")
    assert code == 0
    assert "score: " in err
    rows = json.loads(out)
    single = ["dtw", "b_dtw", *(f"s_dtw_0.{n}5" for n in range(3, 10)), "weighted"]
    methods = [(one, method) for one in single for method in ("complete", "average", "ward")]
    methods += [(f"fuzzy_{tau}", "fuzzy") for tau in ("0", "0.5", "1")]
    expected = {
        (rule, features, *method)
        for rule in (*RULES, WHOLE)
        for features in ("paper", "pose+travel")
        for method in methods
    }
    found = {(row["clips_drawn"], row["features"], row["distance"], row["linkage"]): row for row in rows}
    assert set(found) == expected
    assert len(rows) == len(expected) == 4 * 2 * 33
    for row in rows:
        for name in MEASURES:
            assert row[name] <= 1 + 1e-9
            assert (row[f"{name}_low"] is None) == (row["clips_drawn"] == WHOLE)
    # On made-up motions the default finds the classes far better than chance.
    assert found["6-20", "pose+travel", "weighted", "ward"]["ari"] > 0.6
    # Two runs, one of them without the command: to the last bit.
    assert rows == conducted.study.to_arrow().to_pylist()


def test_the_report_shows_what_counts(conducted):
    shown = io.StringIO()
    Console(file=shown, width=200).print(report(conducted))
    text = shown.getvalue()
    assert "of 6 classes among the 8 that have 6 clips or more" in text
    assert "another of 5 subjects" in text
    for words in ("run (default)", "Figure 9", "Figure 10", "by modularity", "0.35"):
        assert words in text
    assert len(text.splitlines()) < 80
    default = Combination("pose+travel", "weighted", "ward")
    assert f"{conducted.study.mean('6-20', default, 'ari').value:.2f} ±" in text


def test_the_try_at_better_shows_the_default_and_the_chosen_one(motionary, demo_catalog):
    code, out, _ = motionary("reproduce", "dtw-curve-better", demo_catalog, "--draws", 1)
    assert code == 0
    rows = [line for line in out.decode().splitlines() if line.startswith("velocity ")]
    assert len(rows) == 4 * 2 * 4
    for one, mark in ((DEFAULT, "default"), (CHOSEN, "chosen")):
        (row,) = [line for line in rows if mark in line]
        assert row.split()[:2] == one.features.split()


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("mood", "has no label column 'mood'; give --label-column one of action, style"),
        ("licence", "run again with labels (motionary run LIBRARY CATALOG --labels CSV)"),
    ],
)
def test_a_column_without_classes_is_one_clear_line(motionary, demo_catalog, column, message):
    code, out, err = motionary("reproduce", "dtw-curve", demo_catalog, "--label-column", column)
    assert (code, out) == (1, b"")
    assert err.startswith("motionary: ")
    assert err.count("\n") == 1
    assert message in err


def test_too_few_clips_a_class_are_refused(monkeypatch):
    few = SimpleNamespace(classes=np.array(["a"] * 7 + ["b"] * 5, dtype=object))
    monkeypatch.setattr(dtw_curve, "labelled_clips", lambda catalog, column: few)
    catalog = SimpleNamespace(store=SimpleNamespace(url="takes"))
    with pytest.raises(UserError, match="1 classes of takes have 6 clips or more"):
        dtw_curve.drawable_clips(catalog, "action")


def test_features_are_made_as_the_catalogs_run_made_them(demo_catalog):
    catalog = Catalog.open(demo_catalog)
    assert catalog.config.features == FeatureConfig()
    clips = labelled_clips(catalog, "action")
    assert clips.clip_ids == sorted(clips.clip_ids)
    resampled = catalog.resampled.to_pandas()
    first = clips.clip_ids[0]
    kept = np.array(resampled[resampled.clip_id == first].sort_values("frame").feature.tolist())
    np.testing.assert_allclose(
        motion_features(catalog.motion(first), catalog.config.features), kept, atol=1e-5
    )
