"""Linkage: exact against naive agglomeration and SciPy without ties, greedy at every merge with them."""

import math
from functools import partial
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import pdist, squareform

from motionary.pipeline.clustering import average_linkage, complete_linkage, fuzzy_linkage, ward_linkage
from motionary.pipeline.clustering.mapped import mapped_array
from tests.clustering import naive

METHODS = {
    "complete": (complete_linkage, naive.complete_key),
    "average": (average_linkage, naive.average_key),
    "ward": (ward_linkage, naive.ward_key),
}


def condensed(values, most=8):
    """Distances of 2 clips or more, metric or not."""
    return st.integers(2, most).flatmap(
        lambda n: st.lists(values, min_size=n * (n - 1) // 2, max_size=n * (n - 1) // 2).map(np.array)
    )


TIED = condensed(st.integers(0, 4).map(float))
ROUNDED = condensed(st.sampled_from([0.1, 0.2, 0.3, 0.7, 1e-9]))
FREE = condensed(st.floats(0, 100, allow_subnormal=False))
MANY_TIES = st.builds(
    lambda clips, most, seed: np.random.default_rng(seed).integers(0, most, math.comb(clips, 2)) / 1.0,
    st.integers(9, 14),
    st.integers(1, 6),
    st.integers(0, 2**16),
)
TAUS = st.sampled_from([0, 0.25, 0.5, 1])


def assert_greedy(Z, key, rooted=False):
    for height, merged, least in naive.replay(Z, key):
        assert float(merged) == pytest.approx(float(least), rel=1e-12, abs=1e-14)
        assert height ** (2 if rooted else 1) == pytest.approx(float(merged), rel=1e-12, abs=1e-14)
    assert (np.diff(Z[:, 2]) >= 0).all()


def clips_in(distances):
    return round((1 + np.sqrt(1 + 8 * len(distances))) / 2)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=100, deadline=None)
@given(distances=st.one_of(TIED, ROUNDED, FREE, MANY_TIES))
def test_every_merge_is_the_nearest_pair_of_its_partition(method, distances):
    link, key = METHODS[method]
    Z = link(distances)
    assert Z.shape == (clips_in(distances) - 1, 4)
    assert_greedy(Z, key(naive.square(distances, len(Z) + 1)), rooted=method == "ward")


@settings(max_examples=150, deadline=None)
@given(low=st.one_of(TIED, ROUNDED, FREE, MANY_TIES), seed=st.integers(0, 2**16), tau=TAUS)
def test_every_fuzzy_merge_is_the_nearest_pair_of_its_partition(low, seed, tau):
    high = low + np.random.default_rng(seed).integers(0, 4, len(low)) * 0.5
    Z = fuzzy_linkage(low, high, tau)
    clips = len(Z) + 1
    assert_greedy(Z, naive.fuzzy_key(naive.square(low, clips), naive.square(high, clips), tau))


def merges_of(Z):
    """The last clips of the two clusters of every merge, and its height."""
    last = [*range(len(Z) + 1)]
    for left, right in Z[:, :2].astype(int):
        last.append(max(last[left], last[right]))
        yield tuple(sorted((last[left], last[right])))


@settings(max_examples=60, deadline=None)
@given(clips=st.integers(2, 40), most=st.integers(1, 30), seed=st.integers(0, 2**16))
def test_ties_are_won_by_the_last_link_and_then_the_lowest_index(clips, most, seed):
    distances = np.random.default_rng(seed).integers(1, most + 1, math.comb(clips, 2)).astype(np.float32)
    exact = naive.square(distances, clips)
    for Z, key in (
        (complete_linkage(distances), naive.complete_key(exact)),
        (fuzzy_linkage(distances, distances, 0.5), naive.fuzzy_key(exact, exact, 0.5)),
    ):
        assert [*merges_of(Z)] == [(gone, kept) for _, gone, kept in naive.chain(clips, key)]


