"""Stores, snapshots and queries."""

import os
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.schema import PUBLISHED, SCHEMAS, VERSION, conform
from motionary.catalog.snapshot import Snapshot, current_snapshot, next_snapshot_id, publish
from motionary.catalog.store import Store
from motionary.pipeline.readers import read_motion

MEMBERS = pa.table({"clip_id": ["a"], "cluster_id": pa.array([1], pa.int32())})


@pytest.fixture(params=["local", "memory"])
def store(request, tmp_path) -> Store:
    return Store(str(tmp_path) if request.param == "local" else f"memory://{tmp_path.name}")


def empty_snapshot(store: Store, snapshot_id: str = "000001") -> Snapshot:
    facts = store.save("none", {name: SCHEMAS[name].empty_table() for name in PUBLISHED})
    files = {name: [store.part_name(name, "none")] for name in PUBLISHED}
    parts = {files[name][0]: facts[name] for name in PUBLISHED}
    return Snapshot(snapshot_id, "2020-01-01T00:00:00+00:00", files, parts)


def test_parts_come_back_with_types_units_and_version(store):
    store.save("k", {"members": MEMBERS})
    back = store.load("k", "members")
    assert back.to_pylist() == MEMBERS.to_pylist()
    assert back.schema.field("cluster_id").type == pa.int32()
    assert back.schema.metadata[b"motionary.schema_version"] == str(VERSION).encode()
    assert store.stored("k", ["members"])
    assert store.stored("k", ["members", "clips"]) is None


def test_equal_tables_are_equal_files(store):
    store.save("one", {"members": MEMBERS})
    store.save("two", {"members": MEMBERS})
    one, two = (store.read_bytes(store.part_name("members", key)) for key in ("one", "two"))
    assert one == two


@pytest.mark.parametrize("name", [name for name in SCHEMAS if name != "members"])
def test_every_column_has_a_meaning(name):
    for field in SCHEMAS[name]:
        assert field.metadata[b"meaning"], field.name


def test_a_table_must_fit_its_schema():
    with pytest.raises(ValueError, match=r"'members': missing columns \['cluster_id'\].*\['colour'\]"):
        conform("members", pa.table({"clip_id": ["a"], "colour": ["red"]}))
    clips = SCHEMAS["clips"].empty_table().append_column("mood", pa.array([], pa.string()))
    assert "mood" in conform("clips", clips).column_names


def test_publishing_and_opening(store):
    assert current_snapshot(store) is None
    assert next_snapshot_id(store) == "000001"
    publish(store, empty_snapshot(store), after=None)
    catalog = Catalog.open(store.url)
    assert len(catalog.clips) == 0
    assert catalog.sql("select count(*) n from pairs")["n"].to_pylist() == [0]
    assert next_snapshot_id(store) == "000002"


def test_a_snapshot_names_every_table_and_only_files_that_exist(store):
    whole = empty_snapshot(store)
    without = {name: files for name, files in whole.tables.items() if name != "pairs"}
    with pytest.raises(ValueError, match="lacks the tables pairs"):
        publish(store, replace(whole, tables=without), after=None)
    gone = {**whole.tables, "clips": ["tables/clips/gone.parquet"]}
    with pytest.raises(ValueError, match="are not there: tables/clips/gone.parquet"):
        publish(store, replace(whole, tables=gone), after=None)
    (file,) = whole.tables["clips"]
    unknown = {name: facts for name, facts in whole.parts.items() if name != file}
    with pytest.raises(ValueError, match=f"has no facts of {file}"):
        publish(store, replace(whole, parts=unknown), after=None)
    assert current_snapshot(store) is None


def test_a_crash_between_manifest_and_current_leaves_the_old_snapshot(tmp_path, monkeypatch):
    store = Store(str(tmp_path))
    first = empty_snapshot(store)
    publish(store, first, after=None)
    usual = Store.write

    def crash(self, name, content):
        if name == "CURRENT":
            raise OSError("power cut")
        usual(self, name, content)

    monkeypatch.setattr(Store, "write", crash)
    with pytest.raises(OSError, match="power cut"):
        publish(store, empty_snapshot(store, "000002"), after=first)
    assert current_snapshot(store).snapshot_id == "000001"


