"""Readers hold what they read, whoever they are and however they end; nobody waits for them."""

import gc
import os
import pickle
import signal
import subprocess
import sys
import threading

import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog import leases as leases_module
from motionary.catalog import vacuum as vacuum_module
from motionary.catalog.leases import LEASES, is_leased, take_lease
from motionary.catalog.opening import open_snapshot
from motionary.catalog.snapshot import Snapshot, aside_name, manifest_name
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum

READ = """
import sys
from motionary.catalog import Catalog
catalog = Catalog.open(sys.argv[1])
print(catalog.snapshot.snapshot_id, flush=True)
for line in sys.stdin:
    print(len(catalog.pairs.to_arrow()), flush=True)
"""


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(str(tmp_path / "catalog"))


@pytest.fixture
def reader(store, publish_rows):
    """Another process that has opened the first snapshot."""
    publish_rows(store, parts=["first"])
    process = subprocess.Popen(
        [sys.executable, "-c", READ, store.url], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "000001\n"
    yield process
    process.kill()
    process.wait()
    process.stdin.close()
    process.stdout.close()


def lease_files(store: Store) -> list[str]:
    return sorted(store.sizes(LEASES))


def test_what_another_process_reads_stays(store, reader, publish_rows):
    publish_rows(store, parts=["second"])
    gone = vacuum(store, grace_hours=0)
    assert (gone.snapshots, gone.files, gone.held) == ((), 0, ("000001",))
    reader.stdin.write("read\n")
    reader.stdin.flush()
    assert reader.stdout.readline() == "0\n"


def test_a_reader_that_ends_gives_up_its_lease(store, reader, publish_rows):
    publish_rows(store, parts=["second"])
    assert len(lease_files(store)) == 1
    reader.stdin.close()
    assert reader.wait(30) == 0
    assert lease_files(store) == []
    assert vacuum(store, grace_hours=0).snapshots == ("000001",)


def test_a_reader_that_was_killed_holds_nothing(store, reader, publish_rows):
    publish_rows(store, parts=["second"])
    os.kill(reader.pid, signal.SIGKILL)
    reader.wait()
    assert len(lease_files(store)) == 1
    gone = vacuum(store, grace_hours=0)
    assert (gone.snapshots, gone.held) == (("000001",), ())
    assert lease_files(store) == []
    assert store.stored("first", ["pairs"]) is None


@pytest.mark.parametrize("end", ["close", "with", "forget"])
def test_a_catalog_is_held_until_its_end(store, publish_rows, end):
    publish_rows(store)
    catalog = Catalog.open(store.url)
    assert is_leased(store, "000001")
    assert not is_leased(store, "000002")
    if end == "close":
        catalog.close()
        catalog.close()
    elif end == "with":
        with catalog:
            assert is_leased(store, "000001")
    else:
        table = catalog.clips
        del catalog
        gc.collect()
        assert is_leased(store, "000001"), "a table of the catalog is still to be read"
        del table
        gc.collect()
    assert not is_leased(store, "000001")
    assert lease_files(store) == []


def test_two_readers_of_one_snapshot_each_hold_it(store, publish_rows):
    publish_rows(store)
    one, other = Catalog.open(store.url), Catalog.open(store.url)
    one.close()
    assert is_leased(store, "000001")
    other.close()
    assert not is_leased(store, "000001")


def test_a_copy_in_another_process_holds_nothing(store, publish_rows):
    publish_rows(store)
    with Catalog.open(store.url) as catalog:
        there = pickle.loads(pickle.dumps(catalog))
        assert there.snapshot == catalog.snapshot
        assert there.lease is None


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("way", ["release", "exit"])
def test_a_forked_child_does_not_end_its_parents_lease(store, publish_rows, way):
    publish_rows(store)
    forks = f"""
import os, sys
from motionary.catalog import Catalog
catalog = Catalog.open({store.url!r})
child = os.fork()
if child == 0:
    if {way!r} == "release":
        catalog.close()
        del catalog
    sys.exit(0)
os.waitpid(child, 0)
print("waited", flush=True)
sys.stdin.readline()
"""
    process = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", forks],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "waited\n"
    held, files = is_leased(store, "000001"), lease_files(store)
    process.communicate("end\n", timeout=30)
    assert held
    assert len(files) == 1


def test_who_may_not_write_reads_without_a_lease(store, publish_rows, monkeypatch):
    publish_rows(store)

    def refuse(self, *_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(leases_module.Path, "mkdir", refuse)
    catalog = Catalog.open(store.url)
    assert catalog.lease is None
    assert len(catalog.clips) == 0
    assert lease_files(store) == []


def test_where_there_are_no_locks_nobody_waits(store, publish_rows, monkeypatch):
    publish_rows(store)

    def refuse(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(leases_module, "_PATIENCE", 0.0)
    monkeypatch.setattr("fcntl.flock", refuse)
    assert Catalog.open(store.url).lease is None


def test_a_lease_that_vacuum_took_for_dead_is_taken_anew(store, publish_rows, monkeypatch):
    publish_rows(store)
    taken = []
    usual = leases_module._OwnLock.acquire

    def late(self, *arguments, **options):
        """Stop between making the file and locking it, and let vacuum look."""
        if not taken:
            taken.append(self.lock_file)
            leases_module.Path(self.lock_file).touch()
            assert not is_leased(store, "000001")
        return usual(self, *arguments, **options)

    # The first lock is on a file that is created again; so take it away once more after locking.
    def robbed(self, *arguments, **options):
        made = late(self, *arguments, **options)
        if len(taken) == 1:
            taken.append("robbed")
            leases_module.Path(self.lock_file).unlink()
        return made

    monkeypatch.setattr(leases_module._OwnLock, "acquire", robbed)
    lease = take_lease(store, "000001")
    assert lease is not None
    assert len(lease_files(store)) == 1
    assert taken[0] not in [store.path(name) for name in lease_files(store)]
    assert is_leased(store, "000001")


def test_a_reader_whose_snapshot_goes_meanwhile_opens_the_next(store, publish_rows, monkeypatch):
    publish_rows(store, parts=["first"])

    def overtaken(store, snapshot_id):
        monkeypatch.undo()
        publish_rows(store, parts=["second"])
        assert vacuum(store, grace_hours=0).snapshots == ("000001",)
        return take_lease(store, snapshot_id)

    monkeypatch.setattr("motionary.catalog.opening.take_lease", overtaken)
    catalog = Catalog.open(store.url)
    assert catalog.snapshot.snapshot_id == "000002"
    assert [name.split(".")[0] for name in lease_files(store)] == ["leases/000002"]


def test_vacuum_sees_a_lease_that_was_taken_just_before_it_looks(store, publish_rows, monkeypatch):
    publish_rows(store, parts=["first"])
    first, _ = open_snapshot(store)
    publish_rows(store)
    late = []

    def look(store, snapshot_id):
        if not late:  # the manifest is aside; the reader, who has its lease now, waits for it
            late.append(take_lease(store, snapshot_id))
        return is_leased(store, snapshot_id)

    monkeypatch.setattr(vacuum_module, "is_leased", look)
    assert vacuum(store, grace_hours=0).held == (first.snapshot_id,)
    assert Catalog.open(store.url, 1).snapshot == first


def test_who_asks_for_a_snapshot_that_vacuum_looks_at_gets_it(store, publish_rows):
    publish_rows(store)
    publish_rows(store)
    store.rename(manifest_name("000001"), aside_name("000001"))
    back = threading.Timer(0.2, store.rename, [aside_name("000001"), manifest_name("000001")])
    back.start()
    assert Catalog.open(store.url, 1).snapshot.snapshot_id == "000001"
    back.join()


def test_a_lost_manifest_is_an_error_and_not_waited_for(store, publish_rows):
    publish_rows(store)
    store.delete(manifest_name("000001"))
    with pytest.raises(CatalogError, match="manifest of snapshot '000001' .* is missing"):
        Catalog.open(store.url)
    assert lease_files(store) == []


def test_a_catalog_made_directly_holds_nothing(store, publish_rows):
    snapshot = publish_rows(store)
    catalog = Catalog(store, Snapshot("000002", "", snapshot.tables))
    assert len(catalog.clips) == 0
    assert lease_files(store) == []
