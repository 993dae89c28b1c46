"""Occurrences of a short motion in takes: against every path looked at, and with and without pruning."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import subsequence
from motionary.pipeline.distances.subsequence import find_occurrences, pack_takes
from tests.distances import naive
from tests.distances.strategies import SEEDS


def paths_from(frame, rows, m, may_stay=True):
    """Every path of `rows` cells that begins at a frame, as lists of frames: on by 1 or 2, or one stay."""
    if rows == 1:
        return [[frame]]
    steps = [(1, True), (2, True)] + ([(0, False)] if may_stay else [])
    return [
        [frame, *rest]
        for step, stay_next in steps
        if frame + step < m
        for rest in paths_from(frame + step, rows - 1, m, stay_next)
    ]


def best_between(cost, left, right):
    """(total, first, last) of the best path between two frames: among equal ones the last to begin."""
    n = len(cost)
    found = [
        (sum(cost[i][j] for i, j in enumerate(path)), path[-1], -path[0])
        for start in range(left, right + 1)
        for path in paths_from(start, n, right + 1)
    ]
    if not found:
        return None
    total = min(one[0] for one in found)
    last = min(one[1] for one in found if one[0] == total)
    return total, max(-one[2] for one in found if one[:2] == (total, last)), last


def occurrences_between(cost, left, right):
    """The best between two frames, and of what lies before and after it."""
    best = best_between(cost, left, right)
    if best is None:
        return []
    _, first, last = best
    return [best, *occurrences_between(cost, left, first - 1), *occurrences_between(cost, last + 1, right)]


def occurrences(query, takes, k):
    found = []
    for number, take in enumerate(takes):
        cost = naive.euclidean(query, take).tolist()
        found += [(t, number, first, last) for t, first, last in occurrences_between(cost, 0, len(take) - 1)]
    return sorted(found)[:k]


def rows(found):
    return list(zip(found.take.tolist(), found.first.tolist(), found.last.tolist(), strict=True))


@st.composite
def searches(draw, longest_query, longest_take, most_takes=4):
    """A query and takes of a few whole numbers, whose totals often tie, or of any numbers.

    These have two dimensions or more: in one, |a - x| + |x - b| is the same for all x between a and b, but
    not once it is rounded.
    """
    rng = np.random.default_rng(draw(SEEDS))
    dimensions = draw(st.integers(2, 4))
    lengths = [draw(st.integers(1, longest_query))]
    lengths += draw(st.lists(st.integers(1, longest_take), min_size=1, max_size=most_takes))
    if draw(st.booleans()):
        high = draw(st.integers(1, 5))
        clips = [rng.integers(0, high, (length, 1)).astype(np.float32) for length in lengths]
    else:
        clips = [
            rng.normal(0, 0.3, (length, dimensions)).cumsum(axis=0).astype(np.float32) for length in lengths
        ]
    return clips[0], clips[1:]


@settings(max_examples=150, deadline=None)
@given(searches(longest_query=5, longest_take=9), st.integers(1, 6), st.booleans())
def test_finds_what_looking_at_every_path_finds(search, k, prune):
    query, takes = search
    expected = occurrences(query, takes, k)
    found = find_occurrences(query, pack_takes(takes), k, prune=prune)
    assert rows(found) == [one[1:] for one in expected]
    assert found.distance == pytest.approx([one[0] / len(query) for one in expected], rel=1e-5, abs=1e-6)


@settings(max_examples=150, deadline=None)
@given(searches(longest_query=8, longest_take=40, most_takes=12), st.integers(1, 5))
def test_pruning_changes_no_bit_of_the_answer(search, k):
    query, takes = search
    packed = pack_takes(takes)
    found, plain = find_occurrences(query, packed, k), find_occurrences(query, packed, k, prune=False)
    assert rows(found) == rows(plain)
    assert found.distance.tobytes() == plain.distance.tobytes()
    assert found.searched + found.pruned + found.too_short == len(takes)
    assert (plain.pruned, plain.too_short) == (0, found.too_short)


@settings(max_examples=100, deadline=None)
@given(searches(longest_query=8, longest_take=40), st.integers(1, 20))
def test_occurrences_share_no_frame_and_last_from_half_to_twice_the_query(search, k):
    query, takes = search
    found = find_occurrences(query, pack_takes(takes), k)
    taken = [(take, frame) for take, first, last in rows(found) for frame in range(first, last + 1)]
    assert len(taken) == len(set(taken))
    lengths = found.last - found.first + 1
    assert (2 * lengths >= len(query)).all()
    assert (lengths < 2 * len(query)).all()
    assert (np.diff(found.distance) >= 0).all()


@settings(max_examples=100, deadline=None)
@given(searches(longest_query=8, longest_take=40))
def test_no_occurrence_is_nearer_than_the_bound(search):
    query, takes = search
    packed = pack_takes(takes)
    bounds = subsequence._bounds(query, packed)
    for take in range(len(takes)):
        found = find_occurrences(query, packed, 1, among=[take], prune=False)
        assert len(found.take) == 0 or found.distance[0] * len(query) >= bounds[take]


def wandering(frames, seed, dimensions=6):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(frames, dimensions)).cumsum(axis=0).astype(np.float32)


def test_finds_the_motion_slower_and_quicker_where_it_was_put():
    query = wandering(20, seed=1)
    slower = np.repeat(query, np.where(np.arange(20) % 2, 2, 1), axis=0)  # 30 frames
    quicker = query[::2]
    noise = [wandering(50, seed=seed) + 40 for seed in (2, 3, 4)]
    take = np.concatenate([noise[0], slower, noise[1], quicker, noise[2], query])
    found = find_occurrences(query, pack_takes([noise[0], take]), 3)
    assert found.take.tolist() == [1, 1, 1]
    spans = {(first, last): near for (_, first, last), near in zip(rows(found), found.distance, strict=True)}
    assert spans[190, 209] == 0  # as it is
    assert {(first, last) for first, last in spans} >= {(130, 139)}
    (slow,) = set(spans) - {(190, 209), (130, 139)}
    # The last frame shown twice needs showing once.
    assert slow in {(50, 78), (50, 79)}
    assert spans[slow] == 0


def test_many_frames_are_not_shown_by_one():
    """The rival, DTW with both ends open, shows a gesture by one still frame of its middle."""
    height = np.array([0, 1, 2, 3, 4, 3, 2, 1, 0], dtype=np.float32)
    gesture = np.stack([height, 0 * height], axis=1)
    still, far = gesture[2:3], np.full((6, 2), 50, np.float32)
    take = np.concatenate([far, still, far, gesture + np.float32([0, 1.5]), far])
    cost = naive.euclidean(gesture, take)
    windows = [(first, last) for first in range(len(take)) for last in range(first, len(take))]
    averages = {(first, last): naive.dtw(cost[:, first : last + 1]) for first, last in windows}
    assert min(averages, key=averages.get) == (6, 6)
    found = find_occurrences(gesture, pack_takes([take]), 1)
    assert rows(found) == [(0, 13, 21)]
    assert found.distance == 1.5


def test_takes_that_are_far_away_are_not_searched():
    query = wandering(10, seed=1)
    takes = [wandering(60, seed=1 + place) + 1000 * place for place in range(8)]
    found = find_occurrences(query, pack_takes([*takes, query[:4]]), 1)
    assert (found.searched, found.pruned, found.too_short) == (1, 7, 1)
    assert rows(found) == [(0, 0, 9)]


def test_only_the_takes_named_are_searched():
    query, take = wandering(10, seed=1), wandering(60, seed=2)
    packed = pack_takes([query, take, query])
    assert rows(find_occurrences(query, packed, 5, among=[2])) == [(2, 0, 9)]
    assert set(find_occurrences(query, packed, 5, among=[1]).take) == {1}
    none = find_occurrences(query, packed, 5, among=[])
    assert rows(none) == []
    assert (none.searched, none.pruned, none.too_short) == (0, 0, 0)


def test_says_what_is_wrong():
    packed = pack_takes([wandering(10, seed=1)])
    with pytest.raises(ValueError, match="k is 0; ask for at least one"):
        find_occurrences(wandering(3, seed=1), packed, 0)
    with pytest.raises(ValueError, match="the query has 2 dimensions and the takes have 6"):
        find_occurrences(wandering(3, seed=1, dimensions=2), packed, 1)
    with pytest.raises(ValueError, match="query holds nan at frame 1"):
        find_occurrences([[0.0] * 6, [np.nan] * 6], packed, 1)
    with pytest.raises(ValueError, match="query has shape"):
        find_occurrences(np.zeros((0, 6)), packed, 1)
    with pytest.raises(ValueError, match=r"takes\[1\] has 2 dimensions"):
        pack_takes([wandering(3, seed=1), wandering(3, seed=1, dimensions=2)])
    with pytest.raises(ValueError, match="no take to search"):
        pack_takes([])
