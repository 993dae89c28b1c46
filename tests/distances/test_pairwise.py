import dataclasses
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
    random_thresholds,
    weighted_distance,
)
from tests.distances import naive
from tests.distances.strategies import clip_lists

FIELDS = ("dtw", "b_dtw", "curve", "weighted", "fuzzy_low", "fuzzy_high")


def walks(seed, lengths, d=7):
    rng = np.random.default_rng(seed)
    return [np.cumsum(rng.normal(size=(length, d)), axis=0).astype(np.float32) for length in lengths]


def assert_same_bits(one, other):
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field), err_msg=field)


@settings(max_examples=30, deadline=None)
@given(clip_lists())
def test_every_pair_is_what_the_single_functions_say(clips):
    result = pairwise_distances(clips, n_jobs=1)
    pairs = list(combinations(range(len(clips)), 2))
    assert result.dtw.shape == (len(pairs),)
    assert result.curve.shape == (len(pairs), 8)
    for place, (i, j) in enumerate(pairs):
        cost = cost_matrix(clips[i], clips[j])
        assert result.dtw[place] == dtw_distance(cost)
        assert result.b_dtw[place] == bidirectional_dtw_distance(cost)
        np.testing.assert_array_equal(result.curve[place], dtw_curve(cost))
        assert result.weighted[place] == weighted_distance(result.curve[place])
        assert (result.fuzzy_low[place], result.fuzzy_high[place]) == fuzzy_distance(result.curve[place])


def test_agrees_with_the_definition():
    clips = walks(0, [4, 9, 1, 12, 7], d=3)
    result = pairwise_distances(clips)
    for place, (i, j) in enumerate(combinations(range(5), 2)):
        cost = cost_matrix(clips[i], clips[j])
        assert result.dtw[place] == pytest.approx(naive.dtw(naive.euclidean(clips[i], clips[j])), rel=1e-6)
        curve = naive.curve(cost)
        np.testing.assert_allclose(result.curve[place], curve, rtol=1e-9)
        assert result.weighted[place] == pytest.approx(naive.weighted(curve), rel=1e-9)
        assert result.fuzzy_low[place] == pytest.approx(min(curve), rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(clip_lists(most=9), st.integers(1, 12), st.integers(1, 3))
def test_same_bits_for_any_tiles_and_threads(clips, tile, n_jobs):
    assert_same_bits(pairwise_distances(clips, n_jobs=1), pairwise_distances(clips, n_jobs=n_jobs, tile=tile))


@settings(max_examples=20, deadline=None)
@given(clip_lists(), clip_lists(most=3))
def test_same_bits_in_either_order(some, others):
    d = min(some[0].shape[1], others[0].shape[1])
    some, others = [clip[:, :d] for clip in some], [clip[:, :d] for clip in others]
    ahead, back = compare_clips(some, others), compare_clips(others, some)
    assert ahead.curve.shape == (len(some), len(others), 8)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(ahead, field), np.swapaxes(getattr(back, field), 0, 1))


def test_a_tile_is_the_matching_part_of_all_pairs():
    clips = walks(2, [15, 3, 70, 1, 16, 33, 8])
    everything, tile = pairwise_distances(clips), compare_clips(clips[:3], clips[3:])
    wanted = [i < 3 <= j for i, j in combinations(range(7), 2)]
    for field in FIELDS:
        part = getattr(everything, field)[wanted]
        np.testing.assert_array_equal(getattr(tile, field).reshape(part.shape), part)


def test_identical_clips_and_single_frames():
    clip = walks(3, [20])[0]
    result = pairwise_distances([clip, clip.copy(), clip[:1], clip[:1]])
    assert result.dtw[0] == result.b_dtw[0] == 0
    assert result.weighted[-1] == result.fuzzy_high[-1] == 0
    assert result.dtw[1] == pytest.approx(cost_matrix(clip, clip[:1]).mean(), rel=1e-6)


def test_own_thresholds():
    clips = walks(4, [12, 9, 20])
    drawn = random_thresholds(0)
    result = pairwise_distances(clips, thresholds=drawn)
    np.testing.assert_array_equal(result.curve[0], dtw_curve(cost_matrix(clips[0], clips[1]), drawn))
    assert result.weighted[0] == weighted_distance(result.curve[0], drawn)
    assert pairwise_distances(clips, thresholds=[0.5]).curve.shape == (3, 1)


def test_float64_clips_are_compared_in_float64():
    clips = [clip.astype(np.float64) / 3 for clip in walks(5, [12, 9])]
    assert pairwise_distances(clips).dtw[0] == dtw_distance(cost_matrix(*clips))


def test_no_pairs():
    clips = walks(6, [5])
    for few in ([], clips):
        result = pairwise_distances(few)
        assert result.dtw.shape == result.fuzzy_low.shape == (0,)
        assert result.curve.shape == (0, 8)
    assert compare_clips(clips, []).curve.shape == (1, 0, 8)


def test_record_is_frozen():
    result = pairwise_distances(walks(7, [3, 4]))
    assert [field.name for field in dataclasses.fields(result)] == list(FIELDS)
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.dtw = None


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (np.zeros((0, 7), np.float32), r"clips\[1\] has shape \(0, 7\)"),
        (np.zeros((3, 6), np.float32), r"clips\[1\] has 6 dimensions and clips\[0\] has 7"),
        (np.full((3, 7), np.nan, np.float32), r"clips\[1\] holds nan at frame 0, dimension 0"),
        (np.full((3, 7), -np.inf, np.float32), r"clips\[1\] holds -inf at frame 0"),
        (np.zeros((2**18 + 1, 7), np.float32), "262145 frames"),
    ],
)
def test_names_the_clip_at_fault(broken, message):
    with pytest.raises(ValueError, match=message):
        pairwise_distances([*walks(8, [3]), broken])
    with pytest.raises(
        ValueError, match=message.replace(r"clips\[1\]", r"clips_b\[0\]").replace("clips\\[0", "clips_a\\[0")
    ):
        compare_clips(walks(8, [3]), [broken])


@pytest.mark.parametrize("setting", [{"n_jobs": 0}, {"tile": 0}, {"thresholds": [2.0]}])
def test_refuses_settings_out_of_range(setting):
    with pytest.raises(ValueError, match="must"):
        pairwise_distances(walks(9, [3, 4]), **setting)


def test_thresholds_default_to_the_midpoints():
    clips = walks(10, [8, 9])
    assert_same_bits(pairwise_distances(clips), pairwise_distances(clips, thresholds=THRESHOLDS))
