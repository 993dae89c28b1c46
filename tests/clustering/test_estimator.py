"""The estimator: scikit-learn's conventions, and that it finds what its parts find."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.spatial.distance import squareform
from sklearn.base import clone, is_clusterer
from sklearn.cluster import AgglomerativeClustering
from sklearn.datasets import make_blobs
from sklearn.exceptions import NotFittedError, SkipTestWarning
from sklearn.metrics import pairwise_distances as euclidean_distances
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import check_estimator, parametrize_with_checks

import motionary.pipeline.clustering
from motionary.catalog import Catalog
from motionary.pipeline.clustering import (
    MotionClusterer,
    average_linkage,
    complete_linkage,
    cut_tree,
    fuzzy_linkage,
    ward_linkage,
)
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.distances import compare_clips, pairwise_distances
from motionary.pipeline.features import motion_features

LINKAGES = {"complete": complete_linkage, "ward": ward_linkage, "average": average_linkage}


def expected_failures(estimator):
    """Say which of scikit-learn's checks cannot pass, and why."""
    return {
        "check_clustering": "gives points, negative ones too, where the tags ask for distances; "
        "test_blobs_by_their_distances does what it does"
    }


@parametrize_with_checks(
    [MotionClusterer(metric="precomputed", linkage=linkage) for linkage in LINKAGES],
    expected_failed_checks=expected_failures,
)
def test_scikit_learns_checks(estimator, check):
    check(estimator)


def test_scikit_learn_has_no_checks_for_sequences():
    with pytest.warns(SkipTestWarning, match="Can't test estimator MotionClusterer"):
        assert len(check_estimator(MotionClusterer(), on_skip=None)) <= 1


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("writeable", [True, False])
def test_blobs_by_their_distances(linkage, writeable):
    points, blobs = make_blobs(n_samples=50, cluster_std=0.4, random_state=1)
    distances = euclidean_distances(points)
    distances.setflags(write=writeable)
    labels = MotionClusterer("precomputed", linkage, n_clusters=3).fit_predict(distances)
    assert labels.shape == (50,)
    assert sorted(np.unique(labels[blobs == one]).tolist() for one in range(3)) == [[0], [1], [2]]


def clips_of(seed, count=14, d=3):
    """Walk at random from three places, each clip of its own length."""
    rng = np.random.default_rng(seed)
    return [
        (3 * (one % 3) + rng.normal(size=(rng.integers(1, 12), d)).cumsum(axis=0) * 0.3).astype(np.float32)
        for one in range(count)
    ]


def low_and_high(clips, metric):
    found = pairwise_distances(clips)
    low = found.fuzzy_low if metric == "fuzzy" else getattr(found, metric)
    return low, found.fuzzy_high if metric == "fuzzy" else low


@pytest.mark.parametrize("linkage", [*LINKAGES, "fuzzy"])
@pytest.mark.parametrize("metric", ["weighted", "dtw", "b_dtw", "fuzzy"])
def test_it_is_distances_linkage_and_cut(metric, linkage):
    if (metric == "fuzzy") != (linkage == "fuzzy"):
        with pytest.raises(ValueError, match="fuzzy distances are intervals"):
            MotionClusterer(metric, linkage).fit(clips_of(0))
        return
    clips = clips_of(0)
    low, high = low_and_high(clips, metric)
    Z = fuzzy_linkage(low, high) if linkage == "fuzzy" else LINKAGES[linkage](low)
    by_count = MotionClusterer(metric, linkage, n_clusters=4).fit(clips)
    assert_array_equal(by_count.linkage_matrix_, Z)
    assert_array_equal(by_count.labels_, cut_tree(Z, n_clusters=4))
    assert (by_count.n_clusters_, by_count.n_features_in_, by_count.cut_.rule) == (4, 3, "count")
    mu = float(Z[-3:-1, 2].mean())
    by_threshold = MotionClusterer(metric, linkage, threshold=mu).fit(clips)
    assert_array_equal(by_threshold.labels_, cut_tree(Z, threshold=mu))
    assert MotionClusterer(metric, linkage).fit(clips).cut_.rule == "modularity"


def nearest_by_all_pairs(new, clips, metric):
    found = compare_clips(new, clips)
    if metric == "fuzzy":
        distances = found.fuzzy_low + 0.5 * (found.fuzzy_high - found.fuzzy_low)
    else:
        distances = getattr(found, metric)
    return distances.astype(np.float32).argmin(axis=1)


@pytest.mark.parametrize("metric", ["weighted", "dtw", "b_dtw", "fuzzy"])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**16))
def test_a_new_motion_gets_the_cluster_of_the_nearest(metric, seed):
    clips, new = clips_of(seed), clips_of(seed + 1, count=6)
    linkage = "fuzzy" if metric == "fuzzy" else "complete"
    clusterer = MotionClusterer(metric, linkage, n_clusters=5).fit(clips)
    assert_array_equal(clusterer.predict(new), clusterer.labels_[nearest_by_all_pairs(new, clips, metric)])
    assert_array_equal(clusterer.predict(clips), clusterer.labels_)


def test_distances_given_are_distances_computed():
    clips, new = clips_of(7), clips_of(8, count=5)
    itself = MotionClusterer(linkage="average", n_clusters=4).fit(clips)
    given_them = MotionClusterer("precomputed", "average", n_clusters=4)
    assert_array_equal(given_them.fit_predict(squareform(pairwise_distances(clips).weighted)), itself.labels_)
    assert_array_equal(given_them.predict(compare_clips(new, clips).weighted), itself.predict(new))
    assert given_them.n_features_in_ == len(clips)


