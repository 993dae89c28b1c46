"""Nearest clips: what comparing all gives, whatever the bounds rule out, and the bounds themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import THRESHOLDS, compare_clips, cost_matrix, random_thresholds
from motionary.pipeline.distances.nearest import METRICS, nearest_clips, pack_library
from tests.distances import naive
from tests.distances.strategies import clip_lists, frame_pairs

ANY_DTYPE = (np.float32, np.float64)


def ranked_values(query, clips, metric, thresholds=THRESHOLDS, tau=0.5):
    """Distances to all clips as they are ranked, by comparing all."""
    found = compare_clips([query], clips, thresholds)
    if metric != "fuzzy":
        return getattr(found, metric)[0].astype(np.float32)
    low, high = (end[0].astype(np.float32).astype(float) for end in (found.fuzzy_low, found.fuzzy_high))
    return ((1 - tau) * low + tau * high).astype(np.float32)


def nearest_by_sorting(distances, k, groups, among):
    """The k nearest groups, each by its nearest clip, by looking at every clip in order of distance."""
    best = {}
    for clip in sorted(among, key=lambda clip: (distances[clip], clip)):
        best.setdefault(groups[clip], clip)
    return [*best.values()][:k]


@settings(max_examples=100, deadline=None)
@given(clip_lists(most=9, dtypes=ANY_DTYPE), st.sampled_from(METRICS), st.integers(1, 12), st.data())
def test_same_answer_as_comparing_all_with_and_without_pruning(clips, metric, k, data):
    query, *library = clips if len(clips) > 1 else clips * 2
    places = st.integers(0, len(library) - 1)
    among = data.draw(st.one_of(st.none(), st.lists(places, unique=True)))
    groups = data.draw(
        st.one_of(st.none(), st.lists(st.integers(-1, 2), min_size=len(library), max_size=len(library)))
    )
    tau = data.draw(st.sampled_from([0.0, 0.3, 0.5, 1.0]))
    thresholds = data.draw(st.sampled_from([THRESHOLDS, random_thresholds(3), (1.0, 0.4), (0.2,)]))
    distances = ranked_values(query, library, metric, thresholds, tau)
    chosen = range(len(library)) if among is None else among
    expected = nearest_by_sorting(distances, k, groups or range(len(library)), chosen)
    packed = pack_library(library)
    for prune in (True, False):
        found = nearest_clips(
            query, packed, k, metric, thresholds, tau=tau, groups=groups, among=among, prune=prune
        )
        assert found.index.tolist() == expected
        assert found.distance.dtype == np.float32
        np.testing.assert_array_equal(found.distance, distances[expected])
        assert found.compared + found.pruned == len(chosen)
        assert prune or not found.pruned


@settings(max_examples=60, deadline=None)
@given(frame_pairs(longest=9))
def test_no_value_is_below_the_least_cost_and_no_path_below_its_rows_and_columns(pair):
    cost = cost_matrix(*pair).astype(np.float64)
    m, n = cost.shape
    least, rounding = cost.min(), 1e-9 * cost.max()
    assert min(naive.curve(cost)) >= least - rounding
    for lines, across in ((cost.min(axis=1), n), (cost.min(axis=0), m)):
        bound = (lines.sum() + (across - 1) * least) / (m + n - 1)
        assert naive.b_dtw(cost) >= bound - rounding
    boxes = [(clip.min(axis=0).astype(float), clip.max(axis=0).astype(float)) for clip in pair]
    (low_a, high_a), (low_b, high_b) = boxes
    gap = np.maximum(np.maximum(low_b - high_a, low_a - high_b), 0)
    assert least >= np.linalg.norm(gap) * (1 - 1e-4) - 1e-4 * cost.max()


@pytest.mark.parametrize("metric", METRICS)
def test_agrees_with_the_slow_references(metric):
    rng = np.random.default_rng(5)
    clips = [np.cumsum(rng.normal(size=(frames, 3)), axis=0) for frames in (9, 4, 7, 1, 12, 6, 7)]
    query, *library = clips
    slow = {"dtw": naive.dtw, "b_dtw": naive.b_dtw}
    distances = []
    for clip in library:
        cost = naive.euclidean(query, clip)
        curve = [] if metric in slow else naive.curve(cost)
        ends = {"weighted": naive.weighted, "fuzzy": lambda c: 0.75 * min(c) + 0.25 * max(c)}
        distances.append(slow[metric](cost) if metric in slow else ends[metric](curve))
    found = nearest_clips(query, pack_library(library), 4, metric, tau=0.25)
    assert found.index.tolist() == np.argsort(distances)[:4].tolist()
    np.testing.assert_allclose(found.distance, np.sort(distances)[:4], rtol=1e-6)


@pytest.mark.parametrize("metric", METRICS)
def test_far_clips_are_ruled_out(metric):
    rng = np.random.default_rng(0)
    near = [rng.normal(size=(20, 5)).astype(np.float32) for _ in range(10)]
    far = [clip + np.float32(40) for clip in near]
    found = nearest_clips(near[0], pack_library([*far, *near]), 3, metric)
    assert found.index[0] == 10
    assert found.distance[0] == 0
    assert found.pruned >= 10
    assert found.compared <= 10


@pytest.mark.parametrize("metric", METRICS)
def test_a_path_of_dear_rows_is_ruled_out_by_them(metric):
    """One frame in common bounds the least cost by nothing; the others still tell DTW that they are far."""
    rng = np.random.default_rng(1)
    query = rng.normal(size=(20, 5)).astype(np.float32)
    far = [np.concatenate([query[:1], query[1:] + 50 + shift]) for shift in range(5)]
    library = pack_library([query + np.float32(0.01), *far])
    found = nearest_clips(query, library, 1, metric)
    assert found.index.tolist() == [0]
    assert found.compared == 1


def test_equal_distances_go_by_place_in_the_library():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 12, 4)).astype(np.float32)
    library = pack_library([b, a, b, a, a, b])
    found = nearest_clips(a, library, 5)
    assert found.index.tolist() == [1, 3, 4, 0, 2]
    grouped = nearest_clips(a, library, 2, groups=[7, 9, 7, 7, 7, 9])
    assert grouped.index.tolist() == [1, 3]


def test_fewer_clips_than_asked_for():
    clip = np.zeros((3, 2), dtype=np.float32)
    found = nearest_clips(clip, pack_library([clip, clip]), 10)
    assert (found.index.tolist(), found.compared, found.pruned) == ([0, 1], 2, 0)
    assert not len(nearest_clips(clip, pack_library([clip]), 3, among=[]).index)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"k": 0}, "k is 0"),
        ({"metric": "cosine"}, "metric is 'cosine'"),
        ({"tau": 1.5}, "tau is 1.5"),
        ({"groups": [1, 2]}, "2 groups for 3 clips"),
        ({"among": [3]}, "among holds 3"),
        ({"query": np.zeros((2, 5))}, "the library has 4 dimensions and query has 5"),
        ({"query": np.full((2, 4), np.nan)}, "query holds nan"),
        ({"thresholds": [1.2]}, "threshold is 1.2"),
    ],
)
def test_what_cannot_be_asked(arguments, message):
    library = pack_library([np.zeros((2, 4), dtype=np.float32)] * 3)
    with pytest.raises(ValueError, match=message):
        nearest_clips(**({"query": np.zeros((2, 4)), "library": library} | arguments))


def test_a_library_has_clips():
    with pytest.raises(ValueError, match="at least one clip"):
        pack_library([])
