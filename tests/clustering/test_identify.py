"""Clusters keep their numbers: as many clips as can be stay in a cluster of the same number."""

import tracemalloc
from itertools import permutations

import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.pipeline.stages.identify import identify
from motionary.pipeline.tables import TABLES

NOTHING = TABLES["members"].empty_table()


def groups_of(group_of: dict[str, int]) -> pa.Table:
    rows = [{"clip_id": one, "group": group} for one, group in sorted(group_of.items())]
    return pa.Table.from_pylist(rows, TABLES["groups"])


def chain(*states: dict[str, int]) -> list[dict[str, pa.Table]]:
    """Number the groups of one run after the other."""
    made = {"members": NOTHING, "lineage": TABLES["lineage"].empty_table()}
    found = []
    for number, state in enumerate(states):
        names = {one: one for one in made["members"]["clip_id"].to_pylist() if one in state}
        made = identify(groups_of(state), made["members"], made["lineage"], names, f"{number:06d}")
        found.append(made)
    return found


def clusters(made: dict[str, pa.Table]) -> dict[str, int]:
    return dict(zip(*(made["members"][name].to_pylist() for name in ("clip_id", "cluster_id")), strict=True))


def events(made: dict[str, pa.Table], after: int) -> list[tuple]:
    """What became of the clusters in the last run: event, cluster, previous, clips."""
    rows = made["lineage"].to_pylist()
    return [
        (row["event"], row["cluster_id"], row["previous_id"], row["clips"])
        for row in rows
        if row["after"] == f"{after:06d}"
    ]


def test_first_numbers_follow_the_groups():
    (made,) = chain({"a": 0, "b": 0, "c": 1})
    assert clusters(made) == {"a": 1, "b": 1, "c": 2}
    assert events(made, 0) == [("new", 1, None, 2), ("new", 2, None, 1)]


def test_the_order_of_the_groups_says_nothing():
    _, made = chain({"a": 0, "b": 0, "c": 1}, {"a": 1, "b": 1, "c": 0})
    assert clusters(made) == {"a": 1, "b": 1, "c": 2}
    assert events(made, 1) == [("kept", 1, 1, 2), ("kept", 2, 2, 1)]


def test_thousands_of_clusters_are_not_laid_out_as_a_square():
    state = {f"{clip:05d}": clip // 2 for clip in range(10_000)}
    before = chain(state)[-1]
    after = {clip: group + (number % 7 == 0) for number, (clip, group) in enumerate(state.items())}
    names = {one: one for one in state}
    tracemalloc.start()
    made = identify(groups_of(after), before["members"], before["lineage"], names, "000001")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * 5_000**2 / 4
    kept = sum(
        one == other
        for one, other in zip(made["members"]["cluster_id"], before["members"]["cluster_id"], strict=True)
    )
    assert kept > 8_000


def test_a_split_keeps_the_number_for_the_larger_part():
    _, made = chain(dict.fromkeys("abcde", 0), {"a": 0, "b": 0, "c": 1, "d": 1, "e": 1})
    assert clusters(made) == {"a": 2, "b": 2, "c": 1, "d": 1, "e": 1}
    assert events(made, 1) == [("kept", 1, 1, 3), ("split", 2, 1, 2)]


def test_a_merger_takes_the_number_of_the_larger_part():
    _, made = chain({"a": 0, "b": 1, "c": 1}, dict.fromkeys("abc", 0))
    assert clusters(made) == {"a": 2, "b": 2, "c": 2}
    assert events(made, 1) == [("merged", 2, 1, 1), ("kept", 2, 2, 2)]


def test_clips_that_move_and_clusters_that_go():
    _, made = chain(
        {"a": 0, "b": 0, "c": 0, "d": 1, "e": 1, "f": 2}, {"a": 0, "b": 0, "c": 1, "d": 1, "e": 1, "g": 2}
    )
    assert clusters(made) == {"a": 1, "b": 1, "c": 2, "d": 2, "e": 2, "g": 4}
    assert events(made, 1) == [
        ("kept", 1, 1, 2),
        ("moved", 2, 1, 1),
        ("kept", 2, 2, 2),
        ("new", 4, None, 1),
        ("gone", None, 3, 0),
    ]


def test_a_number_is_never_given_again():
    *_, made = chain({"a": 0, "b": 1}, {"a": 0}, {"a": 0, "b": 1})
    assert clusters(made) == {"a": 1, "b": 3}


def test_a_renamed_clip_is_the_clip_it_was():
    (before,) = chain({"a": 0, "b": 1})
    made = identify(
        groups_of({"z": 0, "b": 1}), before["members"], before["lineage"], {"z": "a", "b": "b"}, "000001"
    )
    assert clusters(made) == {"z": 1, "b": 2}


def test_no_clips():
    (made,) = chain({})
    assert len(made["members"]) == len(made["lineage"]) == 0
    _, made = chain({"a": 0}, {})
    assert events(made, 1) == [("gone", None, 1, 0)]


STATES = st.dictionaries(st.sampled_from("abcdefgh"), st.integers(0, 3), min_size=1)


@given(STATES, STATES)
def test_no_other_numbering_keeps_more_clips(first, second):
    before, after = chain(first, second)
    then, now = clusters(before), clusters(after)

    def kept(number: dict[int, int]) -> int:
        return sum(number[second[one]] == then[one] for one in first.keys() & second.keys())

    mine = {second[one]: now[one] for one in second}
    candidates = [*set(then.values()), *(-1 - k for k in range(4))]
    best = max(kept(dict(zip(mine, some, strict=True))) for some in permutations(candidates, len(mine)))
    assert kept(mine) == best
    assert len(set(mine.values())) == len(mine)


@given(STATES, STATES)
def test_every_clip_is_accounted_for(first, second):
    _, after = chain(first, second)
    told = events(after, 1)
    stayed = [row for row in told if row[2] is not None and row[1] is not None]
    assert sum(row[3] for row in stayed) == len(first.keys() & second.keys())
    assert {row[2] for row in told if row[2] is not None} == set(clusters(chain(first)[0]).values())


@pytest.mark.parametrize("event", ["kept", "moved", "split", "merged", "new", "gone"])
def test_the_schema_names_every_event(event):
    assert event in TABLES["lineage"].field("event").metadata[b"meaning"].decode()
