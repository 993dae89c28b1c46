"""Vacuum: what a kept or held snapshot names never goes; what nothing names does; cut short anywhere."""

import os
import tempfile
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.snapshot import (
    current_id,
    current_snapshot,
    manifest_name,
    read_snapshot,
    snapshot_ids,
)
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum
from motionary.catalog.writer_lock import the_only_writer

NOW = datetime.now(UTC)


def ago(**time: float) -> str:
    return (NOW - timedelta(**time)).isoformat()


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(str(tmp_path / "catalog"))


@pytest.fixture
def five(store, publish_rows) -> Store:
    """Five snapshots, a day apart, each with a part of its own and one of the next's."""
    for n in range(1, 6):
        publish_rows(store, ago(days=6 - n), parts=[f"part-{n}", f"part-{n + 1}"])
    return store


def parts_there(store: Store) -> set[str]:
    return {name.split("/")[2].removesuffix(".parquet") for name in store.sizes("tables/pairs")} - {"none"}


def whole(store: Store) -> bool:
    """Whether every snapshot that is there has all its files, unchanged, and the current one is there."""
    snapshots = [read_snapshot(store, one) for one in snapshot_ids(store)]
    assert current_id(store) in [one.snapshot_id for one in snapshots]
    return all(store.facts(file) == facts for one in snapshots for file, facts in one.parts.items())


def test_the_newest_are_kept(five):
    gone = vacuum(five, keep=2, grace_hours=0)
    assert (gone.snapshots, gone.held) == (("000001", "000002", "000003"), ())
    assert gone.files == 3
    assert snapshot_ids(five) == ["000004", "000005"]
    assert parts_there(five) == {"part-4", "part-5", "part-6"}
    assert whole(five)


def test_the_young_are_kept(five):
    assert vacuum(five, days=3.5, grace_hours=0).snapshots == ("000001", "000002")


def test_the_one_rule_or_the_other_keeps(five):
    assert vacuum(five, keep=4, days=1.5, grace_hours=0).snapshots == ("000001",)


def test_without_a_rule_only_the_current_one_stays(five):
    before = five.sizes("tables")
    gone = vacuum(five, grace_hours=0)
    assert snapshot_ids(five) == ["000005"]
    assert gone.bytes == sum(before.values()) - sum(five.sizes("tables").values()) > 0
    assert vacuum(five, grace_hours=0) == type(gone)((), 0, 0, ())


def test_the_current_one_is_kept_though_it_is_not_the_newest(five):
    five.write("CURRENT", b"000002")
    vacuum(five, keep=1, grace_hours=0)
    assert snapshot_ids(five) == ["000002", "000005"]
    assert whole(five)


def test_what_was_current_until_lately_is_kept(store, publish_rows):
    for hours in (50, 40, 0.5, 0.2):  # the second was current until half an hour ago
        publish_rows(store, ago(hours=hours), parts=[f"part-{hours}"])
    assert vacuum(store, grace_hours=1).snapshots == ("000001",)
    assert vacuum(store, grace_hours=0.4).snapshots == ("000002",)
    assert whole(store)


def test_a_run_that_died_before_it_published_replaced_nothing(store, publish_rows):
    publish_rows(store, ago(hours=50))
    publish_rows(store, ago(hours=40))
    store.write("CURRENT", b"000001")  # as if the second had died before this
    publish_rows(store, ago(hours=0.5))
    assert current_snapshot(store).after == "000001"
    assert vacuum(store, grace_hours=1).snapshots == ()
    assert vacuum(store, grace_hours=0.1).snapshots == ("000001", "000002")


def test_files_that_nothing_names_stay_for_the_grace_time(five):
    five.save("not-yet", {"pairs": five.load("none", "pairs")})
    unfinished = Path(five.path(f"tables/pairs/x.parquet.{'0' * 32}.tmp"))
    unfinished.write_bytes(b"half")
    Path(five.path("notes.tmp")).write_text("not ours")
    assert vacuum(five, keep=5, grace_hours=1).files == 0
    for file in (unfinished, Path(five.path("tables/pairs/not-yet.parquet"))):
        os.utime(file, times=(time.time() - 7200,) * 2)
    assert vacuum(five, keep=5, grace_hours=1, dry_run=True).files == 2
    gone = vacuum(five, keep=5, grace_hours=1)
    assert (gone.snapshots, gone.files) == ((), 2)
    assert not unfinished.exists()
    assert Path(five.path("notes.tmp")).exists()
    assert whole(five)


def test_a_dry_run_tells_and_removes_nothing(five):
    with Catalog.open(five.url, 2):
        before = five.sizes("")
        told = vacuum(five, keep=2, grace_hours=0, dry_run=True)
        assert five.sizes("") == before
        assert vacuum(five, keep=2, grace_hours=0) == told
    assert told.held == ("000002",)


def test_a_manifest_to_be_kept_that_cannot_be_read_stops_it(five):
    before = parts_there(five)
    five.write(manifest_name("000004"), b"{")
    with pytest.raises(CatalogError, match="snapshot 000004 is to be kept, but which files it names cannot"):
        vacuum(five, keep=2, grace_hours=0)
    with pytest.raises(CatalogError, match="000004 is to be kept"):  # how old it is cannot be read
        vacuum(five, days=1, grace_hours=0)
    assert (parts_there(five), len(snapshot_ids(five))) == (before, 5)
    assert vacuum(five, keep=1, grace_hours=0).snapshots == ("000001", "000002", "000003", "000004")


