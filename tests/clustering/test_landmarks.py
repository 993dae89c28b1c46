"""Clusters by landmarks: each step against a slow reference, and the whole route against all pairs."""

from hashlib import sha256

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist, squareform

from motionary.pipeline.clustering import choose_cut, complete_linkage, cut_tree, ward_linkage
from motionary.pipeline.clustering.cut import numbered
from motionary.pipeline.clustering.landmark_steps import (
    landmark_count,
    nearest_group,
    sample_clips,
    standing_for,
)
from motionary.pipeline.clustering.landmarks import cluster_by_landmarks, refine
from motionary.pipeline.clustering.primary import linkage_of, merge_key, threshold_on_part
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.evaluation import adjusted_rand_index

METHODS = ("ward", "complete", "average", "fuzzy")


def blobs(seed, sizes, spread=0.1):
    """Points around corners far apart, shuffled: their distances (channels, N, N), keys and classes."""
    rng = np.random.default_rng(seed)
    classes = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    corners = 10.0 * np.stack([np.arange(len(sizes)), np.arange(len(sizes)) % 2], axis=1)
    points = corners[classes] + spread * rng.normal(size=(len(classes), 2))
    return points, [f"clip {seed} {one}" for one in range(len(classes))], classes


def channels_of(points, method):
    square = squareform(pdist(points))
    return np.stack([0.9 * square, 1.1 * square]) if method == "fuzzy" else square[None]


def asked_of(square):
    return lambda rows, columns: square[:, rows[:, None], columns]


def same_partition(one, other):
    return adjusted_rand_index(one, other) == 1


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("how", [{}, {"threshold": 3.0}, {"n_clusters": 5}])
def test_all_clips_as_landmarks_are_the_exact_clusters(method, how):
    points, keys, classes = blobs(0, (9, 8, 7, 6), spread=2.0)
    config = ClusterConfig(primary=method, **how)
    square = channels_of(points, method)
    pairs = np.stack([squareform(one, checks=False) for one in square])
    labels = [f"class {one}" for one in classes]
    exact = choose_cut(linkage_of(pairs, config), merge_key(pairs, config), config, labels)
    made = cluster_by_landmarks(keys, asked_of(square), config, labels, landmarks=30)
    assert made.labels.tolist() == exact.labels.tolist()
    assert made.threshold == (np.inf if "n_clusters" in how else pytest.approx(exact.threshold))
    assert made.sample.tolist() == list(range(30))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(3))
def test_classes_that_lie_apart_are_found_from_a_few_landmarks(method, seed):
    points, keys, classes = blobs(seed, (60, 50, 40, 30, 20))
    config, labels = ClusterConfig(primary=method), [f"class {one}" for one in classes]
    made = cluster_by_landmarks(keys, asked_of(channels_of(points, method)), config, labels, landmarks=40)
    assert made.cut.rule == "labels"
    grown = (200 / 40) ** 0.5 if method == "ward" else 1
    assert made.threshold == pytest.approx(made.cut.threshold * grown)
    assert same_partition(made.labels, classes)
    assert np.bincount(made.labels).tolist() == [60, 50, 40, 30, 20]


@pytest.mark.parametrize("method", METHODS)
def test_a_class_that_the_sample_missed_is_found_by_refining(method):
    points, keys, classes = blobs(4, (40, 40, 30, 30))
    labels = [f"class {one}" for one in classes]
    # Three clips that are no landmarks are moved away, and class 0 is still the nearest to them.
    hidden = np.setdiff1d(np.flatnonzero(classes == 3), sample_clips(keys, 40))[:3]
    points[hidden] = points[classes == 0].mean(axis=0) + [0.0, -60.0]
    config = ClusterConfig(primary=method)
    made = cluster_by_landmarks(keys, asked_of(channels_of(points, method)), config, labels, landmarks=40)
    nearest = classes.copy()
    nearest[hidden] = 0
    assert same_partition(made.assigned, nearest)
    asked_for = ClusterConfig(primary=method, n_clusters=4)
    kept = cluster_by_landmarks(keys, asked_of(channels_of(points, method)), asked_for, labels, landmarks=40)
    assert same_partition(kept.labels, nearest)
    nearest[hidden] = 4
    assert same_partition(made.labels, nearest)


def test_a_threshold_is_one_on_all_clips():
    points, keys, _ = blobs(1, (50, 50, 50, 50), spread=1.0)
    square = channels_of(points, "ward")
    between = ward_linkage(squareform(square[0], checks=False))[-4:, 2]
    config = ClusterConfig(threshold=float(between[:2].mean()))
    made = cluster_by_landmarks(keys, asked_of(square), config, None, landmarks=50)
    assert made.threshold == config.threshold
    assert made.cut.threshold == pytest.approx(config.threshold / 2)
    assert same_partition(made.labels, cut_tree(ward_linkage(squareform(square[0])), config.threshold))


