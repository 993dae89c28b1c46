"""`reproduce landmarks`: its figures are those of counting, its distances and clusters the catalog's."""

import json
from itertools import combinations

import numpy as np
import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.pipeline.clustering.landmarks import cluster_by_landmarks
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce import landmarks_exact
from motionary.workflows.reproduce.landmarks import ALONE, disagreement, landmark_numbers, study_landmarks
from motionary.workflows.reproduce.landmarks_exact import (
    AUTOMATIC,
    PUBLISHED,
    CountedDistances,
    read_exact_clusters,
)


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


@pytest.fixture
def exact(catalog):
    return read_exact_clusters(catalog, "action")


def test_what_is_read_is_the_catalogs(catalog, exact):
    clips = catalog.clusters.to_pandas().sort_values("clip_id", ignore_index=True)
    assert exact.clusters[PUBLISHED].tolist() == clips["cluster_id"].tolist()
    assert exact.classes == exact.labels == clips["label"].tolist()
    place = {clip_id: number for number, clip_id in enumerate(clips["clip_id"])}
    distance = CountedDistances(exact.channels, len(place))
    for pair in catalog.pairs.to_arrow().to_pylist()[::37]:
        asked = [np.array([place[pair[side]]]) for side in ("clip_a", "clip_b")]
        assert distance(*asked) == distance(*asked[::-1]) == pair["weighted"]


def test_all_clips_as_landmarks_give_the_catalogs_clusters(exact):
    for cut, labels in ((PUBLISHED, exact.labels), (AUTOMATIC, None)):
        distance = CountedDistances(exact.channels, 80)
        made = cluster_by_landmarks(exact.digests, distance, exact.config, labels, landmarks=80)
        assert disagreement(made.labels, exact.clusters[cut]) == 0
        assert distance.share == 1


def test_pairs_are_counted_once_and_not_with_themselves():
    distance = CountedDistances(np.arange(10, dtype=np.float32)[None], 5)
    assert distance.share == 0
    asked = distance(np.array([0, 1, 2]), np.array([2, 1]))
    assert asked.tolist() == [[[1, 0], [4, 0], [0, 4]]]
    assert distance.share == pytest.approx(3 / 10)
    distance(np.array([1, 2]), np.array([0, 1, 2]))
    assert distance.share == pytest.approx(3 / 10)


@pytest.mark.parametrize("seed", range(5))
def test_disagreement_as_by_counting(seed):
    one, other = np.random.default_rng(seed).integers(0, 4, size=(2, 15))
    pairs = list(combinations(range(15), 2))
    differ = sum((one[i] == one[j]) != (other[i] == other[j]) for i, j in pairs)
    assert disagreement(one, other) == pytest.approx(differ / len(pairs))
    assert disagreement(one, one) == 0


def test_how_many_landmarks_are_tried():
    assert landmark_numbers(80) == [5, 10, 20, 40]
    assert landmark_numbers(10_000) == [625, 1250, 2000, 2500, 5000]


def test_a_study_is_repeated_by_its_seed(catalog, silent_progress):
    first, again, other = (
        study_landmarks(catalog, "action", 1, seed, silent_progress).study.to_arrow() for seed in (0, 0, 1)
    )
    assert first.equals(again)
    assert not first.equals(other)
    rows = {(row["cut"], row["landmarks"], row["route"]): row for row in first.to_pylist()}
    for cut in (PUBLISHED, AUTOMATIC):
        few, many = (rows[cut, size, "4, refined"] for size in (5, 40))
        assert few["ari"] < many["ari"]
        assert few["pairs"] < many["pairs"] < 1
        assert rows[cut, 40, ALONE]["pairs"] == pytest.approx(40 * 39 / (80 * 79))
        assert many["ari_least"] <= many["ari"] <= 1
        assert [route for of, size, route in rows if (of, size) == (cut, 72)] == [ALONE]
    assert rows[PUBLISHED, 40, "4, refined"]["ari"] > 0.8


def test_without_labels_to_score_by(catalog, silent_progress):
    study = study_landmarks(catalog, "no such column", 1, 0, silent_progress).study
    assert study.rows["ari_classes"].null_count == len(study.rows)


def test_the_command(motionary, demo_catalog):
    code, out, err = motionary("reproduce", "landmarks", demo_catalog, "--draws", "1")
    assert code == 0, err
    assert "Against the exact clusters, as published: 11" in out
    assert "Against the exact clusters, automatic: 8" in out
    assert "pairs parted otherwise" in out
    code, out, _ = motionary("reproduce", "landmarks", demo_catalog, "--draws", "1", "--format", "json")
    assert {row["route"] for row in json.loads(out)} >= {ALONE, "4 representatives", "4, refined"}


def test_too_few_clips(catalog, monkeypatch):
    monkeypatch.setattr(landmarks_exact, "LEAST_CLIPS", 100)
    with pytest.raises(UserError, match="has 80 clips, and a study of landmarks needs 100"):
        read_exact_clusters(catalog, "action")


def test_pairs_that_were_not_compared(catalog, monkeypatch):
    monkeypatch.setattr("motionary.catalog.own_pairs.all_pairs_are_there", lambda catalog: False)
    with pytest.raises(CatalogError, match="an experiment on landmarks needs all pairs"):
        read_exact_clusters(catalog, "action")
