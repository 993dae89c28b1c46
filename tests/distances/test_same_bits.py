"""A pair's distances have the same bits whatever is compared beside it, and however the work is cut up."""

import os
import subprocess
import sys
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import (
    THRESHOLDS,
    bidirectional_dtw_distance,
    compare_clips,
    cost_matrix,
    dtw_curve,
    dtw_distance,
    fuzzy_distance,
    pairwise_distances,
    weighted_distance,
)
from tests.distances import naive
from tests.distances.strategies import SEEDS, clip_lists

FIELDS = ("dtw", "b_dtw", "curve", "weighted", "fuzzy_low", "fuzzy_high")
ANY_DTYPE = (np.float32, np.float64)


def assert_same_bits(one, other):
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field), err_msg=field)


def rows(result):
    """All values of every pair, one row a pair."""
    return np.column_stack([getattr(result, field) for field in FIELDS])


def by_pair(result, clips):
    """Map both orders of every pair of clips, given by name, to its row."""
    table = {}
    for (i, j), row in zip(combinations(clips, 2), rows(result), strict=True):
        table[i, j] = table[j, i] = row.tolist()
    return table


@settings(max_examples=50, deadline=None)
@given(clip_lists(dtypes=ANY_DTYPE), st.integers(1, 3))
def test_every_pair_is_what_the_single_functions_say(clips, n_jobs):
    result = pairwise_distances(clips, n_jobs=n_jobs)
    pairs = list(combinations(clips, 2))
    assert result.curve.shape == (len(pairs), 8)
    for place, pair in enumerate(pairs):
        cost = cost_matrix(*pair)
        assert result.dtw[place] == dtw_distance(cost)
        assert result.b_dtw[place] == bidirectional_dtw_distance(cost)
        np.testing.assert_array_equal(result.curve[place], dtw_curve(cost))
        assert result.weighted[place] == weighted_distance(result.curve[place])
        assert (result.fuzzy_low[place], result.fuzzy_high[place]) == fuzzy_distance(result.curve[place])


@settings(max_examples=30, deadline=None)
@given(clip_lists(most=9), st.integers(1, 12), st.integers(1, 3))
def test_any_tiles_and_threads(clips, tile, n_jobs):
    assert_same_bits(pairwise_distances(clips, n_jobs=1), pairwise_distances(clips, n_jobs=n_jobs, tile=tile))


@settings(max_examples=30, deadline=None)
@given(clip_lists(most=8, dtypes=ANY_DTYPE), st.integers(1, 5), st.data())
def test_any_order_and_any_subset_of_the_clips(clips, tile, data):
    whole = by_pair(pairwise_distances(clips, n_jobs=1), range(len(clips)))
    kept = data.draw(st.lists(st.integers(0, len(clips) - 1), unique=True, max_size=len(clips)))
    part = by_pair(pairwise_distances([clips[k] for k in kept], n_jobs=1, tile=tile), kept)
    assert part == {pair: whole[pair] for pair in part}


@settings(max_examples=30, deadline=None)
@given(clip_lists(), clip_lists(most=3))
def test_a_tile_in_either_order(some, others):
    d = min(some[0].shape[1], others[0].shape[1])
    some, others = [clip[:, :d] for clip in some], [clip[:, :d] for clip in others]
    ahead, back = compare_clips(some, others), compare_clips(others, some)
    assert ahead.curve.shape == (len(some), len(others), 8)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(ahead, field), np.swapaxes(getattr(back, field), 0, 1))
    everything = by_pair(pairwise_distances([*some, *others], n_jobs=1), range(len(some) + len(others)))
    for i, j in np.ndindex(len(some), len(others)):
        tile = np.hstack([getattr(ahead, field)[i, j] for field in FIELDS])
        assert tile.tolist() == everything[i, len(some) + j]


@settings(max_examples=10, deadline=None)
@given(SEEDS, st.sampled_from([1, 2, 59, 64]))
def test_lengths_of_every_kind_in_one_tile(seed, d):
    """Each pair alone, and all of them in one tile: widths that fill blocks of lanes and that do not."""
    rng = np.random.default_rng(seed)
    lengths = [1, 400, 1, 2, 15, 16, 17, 31, 32, 33, 63, 64, 65, 3]
    clips = [np.cumsum(rng.normal(size=(n, d)), axis=0).astype(np.float32) for n in lengths]
    together = rows(pairwise_distances(clips, n_jobs=2))
    alone = [rows(pairwise_distances(pair, n_jobs=1))[0] for pair in combinations(clips, 2)]
    np.testing.assert_array_equal(together, alone)


