"""Snapshots: publishing, time travel, what a manifest may say."""

import json
import os
from dataclasses import asdict, replace

import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.snapshot import (
    current_id,
    current_snapshot,
    manifest_name,
    next_snapshot_id,
    publish,
    read_snapshot,
    snapshot_ids,
)
from motionary.catalog.store import PartFacts, Store


@pytest.fixture(params=["local", "memory"])
def store(request, tmp_path) -> Store:
    return Store(str(tmp_path / "catalog") if request.param == "local" else f"memory://{tmp_path.name}")


def runs_of(*ids: str) -> list[dict]:
    return [{"run_id": f"20260102T03040{n}Z-{one}"} for n, one in enumerate(ids)]


def test_a_snapshot_is_read_as_it_was_published(store, publish_rows):
    whole = replace(
        publish_rows(store, clips=[{"clip_id": "a"}]),
        snapshot_id="000002",
        stages={"ingest": "0123"},
        versions={"motionary": "9"},
    )
    publish(store, whole, after=current_snapshot(store))
    assert current_snapshot(store) == replace(whole, after="000001")
    assert read_snapshot(store, "000001").after is None
    (file,) = whole.tables["clips"]
    assert whole.parts[file].rows == 1
    assert whole.parts[file].bytes == len(store.read_bytes(file))


def test_saving_tells_what_reading_the_file_tells(store, publish_rows):
    publish_rows(store)
    facts = store.save("other", {"pairs": store.load("none", "pairs"), "runs": store.load("none", "runs")})
    assert facts == {name: store.facts(store.part_name(name, "other")) for name in ("pairs", "runs")}
    store.write(store.part_name("pairs", "cut"), store.read_bytes(store.part_name("pairs", "other"))[:-9])
    with pytest.raises(ValueError, match=r"Parquet|footer|magic"):
        store.facts(store.part_name("pairs", "cut"))


def test_it_is_opened_as_it_was(store, publish_rows):
    for n, clips in enumerate(["a", "ab", "abc"], start=1):
        ids = [f"{one:06d}" for one in range(1, n + 1)]
        publish_rows(store, clips=[{"clip_id": one} for one in clips], runs=runs_of(*ids))
    for wanted in (2, "2", "000002", "20260102T030401Z-000002"):
        assert len(Catalog.open(store.url, wanted).clips) == 2
    assert len(Catalog.open(store.url).clips) == 3
    assert Catalog.open(store.url, snapshot=1).sql("select clip_id from clips")["clip_id"].to_pylist() == [
        "a"
    ]
    assert Catalog.open(store.url, 1).snapshots() == ["000001", "000002", "000003"]


@pytest.mark.parametrize(
    "wanted", [9, "9", 0, -1, "", "last", "../000001", "20260102T030405Z-000001", "1e0", "٣", "000001.json"]
)
def test_of_an_unknown_snapshot_it_is_said_what_there_is(store, publish_rows, wanted):
    for _ in range(2):
        publish_rows(store, runs=runs_of("000001"))
    with pytest.raises(CatalogError, match="there is no snapshot .* there are 000001, 000002$"):
        Catalog.open(store.url, wanted)
    with pytest.raises(CatalogError, match="is not a catalog"):
        Catalog.open(store.url + "-not", wanted)


def test_of_many_snapshots_the_last_are_named(store, publish_rows, monkeypatch):
    publish_rows(store)
    manifest = store.read_bytes(manifest_name("000001"))
    for n in range(2, 60):
        store.write(manifest_name(f"{n:06d}"), manifest)
    with pytest.raises(CatalogError, match=r"there are 000001, \.\.\., 000040, .* 000059$"):
        Catalog.open(store.url, 77)


def test_numbers_go_on_past_six_digits(store, publish_rows):
    store.write(manifest_name("999999"), b"left by a run that died")
    assert next_snapshot_id(store) == "1000000"
    publish_rows(store)
    assert next_snapshot_id(store) == "1000001"
    assert snapshot_ids(store) == ["999999", "1000000"]
    assert Catalog.open(store.url, 1000000).snapshot == current_snapshot(store)


@pytest.mark.parametrize("written", ["", "abc", "../000001", "-1", "000001\n000002", "1\x00", "9" * 300])
def test_a_damaged_current_is_one_clear_error(store, publish_rows, written):
    publish_rows(store)
    store.write("CURRENT", written.encode())
    with pytest.raises(CatalogError, match="CURRENT holds .*, not a snapshot's id; write the id of another"):
        Catalog.open(store.url)


