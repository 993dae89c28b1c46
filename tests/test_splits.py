"""A split parts no group, and comes as near to its shares as whole groups allow."""

import random
from collections import Counter
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.catalog import CatalogError
from motionary.catalog.splits import parts_of, read_shares
from motionary.catalog.subset_sum import nearest_counts

SHARES = (
    {"train": 0.8, "test": 0.2},
    {"train": 0.5, "test": 0.5},
    {"train": 0.8, "val": 0.1, "test": 0.1},
    {"train": 0.6, "val": 0.25, "test": 0.15},
    {"a": 0.25, "b": 0.25, "c": 0.25, "d": 0.25},
)

shares = st.sampled_from(SHARES)
few_sizes = st.lists(st.integers(1, 40), min_size=4, max_size=10)


def clips_of(sizes: list[int]) -> list[str]:
    return [f"subject {number}" for number, size in enumerate(sizes) for _ in range(size)]


def best_distance(sizes: list[int], target: float, spare: int) -> float:
    """Try every choice of groups that leaves `spare` of them."""
    choices = (one for count in range(1, len(sizes) - spare + 1) for one in combinations(sizes, count))
    return min(abs(sum(one) - target) for one in choices)


@given(st.lists(st.integers(0, 30), min_size=12, max_size=200), shares, st.integers(0, 3))
def test_no_group_is_parted_and_no_part_is_empty(numbers, shares, seed):
    groups = [f"g{number}" for number in numbers]
    if len(set(groups)) < len(shares):
        with pytest.raises(CatalogError, match="too few for"):
            parts_of(groups, shares, seed)
        return
    parts = parts_of(groups, shares, seed)
    assert len(set(zip(groups, parts, strict=True))) == len(set(groups))
    assert set(parts) == set(shares)


@settings(deadline=None)
@given(few_sizes, shares, st.integers(0, 3))
def test_every_part_is_as_near_as_the_groups_that_are_left_allow(sizes, shares, seed):
    groups = clips_of(sizes)
    parts = parts_of(groups, shares, seed)
    part_of = dict(zip(groups, parts, strict=True))
    left = dict(Counter(groups))
    ordered = sorted(shares, key=lambda name: (shares[name], name))
    for after, name in zip(range(len(ordered) - 1, 0, -1), ordered, strict=False):
        target = shares[name] * len(groups)
        best = best_distance(list(left.values()), target, after)
        assert abs(parts.count(name) - target) == pytest.approx(best, abs=1e-9)
        left = {group: size for group, size in left.items() if part_of[group] != name}


@given(st.integers(20, 400), shares)
def test_clips_of_their_own_fill_the_shares_to_the_clip(count, shares):
    counts = Counter(parts_of([str(number) for number in range(count)], shares))
    for name, share in shares.items():
        assert abs(counts[name] - share * count) < len(shares)


@given(few_sizes, shares, st.randoms(use_true_random=False))
def test_the_order_of_clips_and_of_parts_changes_nothing(sizes, shares, shuffler):
    groups = clips_of(sizes)
    expected = set(zip(groups, parts_of(groups, shares), strict=True))
    shuffler.shuffle(groups)
    backwards = dict(reversed(shares.items()))
    assert set(zip(groups, parts_of(groups, backwards), strict=True)) == expected


@given(st.integers(30, 300), st.integers(1, 10), shares)
def test_clips_that_are_added_move_few_others(count, added, shares):
    before = parts_of([str(number) for number in range(count)], shares)
    after = parts_of([str(number) for number in range(count + added)], shares)
    moved = sum(one != other for one, other in zip(before, after, strict=False))
    assert moved <= (added + 1) * (len(shares) - 1)


def test_clips_that_are_added_to_recordings_of_many_sizes_move_few_others():
    draw = random.Random(4)
    sizes = [draw.choice((1, 1, 2, 3, 5)) for _ in range(400)]
    groups = clips_of(sizes)
    before = dict(zip(groups, parts_of(groups, SHARES[2]), strict=True))
    grown = clips_of([size + (number % 40 == 0) for number, size in enumerate([*sizes, 1, 2, 3])])
    after = dict(zip(grown, parts_of(grown, SHARES[2]), strict=True))
    assert sum(before[group] != after[group] for group in before) <= 8


@settings(deadline=None)
@given(
    st.dictionaries(
        st.integers(1, 6), st.tuples(st.integers(1, 80), st.integers(0, 80)), min_size=1, max_size=4
    ),
    st.floats(0, 1),
)
def test_numbers_of_each_size_are_the_nearest_and_the_best_liked(sizes, share):
    """Against every number of every size: the kernel tries only those near the liked ones."""
    available = {size: count + 1 for size, (count, _) in sizes.items()}
    liked = {size: min(like, available[size]) for size, (_, like) in sizes.items()}
    total = sum(size * count for size, count in available.items())
    target = share * total
    least: dict[int, int] = {0: 0}
    for size, count in available.items():
        found: dict[int, int] = {}
        for clips, cost in least.items():
            for take in range(count + 1):
                at, more = clips + size * take, cost + size * abs(take - liked[size])
                found[at] = min(found.get(at, more), more)
        least = found
    possible = {clips: cost for clips, cost in least.items() if 0 < clips < total}
    best = min((abs(clips - target), cost) for clips, cost in possible.items())
    counts = nearest_counts(available, liked, target, spare=1)
    assert all(0 <= counts[size] <= available[size] for size in available)
    clips = sum(size * count for size, count in counts.items())
    cost = sum(size * abs(counts[size] - liked[size]) for size in available)
    assert (abs(clips - target), cost) == best


def test_a_seed_gives_its_own_split():
    groups = [str(number) for number in range(100)]
    assert parts_of(groups, SHARES[0], 1) == parts_of(groups, SHARES[0], 1)
    assert parts_of(groups, SHARES[0], 1) != parts_of(groups, SHARES[0], 2)


def test_three_groups_of_which_one_is_large_still_make_three_parts():
    parts = parts_of(clips_of([1, 1, 98]), SHARES[2])
    assert sorted(Counter(parts).values()) == [1, 1, 98]
    assert parts[-1] == "train"


def test_shares_as_people_write_them():
    assert read_shares("train=.8, test = .2") == {"train": 0.8, "test": 0.2}
    assert list(read_shares("b=.5,a=.25,c=.25")) == ["b", "a", "c"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "'' is not NAME=SHARE"),
        ("train", "'train' is not NAME=SHARE"),
        ("train=most,test=.2", "'train=most' is not"),
        ("train=.8,train=.2", "names 'train' twice"),
        ("train=.8,Train=.2", "two parts that differ"),
        ("train=.999", "two parts"),
        ("train=1,test=0", "share 1; it must be between 0 and 1"),
        ("train=nan,test=.2", "share nan"),
        ("train=.8,test=.1", "add up to 0.9 instead of 1"),
        ("../up=.8,test=.2", "'../up' of the split is to be a folder"),
        ("=.8,test=.2", "'' of the split is to be a folder"),
    ],
)
def test_shares_that_are_none(text, message):
    with pytest.raises(CatalogError, match=message):
        read_shares(text)