@settings(max_examples=20, deadline=None)
@given(clip_lists(most=4, longest=12), st.integers(0, 7))
def test_costs_of_very_different_size_in_one_tile(clips, which):
    """A pair's costs are scaled by their own greatest, not by the tile's."""
    large = clips[which % len(clips)] * np.float32(1e12)
    whole = by_pair(pairwise_distances([*clips, large], n_jobs=1), range(len(clips) + 1))
    part = by_pair(pairwise_distances(clips, n_jobs=1), range(len(clips)))
    assert part == {pair: whole[pair] for pair in part}


@settings(max_examples=100, deadline=None)
@given(SEEDS, st.sampled_from([-1, 0, 1]))
def test_costs_beside_delta_are_told_from_it(seed, above):
    """A float32 cost next to delta, which is a float64, lies above it or not: nothing is rounded between."""
    rng = np.random.default_rng(seed)
    least, largest = np.float32(rng.choice([0, rng.uniform(0, 0.1)])), np.float32(rng.uniform(1, 2))
    span = float(largest) - float(least)
    delta = [np.float32(float(least) + threshold * span) for threshold in THRESHOLDS[:7]]
    beside = np.array([value + above * np.spacing(value) for value in delta])
    for cost in beside:
        # On a line from 0: a zone at the least cost, a high cell, and another zone or none beside delta.
        row = np.array([[least, largest, cost, largest, least]]).T.astype(np.float32)
        result = pairwise_distances([np.zeros((1, 1), np.float32), row])
        np.testing.assert_allclose(result.curve[0], naive.curve(row.T), rtol=1e-12)
        np.testing.assert_array_equal(result.curve[0], dtw_curve(row.T))


@pytest.mark.parametrize("frames", [1, 20])
def test_many_copies_of_one_clip(frames):
    clip = np.random.default_rng(3).normal(size=(frames, 59)).astype(np.float32)
    result = pairwise_distances([clip.copy() for _ in range(40)] + [clip + 1])
    last = np.array([j == 40 for _, j in combinations(range(41), 2)])
    assert not result.dtw[~last].any()
    assert not result.b_dtw[~last].any()
    for column in (result.dtw, result.b_dtw, *result.curve.T):
        assert len(set(column[~last])) == len(set(column[last])) == 1


@pytest.mark.slow
@pytest.mark.parametrize("d", [1, 59, 130])
def test_hundreds_of_clips(d):
    rng = np.random.default_rng(d)
    lengths = rng.integers(1, 90, size=150)
    clips = [np.cumsum(rng.normal(size=(n, d)), axis=0).astype(np.float32) for n in lengths]
    whole = pairwise_distances(clips, n_jobs=2)
    assert_same_bits(whole, pairwise_distances(clips, n_jobs=1, tile=17))
    back = by_pair(pairwise_distances(clips[::-1], n_jobs=2, tile=29), range(149, -1, -1))
    assert by_pair(whole, range(150)) == back
    for place, pair in enumerate(combinations(clips, 2)):
        np.testing.assert_array_equal(whole.curve[place], dtw_curve(cost_matrix(*pair)))


DIGEST = """
import hashlib, numpy as np
from motionary.pipeline.distances import pairwise_distances
rng = np.random.default_rng(0)
clips = [np.cumsum(rng.normal(size=(n, 59)), axis=0).astype(np.float32) for n in (3, 17, 64, 31, 9)]
result = pairwise_distances(clips, n_jobs=1)
print(hashlib.sha256(result.dtw.tobytes() + result.curve.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_same_bits_on_older_processors(tmp_path):
    """With registers of 512, 256 and 128 bits, and with a fused multiply-add in software."""
    digests = set()
    for processor in ("", "haswell", "generic"):
        chosen = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""} if processor else {}
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / processor)} | chosen
        done = subprocess.run(
            [sys.executable, "-c", DIGEST], env=environment, capture_output=True, text=True, check=True
        )
        digests.add(done.stdout)
    assert len(digests) == 1
