"""Linkage of the pairs up to mu against the dense route, bit for bit."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from motionary.pipeline.clustering import complete_linkage, cut_tree
from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.clustering.sparse_linkage import complete_linkage_under
from tests.clustering import naive

FAR = 1e9


def pairs_under(clips, condensed, mu):
    """Their places and distances, in any order of the pairs and of the two."""
    rng = np.random.default_rng(clips)
    places = np.array(list(combinations(range(clips), 2))).reshape(-1, 2)
    known = rng.permutation(np.flatnonzero(condensed <= mu))
    first, second = rng.permuted(places[known], axis=1).T
    return first, second, condensed[known]


def linked(clips, first, second, distances, parts=1, new_array=np.empty):
    """`complete_linkage_under` of pairs that come in parts."""
    some = [*zip(*(np.array_split(one, parts) for one in (first, second, distances)), strict=True)]
    return complete_linkage_under(clips, lambda: iter(some), new_array)


def random_distances(clips, seed, kind):
    rng = np.random.default_rng(seed)
    count = math.comb(clips, 2)
    if kind == "free":
        return rng.permutation(count) / max(count, 1)
    if kind == "tied":
        return rng.integers(0, rng.integers(1, 8), count) / 4.0
    points = rng.integers(0, 5, (clips, 2)).astype(float)
    return np.array([np.hypot(*(points[i] - points[j])) for i, j in combinations(range(clips), 2)])


def assert_is_the_dense_route(found, condensed, mu):
    Z = complete_linkage(condensed)
    assert_array_equal(found.merges, Z[Z[:, 2] <= mu])
    assert_array_equal(found.clusters, cut_tree(Z, threshold=mu))


@settings(max_examples=150, deadline=None)
@given(
    clips=st.integers(2, 30),
    seed=st.integers(0, 2**16),
    kind=st.sampled_from(["free", "tied", "points"]),
    share=st.floats(0, 1),
    dtype=st.sampled_from([np.float32, np.float64]),
    parts=st.integers(1, 4),
)
def test_it_is_the_dense_route_with_one_distance_for_all_that_is_unknown(
    clips, seed, kind, share, dtype, parts
):
    condensed = random_distances(clips, seed, kind).astype(dtype)
    mu = np.quantile(condensed, share)
    found = linked(clips, *pairs_under(clips, condensed, mu), parts)
    assert_is_the_dense_route(found, np.where(condensed <= mu, condensed, dtype(FAR)), mu)


@settings(max_examples=200, deadline=None)
@given(clips=st.integers(2, 40), seed=st.integers(0, 2**16), share=st.floats(0, 1))
def test_without_ties_what_is_unknown_does_not_matter(clips, seed, share):
    condensed = random_distances(clips, seed, "free")
    mu = np.quantile(condensed, share)
    assert_is_the_dense_route(linked(clips, *pairs_under(clips, condensed, mu)), condensed, mu)


@settings(max_examples=100, deadline=None)
@given(clips=st.integers(2, 9), seed=st.integers(0, 2**16), share=st.floats(0, 1))
def test_with_ties_every_merge_is_still_the_nearest_pair_and_none_is_left(clips, seed, share):
    condensed = random_distances(clips, seed, "tied")
    mu = np.quantile(condensed, share)
    found = linked(clips, *pairs_under(clips, condensed, mu))
    key = naive.complete_key(naive.square(condensed, clips))
    clusters = {clip: frozenset([clip]) for clip in range(clips)}
    for row, (left, right, height, size) in enumerate(found.merges):
        least = min(key(a, b) for a, b in combinations(clusters.values(), 2))
        a, b = clusters.pop(int(left)), clusters.pop(int(right))
        assert key(a, b) == least == height
        assert size == len(a | b)
        clusters[clips + row] = a | b
    assert all(key(a, b) > mu for a, b in combinations(clusters.values(), 2))
    assert naive.as_partition(found.clusters) == set(clusters.values())


def test_a_tie_may_hang_on_what_is_unknown():
    """Clip 2 is as near to 1 as to 3; the dense chain starts at 0 and goes to the nearer of 1 and 3."""
    outcomes = {}
    for to_1, to_3 in ((5.0, 6.0), (6.0, 5.0)):
        condensed = np.array([to_1, 9.0, to_3, 1.0, 2.0, 1.0])
        outcomes[to_1] = naive.as_partition(cut_tree(complete_linkage(condensed), threshold=1))
        sparse = linked(4, *pairs_under(4, condensed, 1))
        assert naive.as_partition(sparse.clusters) == {frozenset({0}), frozenset({1, 2}), frozenset({3})}
    assert outcomes[5.0] != outcomes[6.0]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_many_clips_in_many_clusters(dtype):
    rng = np.random.default_rng(0)
    points = np.repeat(rng.normal(size=(40, 3)) * 8, 15, axis=0) + rng.normal(size=(600, 3)) * 0.4
    i, j = np.triu_indices(600, 1)
    condensed = np.linalg.norm(points[i] - points[j], axis=1).astype(dtype)
    mu = 2.5
    found = linked(600, *pairs_under(600, condensed, mu), 5, mapped_array)
    assert 30 < found.clusters.max() < 200
    assert_is_the_dense_route(found, condensed.astype(np.float64), mu)


def test_clips_that_know_nobody_are_clusters_of_their_own():
    found = linked(4, [], [], [])
    assert found.merges.shape == (0, 4)
    assert_array_equal(found.clusters, [0, 1, 2, 3])
    assert linked(0, [], [], []).clusters.shape == (0,)
    assert_array_equal(linked(3, [2], [1], [0.0]).clusters, [1, 0, 0])


def test_the_input_is_left_as_it_is():
    first, second, distances = np.array([0, 1]), np.array([1, 2]), np.array([1, 1], np.float32)
    linked(3, first, second, distances)
    assert_array_equal(np.concatenate([first, second, distances]), [0, 1, 1, 2, 1, 1])


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        (([0], [0], [1.0]), "pair 0 is of clips 0 and 0; there must be two, numbered 0 to 2"),
        (([0, 1], [1, 3], [1.0, 1.0]), "pair 1 is of clips 1 and 3"),
        (([0, -1], [1, 2], [1.0, 1.0]), "pair 1 is of clips -1 and 2"),
        (([0, 1], [1, 0], [1.0, 1.0]), "the pair of clips 0 and 1 is given again"),
        (([0], [1], [np.nan]), "the distance of clips 0 and 1 is nan"),
        (([0], [1], [-1.0]), "the distance of clips 0 and 1 is -1.0"),
        (([0], [1, 2], [1.0]), r"shapes \(1,\), \(2,\), \(1,\)"),
    ],
)
def test_wrong_pairs_are_named(pairs, message):
    with pytest.raises(ValueError, match=message):
        linked(3, *pairs)