def test_a_file_appears_whole_or_not_at_all(tmp_path, monkeypatch):
    store = Store(str(tmp_path))
    store.write("name", b"old")

    def crash(_):
        raise OSError("power cut")

    monkeypatch.setattr(os, "fsync", crash)
    with pytest.raises(OSError, match="power cut"):
        store.write("name", b"new and longer")
    assert store.read_bytes("name") == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["name"]


def test_a_later_schema_is_refused(tmp_path):
    store = Store(str(tmp_path))
    snapshot = empty_snapshot(store)
    publish(store, replace(snapshot, schema_version=VERSION + 1), after=None)
    with pytest.raises(CatalogError, match=f"schema version {VERSION + 1}.*install a newer"):
        Catalog.open(str(tmp_path))


def test_no_catalog(tmp_path):
    with pytest.raises(CatalogError, match="is not a catalog; make one with: motionary run"):
        Catalog.open(str(tmp_path / "nothing"))


def test_tables_as_arrow_and_pandas(demo_catalog):
    clips = Catalog.open(demo_catalog).clips
    assert clips.to_arrow().num_rows == len(clips.to_pandas()) == len(clips) > 0
    assert clips.to_arrow().schema.field("seconds").metadata[b"unit"] == b"s"
    assert repr(clips).startswith(f"<clips: {len(clips)} rows, clip_id, path")


def test_sql_with_parameters(demo_catalog):
    catalog = Catalog.open(demo_catalog)
    count = "select count(*) n from clips where action = ?"
    walks = catalog.sql(count, ["walk"])["n"][0].as_py()
    assert walks > 0
    named = catalog.sql(count.replace("?", "$action"), {"action": "walk"})
    assert named["n"][0].as_py() == walks
    assert catalog.sql(count, ["walk' or 'a' = 'a"])["n"].to_pylist() == [0]


@pytest.mark.parametrize("query", ["selec 1", "select nothing from clips", "select * from nowhere", ""])
def test_a_bad_query_is_one_clear_error(demo_catalog, query):
    with pytest.raises(CatalogError):
        Catalog.open(demo_catalog).sql(query)


def test_a_motion_comes_back_as_it_was_read(demo_catalog, demo_library):
    catalog = Catalog.open(demo_catalog)
    clip_id = catalog.clips.to_arrow()["clip_id"][5].as_py()
    here, there = catalog.motion(clip_id), read_motion(demo_library / clip_id)
    assert here.skeleton == there.skeleton
    assert (here.fps, here.frames) == (there.fps, there.frames)
    size = np.ptp(there.positions(), axis=(0, 1)).max()
    assert np.abs(here.positions() - there.positions()).max() < 1e-5 * size


def test_an_aligned_motion_has_the_references_length(demo_catalog):
    catalog = Catalog.open(demo_catalog)
    row = catalog.sql(
        """select c.clip_id, r.frames from clusters c
           join "references" r using (cluster_id) where not is_reference"""
    ).to_pylist()[0]
    aligned = catalog.aligned(row["clip_id"])
    assert (aligned.frames, aligned.fps) == (row["frames"], 30.0)


def test_an_unknown_clip_is_told_the_nearest(demo_catalog):
    clip_id = Catalog.open(demo_catalog).clips.to_arrow()["clip_id"][0].as_py()
    with pytest.raises(CatalogError, match=f"no clip .*did you mean .*{clip_id}"):
        Catalog.open(demo_catalog).motion(clip_id.replace(".bvh", ".bhv"))


@pytest.mark.parametrize(
    "query",
    [
        "select * from read_csv('{outside}')",
        "select * from read_text('{outside}')",
        "select * from glob('{folder}/*')",
        "select * from '{outside}'",
        "select * from read_parquet('{catalog}/../*/*.parquet')",
        "select * from read_csv('https://localhost:9/x.csv')",
        "copy (select 1) to '{folder}/made.csv'",
        "attach '{folder}/made.db'",
        "set enable_external_access = true",
        "install httpfs",
    ],
)
def test_a_query_reaches_nothing_but_the_catalog(demo_catalog, tmp_path, query):
    outside = tmp_path / "secret.csv"
    outside.write_text("secret\n1\n")
    catalog = Catalog.open(demo_catalog)
    with pytest.raises(CatalogError):
        catalog.sql(query.format(outside=outside, folder=tmp_path, catalog=demo_catalog))
    assert [path.name for path in tmp_path.iterdir()] == ["secret.csv"]
    assert len(catalog.sql("select * from clips")) == len(catalog.clips)