def test_scikit_learns_own_agglomeration_agrees():
    distances = squareform(pairwise_distances(clips_of(3)).weighted)
    theirs = AgglomerativeClustering(4, metric="precomputed", linkage="complete").fit(distances).labels_
    ours = MotionClusterer("precomputed", n_clusters=4).fit(distances).labels_
    assert_array_equal(ours[:, None] == ours, theirs[:, None] == theirs)


@pytest.mark.parametrize("method", ["complete", "ward"])
def test_the_embedded_library_as_a_run_clusters_it(demo_catalog, method):
    with Catalog.open(demo_catalog) as catalog:
        features = dict(catalog.everything().features(merged=True))
        rows = catalog.sql(
            """select clip_id, cluster from partitions
               where method = ? and metric = 'weighted' order by clip_id""",
            [method],
        )
    clusterer = MotionClusterer(linkage=method).fit([features[one] for one in rows["clip_id"].to_pylist()])
    assert_array_equal(clusterer.labels_, rows["cluster"])


def test_conventions_that_hold_for_sequences_too():
    clips = clips_of(5)
    before = copy.deepcopy(clips)
    clusterer = MotionClusterer("dtw", "ward", n_clusters=3)
    assert is_clusterer(clusterer)
    assert clusterer.get_params() == {"metric": "dtw", "linkage": "ward", "n_clusters": 3, "threshold": None}
    with pytest.raises(NotFittedError):
        clusterer.predict(clips)
    assert clusterer.fit(clips, y=["ignored"] * len(clips)) is clusterer
    labels = clusterer.labels_.copy()
    assert_array_equal(clusterer.fit_predict(clips), labels)
    assert_array_equal(pickle.loads(pickle.dumps(clusterer)).predict(clips), labels)
    assert all(np.array_equal(one, other) for one, other in zip(clips, before, strict=True))
    unfitted = clone(clusterer).set_params(n_clusters=2)
    assert not hasattr(unfitted, "labels_")
    assert unfitted.fit(clips).n_clusters_ == 2
    assert repr(clusterer) == "MotionClusterer(linkage='ward', metric='dtw', n_clusters=3)"


def test_clips_of_one_length_may_be_one_array():
    stack = np.random.default_rng(0).normal(size=(9, 6, 4))
    assert_array_equal(
        MotionClusterer(n_clusters=3).fit_predict(stack),
        MotionClusterer(n_clusters=3).fit_predict(list(stack)),
    )


def test_motions_through_a_pipeline(demo_catalog):
    with Catalog.open(demo_catalog) as catalog:
        motions = list(catalog.filter(action=["walk", "squat"]).sample(8).motions())
        actions = catalog.clips.to_pandas().set_index("clip_id").action
    features = FunctionTransformer(lambda takes: [motion_features(take, FeatureConfig()) for take in takes])
    pipeline: Pipeline = make_pipeline(features, MotionClusterer(n_clusters=2))
    labels = pipeline.fit_predict(motions)
    pairs = {(label, actions[motion.name]) for label, motion in zip(labels, motions, strict=True)}
    assert len(pairs) == 2
    assert_array_equal(pipeline.predict(motions[:3]), labels[:3])


@pytest.mark.parametrize(
    ("options", "X", "message"),
    [
        ({"metric": "euclidean"}, clips_of(0), "metric is 'euclidean'; it must be one of 'dtw'"),
        ({"linkage": "single"}, clips_of(0), "linkage is 'single'; it must be one of"),
        ({"n_clusters": 2, "threshold": 1.0}, clips_of(0), "both given; give one"),
        ({"n_clusters": 15}, clips_of(0), "n_clusters is 15 for 14 clips"),
        ({}, np.zeros((5, 3)), r"X has shape \(5, 3\), a table; give a sequence of motions"),
        ({}, [], "X is empty"),
        ({}, [np.zeros((3, 2)), np.zeros((3, 4))], r"X\[1\]"),
        ({}, [np.zeros((3, 2)), np.full((3, 2), np.nan)], r"X\[1\]"),
        ({}, [np.zeros((3, 2)), np.zeros(3)], r"X\[1\]"),
        ({"metric": "precomputed"}, np.ones((3, 2)), r"shape \(3, 2\); precomputed distances are square"),
        ({"metric": "precomputed"}, [[0, 1], [2, 0]], r"X\[0, 1\] is 1.0 and X\[1, 0\] 2.0"),
        (
            {"metric": "precomputed"},
            [[0, 1], [1, 3]],
            r"X\[1, 1\] is 3.0; the distance of a motion to itself",
        ),
        ({"metric": "precomputed"}, [[0, -1], [-1, 0]], "Negative values"),
    ],
)
def test_what_cannot_be_clustered(options, X, message):
    with pytest.raises(ValueError, match=message):
        MotionClusterer(**options).fit(X)


def test_what_cannot_be_compared_with_what_was_fitted():
    clusterer = MotionClusterer(n_clusters=2).fit(clips_of(0))
    with pytest.raises(ValueError, match=r"X has 4 features a frame, and the motions fitted have 3"):
        clusterer.predict(clips_of(0, d=4))
    with pytest.raises(ValueError, match="give a sequence of motions"):
        clusterer.predict(clips_of(0)[0])


def test_one_motion_and_equal_ones():
    one = clips_of(0)[:1]
    assert_array_equal(MotionClusterer().fit(one).predict(one), [0])
    assert MotionClusterer().fit(one * 4).n_clusters_ == 1


def test_the_package_has_no_other_name():
    with pytest.raises(AttributeError, match="no attribute 'MotionClusters'"):
        motionary.pipeline.clustering.MotionClusters  # noqa: B018