@settings(max_examples=40, deadline=None)
@given(clips=st.integers(2, 60), tied=st.booleans(), seed=st.integers(0, 2**16))
def test_float32_and_files_give_the_same_bits(clips, tied, seed):
    rng = np.random.default_rng(seed)
    pairs = math.comb(clips, 2)
    low = (rng.integers(1, 9, pairs) / 3 if tied else rng.random(pairs)).astype(np.float32)
    high = low + rng.random(pairs, dtype=np.float32)
    links = [(link, (low,)) for link, _ in METHODS.values()] + [(fuzzy_linkage, (low, high))]
    for link, ends in links:
        Z = link(*(end.astype(np.float64) for end in ends))
        assert_array_equal(link(*ends), Z)
        assert_array_equal(link(*ends, new_array=mapped_array), Z)


def assert_is_agglomeration(Z, key, rooted=False):
    clips = len(Z) + 1
    for row, (height, clusters) in enumerate(naive.agglomerate(clips, key)):
        assert naive.partition(Z, clips - 1 - row) == clusters
        assert Z[row, 2] ** (2 if rooted else 1) == pytest.approx(float(height), rel=1e-12)


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=25, deadline=None)
@given(clips=st.integers(2, 14), seed=st.integers(0, 2**16))
def test_without_ties_it_is_naive_agglomeration(method, clips, seed):
    distances = np.random.default_rng(seed).random(math.comb(clips, 2))
    link, key = METHODS[method]
    assert_is_agglomeration(link(distances), key(naive.square(distances, clips)), rooted=method == "ward")


@settings(max_examples=60, deadline=None)
@given(clips=st.integers(2, 14), seed=st.integers(0, 2**16), tau=TAUS)
def test_without_ties_fuzzy_linkage_is_naive_agglomeration(clips, seed, tau):
    low, width = np.random.default_rng(seed).random((2, math.comb(clips, 2)))
    key = naive.fuzzy_key(naive.square(low, clips), naive.square(low + width, clips), tau)
    assert_is_agglomeration(fuzzy_linkage(low, low + width, tau), key)


