"""The walks up the tree, for modularity and for labels, against sums made anew at every level."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import pdist

from motionary.pipeline.clustering import (
    cut_tree,
    label_cut,
    labels_suffice,
    modularity_cut,
    nearest_neighbour_graph,
    ward_linkage,
)
from tests.clustering import naive


@st.composite
def libraries(draw, smallest=3, largest=14):
    """A linkage matrix and the condensed distances it was made from, often tied."""
    clips = draw(st.integers(smallest, largest))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    pairs = clips * (clips - 1) // 2
    kind = draw(st.sampled_from(["tied", "free", "metric"]))
    if kind == "metric":
        distances = pdist(rng.normal(size=(clips, 2)))
    else:
        distances = rng.integers(0, 4, pairs).astype(float) if kind == "tied" else rng.random(pairs)
    return linkage(distances, draw(st.sampled_from(["complete", "average", "single"]))), distances


def best_kappa(Z, scores):
    """Of the levels that some threshold yields, the best, and of equals the one of fewest clusters."""
    reached = {naive.cluster_count(Z, mu) for mu in (0.0, *Z[:, 2])}
    possible = {kappa: score for kappa, score in scores.items() if kappa in reached}
    if not possible:
        return 1
    best = max(possible.values())
    return min(kappa for kappa, score in possible.items() if score > best - 1e-9)


@settings(max_examples=150, deadline=None)
@given(library=libraries())
def test_modularity_of_every_level(library):
    Z, distances = library
    clips = len(Z) + 1
    result = modularity_cut(Z, distances)
    weights = naive.neighbour_weights(naive.square(distances, clips), clips)
    expected = {k: naive.modularity(weights, naive.partition(Z, k)) for k in range(clips - 1, 1, -1)}
    assert result.kappa.tolist() == list(expected)
    assert_allclose(result.score, list(expected.values()), atol=1e-12)
    assert result.n_clusters == best_kappa(Z, expected)


@settings(max_examples=100, deadline=None)
@given(library=libraries(smallest=2))
def test_graph_of_nearest_neighbours(library):
    Z, distances = library
    clips = len(Z) + 1
    weights = naive.neighbour_weights(naive.square(distances, clips), clips)
    graph = nearest_neighbour_graph(distances)
    assert_array_equal([[graph[i].get(j, 0.0) for j in range(clips)] for i in range(clips)], weights)


@settings(max_examples=50, deadline=None)
@given(library=libraries(smallest=2, largest=40))
def test_edges_stand_in_the_order_of_who_asked_and_how_near(library):
    # Sums over the edges follow it.
    distances = library[1].astype(np.float32)
    clips = len(library[0]) + 1
    expected = [{} for _ in range(clips)]
    for clip, others in enumerate(naive.nearest(naive.square(distances, clips), clips)):
        for other in others:
            expected[clip][other] = expected[other][clip] = True
    for graph in (nearest_neighbour_graph(distances), nearest_neighbour_graph(distances.astype(np.float64))):
        assert [[*edges] for edges in graph] == [[*edges] for edges in expected]


def test_a_graph_worked_by_hand():
    # Clips at 0, 1, 3, 7: two neighbours each, so the neighbourhoods are 012, 012, 012 and 123.
    graph = nearest_neighbour_graph(pdist(np.array([0.0, 1, 3, 7])[:, None]))
    assert graph == [{1: 1, 2: 1}, {0: 1, 2: 1, 3: 0.5}, {0: 1, 1: 1, 3: 0.5}, {1: 0.5, 2: 0.5}]


def test_modularity_finds_groups_of_many_clips():
    rng = np.random.default_rng(1)
    groups = np.repeat(np.arange(4), (9, 11, 12, 14))
    distances = pdist(rng.normal(size=(46, 3)) + 12 * np.eye(4, 3)[groups])
    Z = ward_linkage(distances)
    result = modularity_cut(Z, distances)
    assert result.n_clusters == 4
    assert naive.as_partition(cut_tree(Z, n_clusters=4).tolist()) == naive.as_partition(groups.tolist())


def test_small_libraries_have_one_cluster_or_two():
    assert modularity_cut(np.empty((0, 4)), []).n_clusters == 1
    assert modularity_cut(linkage([2.0]), [2.0]).n_clusters == 1
    assert modularity_cut(linkage([1.0, 3.0, 2.0]), [1.0, 3.0, 2.0]).n_clusters == 2
    assert modularity_cut(linkage([1.0, 1.0, 1.0]), [1.0, 1.0, 1.0]).n_clusters == 1


def test_distances_of_other_clips_are_refused():
    with pytest.raises(ValueError, match="Z is of 3 clips, the distances of 4"):
        modularity_cut(linkage([1.0, 3.0, 2.0]), np.ones(6))


@settings(max_examples=200, deadline=None)
@given(library=libraries(smallest=4), data=st.data())
def test_label_value_of_every_level(library, data):
    Z, _ = library
    clips = len(Z) + 1
    labels = data.draw(st.lists(st.sampled_from(["a", "b", "c", None]), min_size=clips, max_size=clips))
    counts = [labels.count(label) for label in "abc"]
    assert labels_suffice(labels) == (sorted(counts)[1] >= 2)
    assume(labels_suffice(labels))
    expected = {k: naive.reward_punish(naive.partition(Z, k), labels) for k in range(clips, 0, -1)}
    result = label_cut(Z, labels)
    assert result.kappa.tolist() == list(expected)
    assert result.score.tolist() == list(expected.values())
    assert result.n_clusters == best_kappa(Z, expected)


def test_too_few_labels_are_refused():
    Z = linkage([1.0, 3.0, 2.0], "complete")
    with pytest.raises(ValueError, match="1 classes have two labelled clips or more"):
        label_cut(Z, ["a", "a", "b"])
    with pytest.raises(ValueError, match="3 clips, and there are 2 labels"):
        label_cut(Z, ["a", "b"])


def test_unlabelled_clips_join_labelled_ones_where_labels_do_not_mind():
    distances = pdist(np.array([0.0, 1, 2.5, 20, 21, 22.5])[:, None])
    Z = linkage(distances, "complete")
    assert label_cut(Z, ["a", "a", None, "b", "b", None]).n_clusters == 2