def test_one_cluster_of_landmarks_is_not_undone():
    square = np.ones((1, 12, 12)) - np.eye(12)
    made = cluster_by_landmarks([str(one) for one in range(12)], asked_of(square), ClusterConfig(), None, 4)
    assert made.cut.n_clusters == 1
    assert made.threshold == np.inf
    assert not made.labels.any()


def test_a_cluster_larger_than_the_sample_is_refined_on_landmarks_of_its_own():
    points, keys, classes = blobs(2, (300, 200, 100))
    square, asked = channels_of(points, "complete"), []

    def distance(rows, columns):
        asked.append((len(rows), len(columns)))
        return square[:, rows[:, None], columns]

    groups = refine(keys, distance, ClusterConfig(primary="complete"), 3.0, most=50)
    assert same_partition(groups, classes)
    assert max(min(one) for one in asked) == 50
    one_class = np.flatnonzero(classes == 0)
    alone = refine(
        [keys[one] for one in one_class],
        asked_of(square[:, one_class[:, None], one_class]),
        ClusterConfig(primary="complete"), 3.0, most=50,
    )  # fmt: skip
    assert not alone.any()


def test_wards_heights_are_those_of_the_whole_cluster_also_on_its_landmarks():
    points, keys, classes = blobs(5, (150, 150))
    square = channels_of(points, "ward")
    top = ward_linkage(squareform(square[0], checks=False))[-1, 2]
    groups = [refine(keys, asked_of(square), ClusterConfig(), share * top, most=50) for share in (0.7, 1.3)]
    assert same_partition(groups[0], classes)
    assert not groups[1].any()


def test_a_cluster_is_refined_by_its_own_dendrogram():
    points, keys, _ = blobs(3, (20,), spread=1.0)
    square = channels_of(points, "complete")
    groups = refine(keys, asked_of(square), ClusterConfig(primary="complete"), 1.2, most=20)
    expected = cut_tree(complete_linkage(squareform(square[0], checks=False)), threshold=1.2)
    assert groups.tolist() == expected.tolist()


@settings(max_examples=50, deadline=None)
@given(st.lists(st.text(max_size=3), min_size=1, max_size=40), st.integers(1, 50))
def test_the_sample_is_of_the_least_hashes(keys, count):
    sample = sample_clips(keys, count).tolist()
    ranked = sorted((sha256(key.encode()).hexdigest(), place) for place, key in enumerate(keys))
    assert sample == sorted(place for _, place in ranked[:count])


def test_a_clip_more_replaces_one_landmark_at_most():
    keys = [f"clip {one}" for one in range(500)]
    before = {keys[place] for place in sample_clips(keys, 50)}
    for place in (0, 250, 500):
        more = [*keys[:place], "new", *keys[place:]]
        after = {more[one] for one in sample_clips(more, 50)}
        assert len(before - after) <= 1
        assert after - before <= {"new"}


@pytest.mark.parametrize(
    ("clips", "count"), [(1, 1), (999, 999), (2500, 1000), (10_000, 2000), (142_000, 7537)]
)
def test_how_many_landmarks(clips, count):
    assert landmark_count(clips) == count


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 6), st.integers(1, 4))
def test_representatives_are_the_medoid_and_the_furthest_from_those_before(seed, count, kappa):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, size=(12, 2)).astype(float)
    groups = numbered(rng.permutation(np.arange(12) % kappa))
    square = squareform(pdist(points, "cityblock"))
    standing = standing_for(square, groups, count)
    for group in range(kappa):
        members = np.flatnonzero(groups == group).tolist()
        chosen = [min(members, key=lambda one: (sum(square[one, other] for other in members), one))]
        while len(chosen) < count:
            far = max(members, key=lambda one: (min(square[one, other] for other in chosen), -one))
            if min(square[far, other] for other in chosen) == 0:
                break
            chosen.append(far)
        assert standing.places[standing.group_of == group].tolist() == chosen


def test_the_nearest_representative_decides_and_the_first_of_equals():
    distances = np.array([[3.0, 1.0, 2.0], [1.0, 1.0, 1.0], [5.0, 4.0, 0.5]])
    assert nearest_group(distances, np.array([0, 0, 1])).tolist() == [0, 0, 1]


def test_heights_of_ward_grow_with_the_root_of_the_clips():
    points, _, _ = blobs(0, (5, 4, 3), spread=1.0)
    once, thrice = (pdist(np.repeat(points, copies, axis=0)) for copies in (1, 3))
    tops = [ward_linkage(one)[-11:, 2] for one in (once, thrice)]
    config = ClusterConfig(primary="ward")
    assert [threshold_on_part(config, mu, 1 / 3) for mu in tops[1]] == pytest.approx(tops[0].tolist())
    assert threshold_on_part(ClusterConfig(primary="complete"), 2.0, 1 / 3) == 2.0


@pytest.mark.parametrize("count", [0, -1])
def test_no_landmarks(count):
    with pytest.raises(ValueError, match=f"{count} landmarks of 2 clips"):
        sample_clips(["a", "b"], count)
    with pytest.raises(ValueError, match="3 landmarks of 0 clips"):
        sample_clips([], 3)
