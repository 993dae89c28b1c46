"""Cuts by threshold and count, threshold strips, and the choice among rules."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import pdist, squareform

from motionary.pipeline.clustering import (
    average_linkage,
    choose_cut,
    complete_linkage,
    cut_tree,
    fuzzy_linkage,
    strip_of,
    threshold_strips,
    ward_linkage,
    widest_strip,
)
from motionary.pipeline.config import ClusterConfig
from tests.clustering import naive


@st.composite
def dendrograms(draw, smallest=1):
    clips = draw(st.integers(smallest, 10))
    if clips == 1:
        return np.empty((0, 4))
    link = draw(
        st.sampled_from([partial(linkage, method="complete"), average_linkage, ward_linkage, intervals])
    )
    return link(draw_distances(draw, clips))


def draw_distances(draw, clips):
    values = draw(st.sampled_from([st.integers(0, 3).map(float), st.floats(0, 10, allow_subnormal=False)]))
    pairs = clips * (clips - 1) // 2
    return np.array(draw(st.lists(values, min_size=pairs, max_size=pairs)))


def intervals(distances):
    return fuzzy_linkage(distances, distances + 1)


def three_groups():
    """Twenty-one points on a line: groups of 6, 7 and 8, far apart."""
    rng = np.random.default_rng(0)
    return pdist((np.repeat([0, 100, 300], (6, 7, 8)) + rng.random(21) * 5)[:, None])


@settings(max_examples=200, deadline=None)
@given(Z=dendrograms(), data=st.data())
def test_a_count_keeps_the_first_merges(Z, data):
    kappa = data.draw(st.integers(1, len(Z) + 1))
    labels = cut_tree(Z, n_clusters=kappa)
    assert naive.as_partition(labels.tolist()) == naive.partition(Z, kappa)


@settings(max_examples=200, deadline=None)
@given(Z=dendrograms(), data=st.data())
def test_a_threshold_keeps_the_merges_not_above_it(Z, data):
    mu = data.draw(st.sampled_from([-1.0, 0.0, 0.5, np.inf, *Z[:, 2].tolist()]))
    labels = cut_tree(Z, threshold=mu)
    assert naive.as_partition(labels.tolist()) == naive.partition(Z, naive.cluster_count(Z, mu))


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_no_cluster_of_complete_linkage_is_wider_than_the_threshold_and_no_two_could_join(data):
    clips = data.draw(st.integers(2, 12))
    distances = draw_distances(data.draw, clips)
    mu = data.draw(st.sampled_from(sorted({0.0, 0.5, *distances.tolist()})))
    labels = cut_tree(complete_linkage(distances), threshold=mu)
    square = squareform(distances)
    for a in range(labels.max() + 1):
        for b in range(a + 1):
            furthest = square[np.ix_(labels == a, labels == b)].max()
            assert furthest <= mu if a == b else furthest > mu


@settings(max_examples=100, deadline=None)
@given(Z=dendrograms(), data=st.data())
def test_clusters_are_numbered_by_size_then_by_lowest_member(Z, data):
    labels = cut_tree(Z, n_clusters=data.draw(st.integers(1, len(Z) + 1)))
    clusters = [np.flatnonzero(labels == c).tolist() for c in range(labels.max() + 1)]
    assert clusters == sorted(clusters, key=lambda members: (-len(members), members[0]))
    assert labels.dtype == np.int64


@settings(max_examples=200, deadline=None)
@given(Z=dendrograms())
def test_strips_are_all_that_thresholds_yield(Z):
    table = threshold_strips(Z)
    assert table.column_names == ["kappa", "mu_low", "mu_high"]
    strips = table.to_pylist()
    for strip in strips:
        inside = strip_of(Z, strip["kappa"]).mu
        assert strip["mu_low"] <= inside < strip["mu_high"]
        for mu in (strip["mu_low"], inside):
            assert cut_tree(Z, threshold=mu).max() + 1 == strip["kappa"]
    reached = {naive.cluster_count(Z, mu) for mu in (0.0, *Z[:, 2])}
    assert [strip["kappa"] for strip in strips] == sorted(reached, reverse=True)
    assert [strip["mu_low"] for strip in strips] == [0.0] + [strip["mu_high"] for strip in strips[:-1]]
    assert strips[-1]["kappa"] == 1
    assert strips[-1]["mu_high"] == np.inf


@settings(max_examples=200, deadline=None)
@given(Z=dendrograms())
def test_the_widest_strip_is_the_longest_inner_one(Z):
    clips = len(Z) + 1
    inner = [s for s in threshold_strips(Z).to_pylist() if 2 <= s["kappa"] <= clips - 1]
    widest = widest_strip(Z)
    if not inner:
        assert widest is None
    else:
        best = max(inner, key=lambda s: (s["mu_high"] - s["mu_low"], -s["kappa"]))
        assert (widest.kappa, widest.mu_low, widest.mu_high) == tuple(best.values())


def test_ties_between_strips_go_to_fewer_clusters():
    Z = np.array([[0, 1, 1.0, 2], [2, 4, 2.0, 3], [3, 5, 3.0, 4]])
    assert widest_strip(Z).kappa == 2


def test_a_strip_between_neighbouring_floats_still_has_a_threshold():
    above = np.nextafter(1.0, 2.0)
    Z = np.array([[0, 1, above, 2], [2, 3, np.nextafter(above, 2.0), 3]])
    assert cut_tree(Z, threshold=strip_of(Z, 2).mu).max() + 1 == 2


def test_the_strip_of_a_tied_count_is_empty():
    strip = strip_of(linkage([1.0, 1.0, 1.0], "complete"), 2)
    assert (strip.width, strip.mu) == (0.0, 1.0)


def test_cuts_that_cannot_be_are_refused():
    Z = linkage([1.0, 2.0, 3.0], "complete")
    with pytest.raises(ValueError, match="give exactly one"):
        cut_tree(Z)
    with pytest.raises(ValueError, match=r"threshold is 1.0 and n_clusters 2"):
        cut_tree(Z, threshold=1.0, n_clusters=2)
    with pytest.raises(ValueError, match="n_clusters is 4 for 3 clips"):
        cut_tree(Z, n_clusters=4)
    with pytest.raises(ValueError, match="n_clusters is 0 for 3 clips"):
        cut_tree(Z, n_clusters=0)
    with pytest.raises(ValueError, match="threshold is nan"):
        cut_tree(Z, threshold=np.nan)
    with pytest.raises(ValueError, match=r"shape \(3,\)"):
        cut_tree(np.ones(3), n_clusters=1)
    with pytest.raises(ValueError, match=r"merge 0 has height 3.0 and merge 1 1.0"):
        cut_tree(np.array([[0, 1, 3.0, 2], [2, 3, 1.0, 3]]), n_clusters=1)


class TestChoice:
    distances = three_groups()
    Z = linkage(distances, "complete")
    groups = (2,) * 6 + (1,) * 7 + (0,) * 8

    def check(self, cut, kappa, rule):
        assert (cut.n_clusters, cut.rule, cut.strip) == (kappa, rule, strip_of(self.Z, kappa))
        assert_array_equal(cut.labels, cut_tree(self.Z, n_clusters=kappa))
        assert_array_equal(cut.labels, cut_tree(self.Z, threshold=cut.threshold))
        assert cut.widest == widest_strip(self.Z)

    def test_threshold_is_obeyed(self):
        cut = choose_cut(self.Z, self.distances, ClusterConfig(threshold=50.0))
        self.check(cut, 3, "threshold")
        assert cut.threshold == 50.0
        assert tuple(cut.labels) == self.groups

    def test_count_is_obeyed(self):
        cut = choose_cut(self.Z, self.distances, ClusterConfig(n_clusters=5))
        self.check(cut, 5, "count")
        assert cut.threshold == (cut.strip.mu_low + cut.strip.mu_high) / 2

    def test_more_clusters_than_clips_are_refused(self):
        with pytest.raises(ValueError, match="n_clusters is 22 for 21 clips"):
            choose_cut(self.Z, self.distances, ClusterConfig(n_clusters=22))

    def test_the_widest_strip_chooses_when_asked(self):
        cut = choose_cut(self.Z, self.distances, ClusterConfig(cut="strip"))
        self.check(cut, 2, "strip")

    def test_labels_choose_where_there_are_enough(self):
        labels = [None, "a", "a", None, None, None, "b"] + ["b", None] * 3 + ["c"] * 8
        self.check(choose_cut(self.Z, self.distances, ClusterConfig(), labels), 3, "labels")

    @pytest.mark.parametrize("labels", [None, ["a", "a", "b"] + [None] * 18])
    def test_modularity_chooses_otherwise(self, labels):
        cut = choose_cut(self.Z, self.distances, ClusterConfig(), labels)
        self.check(cut, 3, "modularity")
        assert tuple(cut.labels) == self.groups

    def test_labels_of_other_clips_are_refused(self):
        with pytest.raises(ValueError, match="21 clips, and there are 3 labels"):
            choose_cut(self.Z, self.distances, ClusterConfig(), ["a", "a", "b"])

    @pytest.mark.parametrize("rule", ["auto", "strip"])
    @pytest.mark.parametrize("pairs", [0, 1, 6])
    def test_one_cluster_where_nothing_tells_clips_apart(self, rule, pairs):
        distances = np.ones(pairs)
        Z = linkage(distances, "complete") if pairs else np.empty((0, 4))
        cut = choose_cut(Z, distances, ClusterConfig(cut=rule))
        assert cut.n_clusters == 1
        assert_array_equal(cut.labels, np.zeros(len(Z) + 1))
        assert_array_equal(cut.labels, cut_tree(Z, threshold=cut.threshold))
