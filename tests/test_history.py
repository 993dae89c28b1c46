"""What changed from one run to another, and which runs there were."""

import json

import pytest

from motionary.catalog import Catalog
from motionary.catalog.history import diff, run_history
from motionary.catalog.snapshot import manifest_name
from motionary.catalog.store import Store

Rows = dict[str, tuple[str, int, str | None]]

BEFORE: Rows = {  # clip: digest, cluster, label
    "a": ("1", 1, "walk"),
    "b": ("2", 1, "walk"),
    "c": ("3", 1, "walk"),
    "d": ("4", 2, "run"),
    "e": ("5", 2, "run"),
    "f": ("6", 2, None),
}


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(str(tmp_path / "catalog"))


@pytest.fixture
def changes(store, publish_rows):
    """Publish two states and tell their difference, as lists of rows by name."""

    def tell(before: Rows, after: Rows, *references: dict[int, str]) -> dict[str, list[tuple]]:
        for rows, chosen in zip((before, after), references or ({}, {}), strict=True):
            publish_rows(
                store,
                clips=[{"clip_id": clip, "digest": row[0]} for clip, row in rows.items()],
                clusters=[
                    {"clip_id": clip, "cluster_id": row[1], "label": row[2], "label_source": "supplied"}
                    for clip, row in rows.items()
                ],
                references=[{"cluster_id": one, "clip_id": clip} for one, clip in chosen.items()],
            )
        found = diff(Catalog.open(store.url, 1), Catalog.open(store.url, 2))
        tables = {name: table.to_pylist() for name, table in vars(found).items()}
        return {name: [tuple(row.values()) for row in rows] for name, rows in tables.items() if rows}

    return tell


def test_nothing_changed(changes):
    assert changes(BEFORE, dict(reversed(BEFORE.items())), {1: "a"}, {1: "a"}) == {}


def test_clips_that_come_go_and_change(changes):
    after = {**BEFORE, "g": ("7", 2, "run"), "b": ("22", 1, "walk")}
    del after["a"]
    assert changes(BEFORE, after) == {
        "added": [("g", "7")],
        "removed": [("a", "1")],
        "changed": [("b", "2", "22")],
    }


def test_a_renamed_clip_is_the_same_clip(changes):
    after = {("new/a" if clip == "a" else clip): row for clip, row in BEFORE.items()}
    assert changes(BEFORE, after, {1: "a"}, {1: "new/a"}) == {"renamed": [("new/a", "a", "1")]}


def test_a_renamed_clip_may_move_too(changes):
    after = {**BEFORE, "z": ("1", 2, "run")}
    del after["a"]
    assert changes(BEFORE, after) == {
        "renamed": [("z", "a", "1")],
        "moved": [("z", 1, 2)],
        "relabelled": [("z", "walk", "run", "supplied")],
    }


def test_copies_are_added_and_not_renamed(changes):
    assert changes(BEFORE, {**BEFORE, "copy": ("1", 1, "walk")}) == {"added": [("copy", "1")]}


def test_of_equal_clips_each_is_renamed_once(changes):
    before: Rows = {"x1": ("9", 1, None), "x2": ("9", 1, None), "x3": ("9", 1, None)}
    after: Rows = {"y1": ("9", 1, None), "y2": ("9", 1, None)}
    assert changes(before, after) == {
        "renamed": [("y1", "x1", "9"), ("y2", "x2", "9")],
        "removed": [("x3", "9")],
    }


def test_moves_labels_and_references(changes):
    after = {**BEFORE, "c": ("3", 2, "walk"), "f": ("6", 2, "run"), "d": ("4", 2, None)}
    assert changes(BEFORE, after, {1: "a", 2: "d", 3: "f"}, {1: "b", 2: "d", 4: "e"}) == {
        "moved": [("c", 1, 2)],
        "relabelled": [("d", "run", None, "supplied"), ("f", None, "run", "supplied")],
        "references": [(1, "a", "b")],
    }


def test_from_later_to_earlier_it_is_the_other_way_round(changes, store):
    changes(BEFORE, {**BEFORE, "g": ("7", 2, "run")})
    back = diff(Catalog.open(store.url, 2), Catalog.open(store.url, 1))
    assert (back.removed["clip_id"].to_pylist(), len(back.added)) == (["g"], 0)


def test_the_diff_command(changes, store, motionary):
    changes(BEFORE, {**BEFORE, "g": ("7", 2, "run"), "c": ("3", 2, "run")}, {1: "a"}, {1: "b"})
    code, out, err = motionary("diff", store.url, 1, 2, "--format", "json")
    assert code == 0
    assert json.loads(out) == [
        {"change": change, "clip_id": clip, "cluster_id": cluster, "before": before, "after": after}
        for change, clip, cluster, before, after in [
            ("added", "g", None, None, None),
            ("moved", "c", 2, "1", "2"),
            ("relabelled", "c", None, "walk", "run"),
            ("reference", "b", 1, "a", "b"),
        ]
    ]
    assert "000001 to 000002: 1 added, 0 removed, 0 renamed, 0 changed, 1 moved, 1 relabelled" in err
    code, _, err = motionary("diff", store.url, 1, 3)
    assert code == 1
    assert "there is no snapshot '3'" in err


def test_the_runs_command(store, publish_rows, motionary):
    ids = ["20260102T030405Z-000001", "20260102T030406Z-000002"]
    settings = ['{"distances": {}}', '{"distances": {"pairs": "landmarks"}}']
    made = [
        {"run_id": one, "version": "9", "settings": said} for one, said in zip(ids, settings, strict=True)
    ]
    for n in (1, 2):
        publish_rows(store, runs=made[:n])
    history = run_history(Catalog.open(store.url)).to_pylist()
    assert [(row["run_id"], row["snapshot"], row["kept"], row["pairs"]) for row in history] == [
        (ids[0], "000001", True, "all"),  # a run of before there were other routes
        (ids[1], "000002", True, "landmarks"),
    ]
    store.delete(manifest_name("000001"))
    code, out, _ = motionary("runs", store.url, "--format", "json")
    assert code == 0
    assert [row["kept"] for row in json.loads(out)] == [False, True]
    assert {"run_id", "snapshot", "clips", "quarantined", "version"} <= set(json.loads(out)[0])