@settings(max_examples=60, deadline=None)
@given(
    clips=st.integers(2, 40),
    seed=st.integers(0, 2**16),
    power=st.integers(-500, 250),
    tau=TAUS,
)
def test_neither_unit_nor_order_of_the_clips_matters(clips, seed, power, tau):
    rng = np.random.default_rng(seed)
    low = rng.random(math.comb(clips, 2))
    high = low + rng.random(len(low))
    order, unit = rng.permutation(clips), 4.0**power

    def shuffled(distances):
        return unit * squareform(squareform(distances)[np.ix_(order, order)], checks=False)

    links = [(link, (low,)) for link, _ in METHODS.values()] + [
        (partial(fuzzy_linkage, tau=tau), (low, high))
    ]
    for link, ends in links:
        Z, other = link(*ends), link(*map(shuffled, ends))
        assert_allclose(other[:, 2], Z[:, 2] * (2.0**power if link is ward_linkage else unit), rtol=1e-13)
        for kappa in {1, 2, clips // 2 + 1, clips}:
            renamed = {frozenset(order[list(c)].tolist()) for c in naive.partition(other, kappa)}
            assert renamed == naive.partition(Z, kappa)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("clips", [2, 3, 10, 57, 200])
@pytest.mark.parametrize("metric", [True, False])
def test_without_ties_the_dendrogram_is_scipys(method, clips, metric):
    rng = np.random.default_rng(clips)
    distances = pdist(rng.normal(size=(clips, 5))) if metric else rng.random(clips * (clips - 1) // 2)
    Z = METHODS[method][0](distances)
    expected = linkage(np.sqrt(distances) if method == "ward" else distances, method)
    assert_array_equal(Z[:, [0, 1, 3]], expected[:, [0, 1, 3]])
    assert_allclose(Z[:, 2], expected[:, 2], rtol=1e-12)


@settings(max_examples=100, deadline=None)
@given(distances=st.one_of(TIED, FREE))
def test_tau_runs_from_single_to_complete_linkage(distances):
    assert_array_equal(
        fuzzy_linkage(distances, distances + 1, tau=0)[:, 2], linkage(distances, "single")[:, 2]
    )
    assert_array_equal(fuzzy_linkage(distances, distances, tau=1), complete_linkage(distances))


def test_fuzzy_linkage_at_a_large_size_agrees_with_its_two_ends():
    rng = np.random.default_rng(4)
    low = rng.random(150 * 149 // 2)
    high = low + rng.random(len(low))
    assert_array_equal(fuzzy_linkage(low, high, 0), linkage(low, "single"))
    assert_array_equal(fuzzy_linkage(low, high, 1), linkage(high, "complete"))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("clips", [10, 100])
def test_rounding_lets_no_height_fall(method, clips):
    Z = METHODS[method][0](np.full(clips * (clips - 1) // 2, 0.1))
    least = np.sqrt(0.1) if method == "ward" else 0.1
    assert (np.diff(Z[:, 2], prepend=least) >= 0).all()
    assert_allclose(Z[:, 2], least, rtol=1e-12)


@pytest.mark.parametrize("link", [METHODS[m][0] for m in METHODS])
def test_the_input_is_left_as_it_is_and_the_result_repeats(link):
    distances = np.random.default_rng(0).integers(0, 5, 20 * 19 // 2).astype(float)
    before = distances.copy()
    assert_array_equal(link(distances), link(distances))
    assert_array_equal(distances, before)
    assert_array_equal(link(distances.astype(np.float32)), link(distances))


def test_one_clip_has_no_merges():
    assert complete_linkage([]).shape == (0, 4)
    assert fuzzy_linkage([], []).shape == (0, 4)
    assert ward_linkage([]).shape == (0, 4)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -1.0])
@pytest.mark.parametrize(("pair", "clips"), [(0, "0 and 1"), (3, "0 and 4"), (4, "1 and 2"), (9, "3 and 4")])
def test_a_wrong_distance_is_named_by_its_clips(wrong, pair, clips):
    distances = np.ones(10)
    distances[pair] = wrong
    for link, _ in METHODS.values():
        with pytest.raises(ValueError, match=f"clips {clips} is {wrong}"):
            link(distances)
    with pytest.raises(ValueError, match=f"low: the distance of clips {clips}"):
        fuzzy_linkage(distances, np.ones(10))


@pytest.mark.parametrize("block", [1, 4, 10, 11])
def test_a_wrong_distance_is_named_whatever_block_it_is_in(monkeypatch, block):
    monkeypatch.setattr("motionary.pipeline.clustering.condensed._BLOCK", block)
    for pair, clips in enumerate(combinations(range(5), 2)):
        distances = np.ones(10, np.float32)
        distances[pair] = -1
        with pytest.raises(ValueError, match="clips {} and {} is -1".format(*clips)):
            complete_linkage(distances)
        with pytest.raises(ValueError, match=r"clips {} and {} is \[1.0, 0.5\]".format(*clips)):
            fuzzy_linkage(np.ones(10), np.where(distances < 0, 0.5, 1))


def test_arrays_that_are_not_condensed_are_refused():
    with pytest.raises(ValueError, match="4 distances are not a condensed matrix: 3 clips have 3, 4 have 6"):
        complete_linkage(np.ones(4))
    with pytest.raises(ValueError, match=r"shape \(3, 3\)"):
        ward_linkage(np.zeros((3, 3)))


def test_wrong_intervals_are_refused():
    with pytest.raises(ValueError, match=r"clips 0 and 2 is \[2.0, 1.0\]"):
        fuzzy_linkage([1, 2, 1], [1, 1, 1])
    with pytest.raises(ValueError, match="low holds 1 pairs and high 3"):
        fuzzy_linkage([1], [1, 1, 1])
    with pytest.raises(ValueError, match=r"tau is 1\.5"):
        fuzzy_linkage([1], [1], tau=1.5)
