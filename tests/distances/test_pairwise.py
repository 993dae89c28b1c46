"""All pairs: their order, their definition, and what is refused. Their bits: `test_same_bits.py`."""

import dataclasses
import os
import subprocess
import sys
import time
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.spatial.distance import squareform

from motionary.pipeline.distances import (
    THRESHOLDS,
    compare_clips,
    cost_matrix,
    dtw_curve,
    dtw_distance,
    pairwise_distances,
    pairwise_dtw,
    random_thresholds,
    weighted_distance,
)
from motionary.pipeline.distances.tiles import compare_all
from tests.distances import naive
from tests.distances.strategies import clip_lists

FIELDS = ["dtw", "b_dtw", "curve", "weighted", "fuzzy_low", "fuzzy_high"]


def walks(seed, lengths, d=7):
    rng = np.random.default_rng(seed)
    return [np.cumsum(rng.normal(size=(length, d)), axis=0).astype(np.float32) for length in lengths]


@settings(max_examples=25, deadline=None)
@given(clip_lists(most=4, longest=12, dtypes=(np.float64,)))
def test_agrees_with_the_definition(clips):
    clips = [clip[:20, :6] for clip in clips]
    result = pairwise_distances(clips)
    for place, pair in enumerate(combinations(clips, 2)):
        cost = naive.euclidean(*pair)
        # Zones hang on whether a cost is just not above delta: the curve is that of our own costs.
        curve = naive.curve(cost_matrix(*pair))
        tolerance = 1e-12 * cost.max()
        assert result.dtw[place] == pytest.approx(naive.dtw(cost), abs=tolerance)
        assert result.b_dtw[place] == pytest.approx(naive.b_dtw(cost), abs=tolerance)
        np.testing.assert_allclose(result.curve[place], curve, rtol=0, atol=tolerance)
        assert result.weighted[place] == pytest.approx(naive.weighted(curve), abs=tolerance)
        assert result.fuzzy_low[place] == pytest.approx(min(curve), abs=tolerance)
        assert result.fuzzy_high[place] == pytest.approx(max(curve), abs=tolerance)


def test_pairs_stand_in_squareform_order():
    clips = [np.full((2, 1), place**2, np.float32) for place in range(9)]
    square = squareform(pairwise_distances(clips, tile=4).dtw)
    places = np.arange(9) ** 2
    np.testing.assert_array_equal(square, abs(places[:, None] - places))


def test_single_frames_are_compared_with_all_frames():
    clip = walks(3, [20])[0]
    result = pairwise_distances([clip, clip[:1], clip[:1] + 1])
    assert result.dtw[0] == result.b_dtw[0] == pytest.approx(cost_matrix(clip, clip[:1]).mean(), rel=1e-6)
    np.testing.assert_allclose(result.curve[2], np.sqrt(7), rtol=1e-6)


def test_own_thresholds():
    clips = walks(4, [12, 9, 20])
    drawn = random_thresholds(0)
    result = pairwise_distances(clips, thresholds=drawn)
    np.testing.assert_array_equal(result.curve[0], dtw_curve(cost_matrix(clips[0], clips[1]), drawn))
    assert result.weighted[0] == weighted_distance(result.curve[0], drawn)
    assert pairwise_distances(clips, thresholds=[0.5]).curve.shape == (3, 1)
    turned = pairwise_distances(clips, thresholds=drawn[::-1]).curve
    np.testing.assert_array_equal(turned[:, ::-1], result.curve)
    default = pairwise_distances(clips, thresholds=THRESHOLDS)
    np.testing.assert_array_equal(pairwise_distances(clips).curve, default.curve)


def test_one_float64_clip_has_all_compared_in_float64():
    clips = [*walks(5, [12, 9]), walks(6, [5])[0].astype(np.float64) / 3]
    mixed = pairwise_distances(clips).dtw
    double = [clip.astype(np.float64) for clip in clips]
    np.testing.assert_array_equal(
        mixed, [dtw_distance(cost_matrix(*pair)) for pair in combinations(double, 2)]
    )


def test_no_pairs():
    clips = walks(6, [5])
    for few in ([], clips):
        result = pairwise_distances(few)
        assert result.dtw.shape == result.fuzzy_low.shape == (0,)
        assert result.curve.shape == (0, 8)
    assert compare_clips(clips, []).curve.shape == (1, 0, 8)


def test_record_is_frozen():
    result = pairwise_distances(walks(7, [3, 4]))
    assert [field.name for field in dataclasses.fields(result)] == FIELDS
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


def test_a_tile_that_fails_stops_the_rest():
    calls = []

    def compare(a, b, upper):
        calls.append(upper)
        time.sleep(0.01)
        raise MemoryError("no room for this tile")

    with pytest.raises(MemoryError, match="no room"):
        compare_all(walks(11, [2] * 20), 1, 1, compare, [])
    assert len(calls) < 20


def test_one_long_clip_needs_no_room_for_itself():
    """A matrix of the long clip against itself would take 16 GB a byte."""
    long, short = np.ones((2**17, 1), np.float32), np.zeros((3, 1), np.float32)
    assert pairwise_distances([long, short]).weighted[0] == pytest.approx(weighted_distance([1.0] * 8))
    assert pairwise_dtw([long, short, short])[0] == 1
    assert pairwise_distances([long], tile=1).dtw.shape == (0,)


def test_compilation_switched_off_is_refused():
    done = subprocess.run(
        [sys.executable, "-c", "from motionary.pipeline.distances import dtw_distance"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert "NUMBA_DISABLE_JIT is set" in done.stderr