@pytest.mark.parametrize(
    "damage", [b'{"created_at": "yesterday"', b'{"snapshot_id": "000005"}', b"[]", b"\xff"]
)
def test_a_damaged_current_manifest_stops_it(five, damage):
    five.write(manifest_name("000005"), damage)
    with pytest.raises(CatalogError, match="manifest of snapshot '000005' .* is missing or damaged"):
        vacuum(five, grace_hours=0)
    assert len(snapshot_ids(five)) == 5


@pytest.mark.parametrize("rules", [{"keep": 0}, {"keep": -1}, {"days": -1}, {"grace_hours": -1}])
def test_rules_that_make_no_sense_are_refused(five, rules):
    with pytest.raises(ValueError, match="must be at least"):
        vacuum(five, **rules)
    assert len(snapshot_ids(five)) == 5


def test_no_catalog(store):
    with pytest.raises(CatalogError, match="is not a catalog"):
        vacuum(store)


class Killed(BaseException):
    """The end of a process."""


@pytest.mark.parametrize("step", range(1, 40))
def test_killed_at_any_step_it_leaves_a_whole_catalog_and_the_next_finishes(five, monkeypatch, step):
    done = 0

    def counted(usual):
        def act(self, *arguments):
            nonlocal done
            done += 1
            if done == step:
                raise Killed
            return usual(self, *arguments)

        return act

    with Catalog.open(five.url, 2), monkeypatch.context() as patch:
        for name in ("rename", "delete", "settle", "sizes", "names"):
            patch.setattr(Store, name, counted(getattr(Store, name)))
        try:
            vacuum(five, keep=2, grace_hours=0)
        except Killed:
            pass
        else:
            assert step > 10, "nothing was cut short"
    assert whole(five)
    vacuum(five, keep=2, grace_hours=0)
    assert snapshot_ids(five) == ["000004", "000005"]
    assert parts_there(five) == {"part-4", "part-5", "part-6"}
    assert whole(five)


def test_a_manifest_that_a_killed_vacuum_had_put_aside_is_put_back(five, monkeypatch):
    def power_cut(*_):
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr("motionary.catalog.vacuum.is_leased", power_cut)
        with pytest.raises(Killed):
            vacuum(five, keep=2, grace_hours=0)
    assert len(snapshot_ids(five)) == 4
    with pytest.raises(CatalogError, match="there is no snapshot 1 "):
        Catalog.open(five.url, 1)
    assert vacuum(five, keep=5, grace_hours=0).snapshots == ()
    assert len(Catalog.open(five.url, 1).pairs) == 0
    assert whole(five)


_SNAPSHOTS = st.lists(st.frozensets(st.integers(0, 6), max_size=4), min_size=1, max_size=6)


@settings(max_examples=40, deadline=None)
@given(data=st.data(), named=_SNAPSHOTS)
def test_nothing_that_a_kept_or_held_snapshot_names_ever_goes(publish_rows, data, named):
    ids = [f"{n:06d}" for n in range(1, len(named) + 1)]
    ages = data.draw(st.lists(st.integers(0, 9), min_size=len(ids), max_size=len(ids)))
    keep = data.draw(st.none() | st.integers(1, 6))
    days = data.draw(st.none() | st.integers(0, 9))
    grace = data.draw(st.sampled_from([0, 30, 100]))
    read = data.draw(st.sets(st.sampled_from(ids)))
    current = data.draw(st.sampled_from(ids))
    with tempfile.TemporaryDirectory() as folder:
        store = Store(folder)
        for age, parts in zip(sorted(ages, reverse=True), named, strict=True):
            publish_rows(store, ago(days=age + 0.5), parts=[f"part-{one}" for one in sorted(parts)])
        store.write("CURRENT", current.encode())
        readers = [Catalog.open(folder, one) for one in sorted(read)]
        manifests = {one: read_snapshot(store, one) for one in ids}

        gone = vacuum(store, keep, days, grace)

        age_of = dict(zip(ids, sorted(ages, reverse=True), strict=True))
        must = {current, *read} | set(ids[-keep:] if keep else [])
        must |= {one for one in ids if days is not None and age_of[one] + 0.5 < days}
        must |= {
            a for a, b in zip(ids, ids[1:], strict=False) if b <= current and (age_of[b] + 0.5) * 24 < grace
        }
        assert must <= set(snapshot_ids(store))
        assert set(snapshot_ids(store)) | set(gone.snapshots) == set(ids)
        assert whole(store)
        for reader in readers:
            assert len(reader.pairs.to_arrow()) == 0
        if grace == 0:  # then nothing else stays
            assert set(snapshot_ids(store)) == must
            assert set(store.sizes("tables")) == {file for one in must for file in manifests[one].files}
        for reader in readers:
            reader.close()


def test_the_command(five, motionary):
    with Catalog.open(five.url, 1):
        code, out, err = motionary("vacuum", five.url, "--keep", 3, "--grace-hours", 0, "--dry-run")
        assert (code, len(snapshot_ids(five))) == (0, 5)
        assert out.startswith("would remove 1 snapshot (000002) and 0 files of 0.0 MB")
        code, out, err = motionary("vacuum", five.url, "--keep", 3, "--grace-hours", 0)
    assert (code, snapshot_ids(five)) == (0, ["000001", "000003", "000004", "000005"])
    assert out.startswith("removed 1 snapshot (000002) and 0 files")
    assert "a reader holds 000001" in err
    code, out, err = motionary("vacuum", five.url, "--days", 2.5, "--grace-hours", 0)
    assert out.startswith("removed 2 snapshots (000001, 000003)")
    with the_only_writer(five, print):
        code, _, err = motionary("vacuum", five.url)
    assert code == 1
    assert "is being written by process" in err
    assert motionary("vacuum", five.url, "--keep", 0)[0] == 2
    assert motionary("vacuum", five.url + "-not")[0] == 1
    assert not Path(five.url + "-not").exists()
