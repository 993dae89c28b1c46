"""What a distance is made of: parts that add up to it; zones and covers of kernels and oracle."""

from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.distances import compare_clips, random_thresholds
from motionary.pipeline.distances.chosen_zones import chosen_zones, segments_of
from motionary.pipeline.distances.explain import explain_pair, feature_parts
from tests.distances import naive
from tests.distances.strategies import SEEDS, clip_lists, frame_pairs

DISTANCES = ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high")
PARTS = ("pelvis", "head", "left_toe", "travel")


def parts_of(columns, seed=0):
    return np.random.default_rng(seed).choice(PARTS, size=columns).tolist()


@st.composite
def noisy_pairs(draw, longest=26):
    """Two clips of noise in few dimensions: many zones, and no two paths of one cost."""
    rng = np.random.default_rng(draw(SEEDS))
    m, n, d = draw(st.integers(1, longest)), draw(st.integers(1, longest)), draw(st.integers(2, 4))
    steps = draw(st.sampled_from([0.0, 0.3, 1.0]))
    walk = (np.cumsum(rng.normal(size=(frames, d)), axis=0) * steps for frames in (m, n))
    return tuple(one + rng.normal(size=one.shape) for one in walk)


@settings(max_examples=80, deadline=None)
@given(
    st.one_of(frame_pairs(), noisy_pairs(), clip_lists(longest=12).map(lambda one: (one[0], one[-1]))), SEEDS
)
def test_contributions_add_up_to_every_distance(clips, seed):
    a, b = clips
    explained = explain_pair(a, b, parts_of(a.shape[1], seed))
    greatest = explained.thresholds[-1].limit  # at lambda = 1 no cost is above it
    assert set(explained.contributions) == set(DISTANCES) == set(explained.distances)
    for name in DISTANCES:
        added = explained.contributions[name]
        assert (added >= 0).all()
        assert added.sum() == pytest.approx(explained.distances[name], rel=1e-9, abs=1e-9 * greatest)
    for point in explained.thresholds:
        assert point.contributions.sum() == pytest.approx(point.distance, rel=1e-9, abs=1e-9 * greatest)


def with_an_outlier(clips):
    """Add a cost so great that all others are a few quanta, and what is cheapest in quanta may not be so."""
    return np.vstack([clips[0], np.full((1, clips[0].shape[1]), 5e14)]), clips[1]


@settings(max_examples=80, deadline=None)
@given(
    st.one_of(frame_pairs(), noisy_pairs(), noisy_pairs().map(with_an_outlier)), st.one_of(st.none(), SEEDS)
)
def test_distances_are_those_of_the_kernels_bit_for_bit(clips, seed):
    a, b = clips
    lambdas = naive.THRESHOLDS if seed is None else random_thresholds(seed)
    explained = explain_pair(a, b, parts_of(a.shape[1]), lambdas)
    kernels = compare_clips([a], [b], lambdas)
    assert [point.distance for point in explained.thresholds] == kernels.curve[0, 0].tolist()
    assert explained.distances == {name: getattr(kernels, name)[0, 0] for name in DISTANCES}


@settings(max_examples=40, deadline=None)
@given(noisy_pairs(longest=16))
def test_zones_cover_paths_and_parts_are_those_of_the_definition(clips):
    a, b = clips
    parts = parts_of(a.shape[1])
    explained = explain_pair(a, b, parts)
    cost = naive.euclidean(a, b)
    assert explained.forward.cells.tolist() == [list(cell) for cell in naive.dtw_path(cost)]
    assert_parts(
        explained.parts, explained.contributions["dtw"], naive_parts(a, b, parts, naive.dtw_path(cost))
    )
    for point in explained.thresholds:
        edges = naive.segment_edges(cost, point.threshold)
        assert [zone.rectangle for zone in point.zones] == naive.zones(cost, point.threshold)
        assert [zone.row_segment for zone in point.zones] == numbered([z.rectangle[:2] for z in point.zones])
        assert [zone.column_segment for zone in point.zones] == numbered(
            [z.rectangle[2:] for z in point.zones]
        )
        chosen = [zone for zone in point.zones if zone.chosen]
        assert {zone.row_segment for zone in chosen} == set(range(len(point.row_segments)))
        assert {zone.column_segment for zone in chosen} == set(range(len(point.column_segments)))
        assert naive.segment_dtw(cost, point.threshold) == pytest.approx(
            sum(weight for (_, _, weight), zone in zip(edges, point.zones, strict=True) if zone.chosen)
        )
        added = defaultdict(float)
        for zone in chosen:
            path, backward = cheaper_way(cost, zone.rectangle)
            assert (zone.path.cells.tolist(), zone.path.backward) == ([list(cell) for cell in path], backward)
            for part, value in naive_parts(a, b, parts, path).items():
                added[part] += value
        assert_parts(explained.parts, point.contributions, added)


def numbered(intervals):
    """Segment of every interval, numbered from 0 in the order in which they begin."""
    groups = naive.segments(intervals)
    starts = [min(one[0] for one, other in zip(intervals, groups, strict=True) if other == g) for g in groups]
    return [sorted(set(starts)).index(start) for start in starts]


