"""DTW and B-DTW of all pairs, without the curve: the same bits as with it, and as one pair at a time."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import (
    bidirectional_dtw_distance,
    cost_matrix,
    dtw_distance,
    pairwise_distances,
    pairwise_dtw,
)
from tests.distances import naive
from tests.distances.strategies import SEEDS, clip_lists

BOTH = (False, True)
ANY_DTYPE = (np.float32, np.float64)


@settings(max_examples=50, deadline=None)
@given(clip_lists(dtypes=ANY_DTYPE), st.integers(1, 3))
def test_every_pair_is_what_the_single_functions_say(clips, n_jobs):
    costs = [cost_matrix(*pair) for pair in combinations(clips, 2)]
    for bidirectional, distance in zip(BOTH, (dtw_distance, bidirectional_dtw_distance), strict=True):
        result = pairwise_dtw(clips, n_jobs=n_jobs, bidirectional=bidirectional)
        assert result.dtype == np.float64
        np.testing.assert_array_equal(result, [distance(cost) for cost in costs])


@settings(max_examples=50, deadline=None)
@given(clip_lists(most=9, dtypes=ANY_DTYPE), st.sampled_from([None, 1, 2, 3]), st.integers(1, 12))
def test_same_bits_as_beside_the_curve(clips, n_jobs, tile):
    whole = pairwise_distances(clips)
    np.testing.assert_array_equal(pairwise_dtw(clips, n_jobs, tile=tile), whole.dtw)
    np.testing.assert_array_equal(pairwise_dtw(clips, n_jobs, bidirectional=True, tile=tile), whole.b_dtw)


@settings(max_examples=40, deadline=None)
@given(clip_lists(most=8), st.booleans(), st.data())
def test_same_bits_in_any_order_and_any_subset(clips, bidirectional, data):
    def by_pair(names):
        distances = pairwise_dtw([clips[k] for k in names], bidirectional=bidirectional)
        return {frozenset(pair): d for pair, d in zip(combinations(names, 2), distances, strict=True)}

    whole = by_pair(range(len(clips)))
    kept = data.draw(st.lists(st.integers(0, len(clips) - 1), unique=True, max_size=len(clips)))
    assert by_pair(kept) == {pair: whole[pair] for pair in by_pair(kept)}


@pytest.mark.parametrize("bidirectional", BOTH)
@pytest.mark.parametrize("d", [1, 2, 59, 64])
def test_lengths_of_every_kind_side_by_side(d, bidirectional):
    rng = np.random.default_rng(d)
    lengths = [*[1, 400, 1, 2, 15, 16, 17, 31, 32, 33, 63, 64, 65, 3], *rng.integers(1, 70, size=60)]
    clips = [np.cumsum(rng.normal(size=(n, d)), axis=0).astype(np.float32) for n in lengths]
    distance = bidirectional_dtw_distance if bidirectional else dtw_distance
    single = [distance(cost_matrix(*pair)) for pair in combinations(clips, 2)]
    np.testing.assert_array_equal(pairwise_dtw(clips, 2, bidirectional=bidirectional), single)


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.integers(1, 3), st.integers(2, 25))
def test_ties_of_whole_costs_go_to_the_shortest_path(seed, largest, count):
    """Frames on a line at whole places: every cost is whole, and exact."""
    rng = np.random.default_rng(seed)
    clips = [
        rng.integers(0, largest + 1, size=(rng.integers(1, 9), 1)).astype(np.float32) for _ in range(count)
    ]
    ahead, both = pairwise_dtw(clips), pairwise_dtw(clips, bidirectional=True)
    for place, (a, b) in enumerate(combinations(clips, 2)):
        cost = naive.euclidean(a, b)
        assert ahead[place] == pytest.approx(naive.dtw(cost), abs=1e-12 * largest)
        assert both[place] == pytest.approx(naive.b_dtw(cost), abs=1e-12 * largest)


@pytest.mark.parametrize("bidirectional", BOTH)
def test_very_long_against_very_short(bidirectional):
    rng = np.random.default_rng(4)
    clips = [rng.normal(size=(n, 3)).astype(np.float32) for n in (1, 3000, 2, 5, 700)]
    distance = naive.b_dtw if bidirectional else naive.dtw
    expected = [distance(cost_matrix(*pair)) for pair in combinations(clips[:4], 2)]
    np.testing.assert_allclose(pairwise_dtw(clips[:4], bidirectional=bidirectional), expected, rtol=1e-8)
    whole = pairwise_distances(clips, thresholds=[1.0])
    np.testing.assert_array_equal(
        pairwise_dtw(clips, bidirectional=bidirectional), whole.b_dtw if bidirectional else whole.dtw
    )


def test_no_pairs_and_what_is_refused():
    clip = np.zeros((5, 3), np.float32)
    assert pairwise_dtw([]).shape == pairwise_dtw([clip]).shape == (0,)
    with pytest.raises(ValueError, match=r"clips\[1\] holds nan at frame 0, dimension 0"):
        pairwise_dtw([clip, clip * np.nan])
    with pytest.raises(ValueError, match="n_jobs"):
        pairwise_dtw([clip, clip], n_jobs=0)