def edited(**fields) -> dict:
    return {"snapshot_id": "000001", "created_at": "2026-01-02", "tables": {}, "schema_version": 1} | fields


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"null",
        b"[" * 100_000,
        json.dumps(edited(tables=["clips"])).encode(),
        json.dumps(edited(tables={"clips": 1})).encode(),
        json.dumps(edited(tables={"clips": []})).encode(),
        json.dumps(edited(parts={"a": {"rows": 1}})).encode(),
        json.dumps(edited(another=1)).encode(),
        json.dumps(edited(schema_version="new")).encode(),
        json.dumps(edited(snapshot_id="000002")).encode(),
        json.dumps(edited(snapshot_id=1)).encode(),
        json.dumps(edited(created_at="yesterday")).encode(),
        json.dumps(edited(created_at=20260102)).encode(),
        json.dumps(edited(after="000001")).encode(),
        json.dumps(edited(tables={"clips": ["../secret.parquet"]})).encode(),
        json.dumps(edited(tables={"clips": ["tables/../../secret.parquet"]})).encode(),
        json.dumps(edited(tables={"clips": ["/etc/secret.parquet"]})).encode(),
        json.dumps(edited(tables={"clips": ["tables/clips/*.parquet"]})).encode(),
    ],
)
def test_a_damaged_manifest_is_one_clear_error(store, publish_rows, content):
    publish_rows(store)
    store.write(manifest_name("000001"), content)
    with pytest.raises(CatalogError, match="manifest of snapshot '000001' .* is missing or damaged"):
        Catalog.open(store.url)


def test_the_manifest_that_is_damaged_there_is_whole_otherwise(store, publish_rows):
    publish_rows(store)
    store.write(manifest_name("000001"), json.dumps(edited()).encode())
    assert read_snapshot(store, "000001").tables == {}


def test_a_manifest_of_an_earlier_motionary_is_read(store, publish_rows):
    snapshot = publish_rows(store, clips=[{"clip_id": "a"}])
    known = {
        name: asdict(snapshot)[name] for name in ("snapshot_id", "created_at", "tables", "schema_version")
    }
    store.write(manifest_name("000001"), json.dumps(known).encode())
    catalog = Catalog.open(store.url)
    assert len(catalog.clips) == 1
    assert catalog.snapshot.parts == {}


def test_the_views_are_the_published_tables(store, publish_rows):
    publish_rows(store)
    members = store.load("none", "runs")
    store.save("none", {"runs": members})
    snapshot = current_snapshot(store)
    inner = {"members": snapshot.tables["clips"], **snapshot.tables}
    catalog = Catalog(store, replace(snapshot, tables={k: v for k, v in inner.items() if k != "styles"}))
    shown = catalog.sql("select view_name from duckdb_views() where not internal")["view_name"].to_pylist()
    assert set(shown) == set(snapshot.tables) - {"styles"} | {"takes"}


def test_who_comes_second_publishes_nothing(store, publish_rows):
    first = publish_rows(store)
    publish_rows(store)
    files = store.sizes("")
    for after in (first, None):
        with pytest.raises(CatalogError, match="another run has published snapshot 000002 .* run it again"):
            publish(store, replace(first, snapshot_id="000003"), after=after)
    assert (store.sizes(""), current_id(store)) == (files, "000002")


def test_a_manifest_is_never_written_over(store, publish_rows):
    first = publish_rows(store)
    with pytest.raises(CatalogError, match="another run has published snapshots/000001.json"):
        publish(store, replace(first, created_at="later"), after=first)
    assert current_snapshot(store) == first


def test_the_same_facts_mean_the_same_bytes():
    assert PartFacts(1, 2, "ab") == PartFacts(1, 2, "ab") != PartFacts(1, 2, "ac")


def test_a_new_folder_is_made_to_last(tmp_path, monkeypatch):
    synced = []
    usual = os.fsync
    opened = {}
    usual_open = os.open

    def remember(path, *arguments, **options):
        descriptor = usual_open(path, *arguments, **options)
        opened[descriptor] = str(path)
        return descriptor

    monkeypatch.setattr(os, "open", remember)
    monkeypatch.setattr(os, "fsync", lambda one: (synced.append(opened.get(one)), usual(one)))
    Store(str(tmp_path / "new")).write("tables/pairs/x.parquet", b"")
    for folder in ("", "new", "new/tables", "new/tables/pairs"):
        assert str(tmp_path / folder).rstrip("/") in synced


def test_the_commands_show_an_earlier_snapshot(tmp_path, publish_rows, motionary):
    store = Store(str(tmp_path / "catalog"))
    for clips in ("a", "ab"):
        publish_rows(store, clips=[{"clip_id": one} for one in clips], runs=runs_of("000001"))
    query = ["query", store.url, "select count(*) n from clips", "--format", "json"]
    assert json.loads(motionary(*query)[1]) == [{"n": 2}]
    assert json.loads(motionary(*query, "--snapshot", 1)[1]) == [{"n": 1}]
    code, _, err = motionary(*query, "--snapshot", 3)
    assert code == 1
    assert "there is no snapshot '3'" in err
    assert motionary("status", store.url, "--snapshot", 7)[0] == 1