def naive_parts(a, b, parts, path):
    """Squared difference over the cost, averaged along the path, by loops."""
    added = defaultdict(float)
    for i, j in path:
        cost = float(naive.distance(a[i], b[j]))
        for k, part in enumerate(parts):
            added[part] += float(a[i][k] - b[j][k]) ** 2 / cost / len(path) if cost else 0.0
    return added


def cheaper_way(cost, rectangle):
    top, bottom, left, right = rectangle
    inside = cost[top : bottom + 1, left : right + 1]
    backward = naive.dtw(inside[:, ::-1]) < naive.dtw(inside) - 1e-12  # of one row both are one sum
    path = naive.dtw_path(inside[:, ::-1] if backward else inside)
    return [(top + i, right - j if backward else left + j) for i, j in path], backward


def assert_parts(names, values, expected):
    assert dict(zip(names, values, strict=True)) == pytest.approx(dict(expected), rel=1e-9, abs=1e-12)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 6)), min_size=1, max_size=15))
def test_segments_are_unions_of_intervals_that_share_a_frame(drawn):
    intervals = [(first, first + more) for first, more in drawn]
    segment, segments = segments_of(np.array(intervals))
    assert segment.tolist() == numbered(intervals)
    for number, (first, last) in enumerate(segments.tolist()):
        members = [one for one, of in zip(intervals, segment, strict=True) if of == number]
        assert (first, last) == (min(one[0] for one in members), max(one[1] for one in members))


@settings(max_examples=150, deadline=None)
@given(SEEDS, st.integers(1, 9), st.integers(1, 9), st.sampled_from([0, 1, 3, 1000]))
def test_chosen_zones_are_a_least_cover(seed, rows, columns, most_weight):
    """Multigraphs with many ties, weights of zero, and segments that only one zone touches."""
    rng = np.random.default_rng(seed)
    extra = rng.integers(0, 20)
    row = np.concatenate([np.arange(rows), rng.integers(rows, size=columns + extra)])
    column = np.concatenate(
        [rng.integers(columns, size=rows), np.arange(columns), rng.integers(columns, size=extra)]
    )
    weights = rng.integers(0, most_weight, size=len(row), endpoint=True)
    chosen, total = chosen_zones(row, column, weights)
    edges = list(zip(row.tolist(), column.tolist(), weights.tolist(), strict=True))
    assert total == weights[chosen].sum() == round(naive.cover_by_integer_programme(edges))
    assert set(row[chosen]) == set(range(rows))
    assert set(column[chosen]) == set(range(columns))


def test_a_clip_with_itself_has_nothing_to_explain():
    clip = np.random.default_rng(0).normal(size=(12, 59)).astype(np.float32)
    explained = explain_pair(clip, clip.copy(), feature_parts("pose+travel"))
    assert set(explained.distances.values()) == {0.0}
    assert all((added == 0).all() for added in explained.contributions.values())
    assert explained.forward.cells.tolist() == [[i, i] for i in range(12)]
    assert not explained.cheaper.backward


def test_a_clip_played_backward_is_found_backward():
    clip = np.cumsum(np.random.default_rng(0).normal(size=(12, 59)), axis=0).astype(np.float32)
    explained = explain_pair(clip, clip[::-1], feature_parts("pose+travel"))
    assert explained.cheaper.backward
    assert explained.cheaper.cells.tolist() == [[i, 11 - i] for i in range(12)]
    assert explained.distances["b_dtw"] == 0 < explained.distances["dtw"]


@pytest.mark.parametrize("kind", ["pose+travel", "paper"])
def test_the_joint_that_differs_makes_the_distance(kind):
    parts = feature_parts(kind)
    joints = CANONICAL_JOINTS if kind == "pose+travel" else CANONICAL_JOINTS[1:]
    assert tuple(dict.fromkeys(parts)) == (*joints, *(["travel"] if kind == "pose+travel" else []))
    still = np.zeros((1, len(parts)), dtype=np.float32)
    for part in set(parts):
        columns = np.array(parts) == part
        explained = explain_pair(still, still + 0.5 * columns.astype(np.float32), parts)
        expected = {one: explained.distances["weighted"] if one == part else 0.0 for one in explained.parts}
        assert_parts(explained.parts, explained.contributions["weighted"], expected)
        assert columns.sum() == (2 if part == "travel" else 3)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"column_parts": ["head"] * 3}, "3 column_parts are given for 4 columns"),
        ({"thresholds": [0.5, 1.5]}, "threshold is 1.5"),
        ({"a": np.ones((3, 5))}, "b has 4 dimensions and a has 5"),
        ({"b": np.full((2, 4), np.nan)}, "b holds nan"),
    ],
)
def test_a_mistake_is_named(changed, message):
    given_ = {"a": np.ones((3, 4)), "b": np.ones((2, 4)), "column_parts": ["head"] * 4}
    with pytest.raises(ValueError, match=message):
        explain_pair(**(given_ | changed))
