"""The doctor: what is sound passes, each fault is named with its mend, and nothing is left behind."""

import errno
import json
import os
from collections import namedtuple
from pathlib import Path

import filelock
import pytest

from motionary.catalog.snapshot import current_snapshot
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import LOCK, RECORD
from motionary.pipeline import compilation
from motionary.pipeline.compilation import KernelCache, KernelCacheError
from motionary.workflows import doctor, doctor_catalog
from motionary.workflows.doctor import Finding, examine
from tests.catalogs import copied

SOUND_FOLDER = {"write", "rename", "lock"}


def found(catalog: object = None) -> dict[str, Finding]:
    return {finding.what: finding for finding in examine(None if catalog is None else str(catalog))}


def everything(folder: Path) -> dict[str, int]:
    return {str(file): file.stat().st_mtime_ns for file in folder.rglob("*") if "leases" not in file.parts}


@pytest.fixture
def catalog(demo_catalog, tmp_path) -> Path:
    return Path(copied(demo_catalog, tmp_path))


@pytest.fixture
def no_machine(monkeypatch):
    """Look at the catalog only: what is of the machine is tested on its own."""
    for look in ("python_version", "package_versions", "machine", "kernels"):
        monkeypatch.setattr(doctor, look, lambda: iter(()))


def test_this_machine_is_sound():
    findings = found()
    assert list(findings) == ["python", "packages", "machine", "kernels"]
    assert {finding.state for finding in findings.values()} <= {"PASSED", "NOTE"}
    assert "numpy 2." in findings["packages"].detail
    assert "pytest" not in findings["packages"].detail  # an extra's
    assert " cores, " in findings["machine"].detail


def test_another_python_is_told(monkeypatch):
    monkeypatch.setattr(doctor.platform, "python_version", lambda: "3.10.1")
    (finding,) = doctor.python_version()
    assert finding.state == "FAILED"
    assert finding.detail == "3.10.1 is not <3.14,>=3.11"
    assert "Python <3.14,>=3.11" in finding.mend


def test_packages_that_are_missing_or_too_old_are_told(monkeypatch):
    asked = ["numpy>=99", "rich>=13", "no-such-package>=1", 'also-missing; extra == "test"']
    monkeypatch.setattr(doctor, "requires", lambda name: asked)
    (finding,) = doctor.package_versions()
    assert finding.state == "FAILED"
    assert "numpy 2." in finding.detail
    assert finding.detail.endswith("is not >=99, no-such-package is missing")
    assert finding.mend == 'pip install "numpy>=99" "no-such-package>=1"'


@pytest.mark.parametrize(("compiled", "state"), [(True, "PASSED"), (False, "NOTE")])
def test_kernels_that_are_there_or_not(monkeypatch, tmp_path, compiled, state):
    cache = KernelCache([tmp_path / "kernels" / "__pycache__"], compiled)
    monkeypatch.setattr(compilation, "kernel_cache", lambda: cache)
    (finding,) = doctor.kernels()
    assert finding.state == state
    assert str(tmp_path) in finding.detail


def test_kernels_that_cannot_be_kept(monkeypatch):
    def refuse() -> KernelCache:
        raise KernelCacheError("no folder")

    monkeypatch.setattr(compilation, "kernel_cache", refuse)
    (finding,) = doctor.kernels()
    assert finding == Finding(
        "FAILED", "kernels", "no folder", "set NUMBA_CACHE_DIR to a folder that can be written"
    )


def test_a_look_that_crashes_has_failed_and_hides_no_other(monkeypatch):
    def crash():
        raise ValueError("broken\nmetadata")

    monkeypatch.setattr(doctor, "package_versions", crash)
    findings = found()
    assert findings["packages"].state == "FAILED"
    assert findings["packages"].detail == "ValueError: broken metadata"
    assert findings["kernels"].state in ("PASSED", "NOTE")


def test_a_sound_catalog_and_nothing_left_behind(no_machine, catalog):
    before = everything(catalog)
    findings = found(catalog)
    assert {what: finding.state for what, finding in findings.items()} == {
        "storage": "NOTE",
        "snapshot": "PASSED",
        "disk": "PASSED",
        **dict.fromkeys(SOUND_FOLDER, "PASSED"),
        "left over": "PASSED",
        "writer": "PASSED",
    }
    assert findings["snapshot"].detail.startswith("000001 of ")
    after = everything(catalog)
    assert {**after, str(catalog): 0} == {**before, str(catalog): 0}


def test_a_catalog_that_is_not_there_yet(no_machine, tmp_path):
    findings = found(tmp_path / "not" / "yet")
    assert {finding.state for finding in findings.values()} == {"PASSED", "NOTE"}
    assert "not there yet" in findings["storage"].detail
    assert "nothing is published" in findings["snapshot"].detail
    assert list(tmp_path.iterdir()) == []


def test_a_manifest_that_is_damaged(no_machine, catalog):
    (catalog / "snapshots" / "000001.json").write_text("{")
    findings = found(catalog)
    assert findings["snapshot"].state == "FAILED"
    assert "CatalogError: the manifest of snapshot '000001'" in findings["snapshot"].detail
    assert findings["lock"].state == "PASSED"


def test_a_folder_that_cannot_be_written(no_machine, catalog, monkeypatch):
    def refuse(*arguments, **options):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(doctor_catalog, "TemporaryDirectory", refuse)
    finding = found(catalog)["write"]
    assert finding.state == "FAILED"
    assert "Read-only file system" in finding.detail
    assert "let this user write there" in finding.mend


@pytest.mark.parametrize(
    ("owner", "name", "what"),
    [(os, "fsync", "write"), (Path, "replace", "rename"), (doctor_catalog.FileLock, "acquire", "lock")],
)
def test_a_file_system_that_lacks_something(no_machine, catalog, monkeypatch, owner, name, what):
    def refuse(*arguments, **options):
        raise OSError(errno.EIO, "not here")

    monkeypatch.setattr(owner, name, refuse)
    findings = found(catalog)
    assert findings[what].state == "FAILED"
    assert "not here" in findings[what].detail
    assert findings[what].mend
    assert not list(catalog.glob(".doctor-*"))


def test_locks_that_do_not_lock(no_machine, catalog, monkeypatch):
    monkeypatch.setattr(doctor_catalog, "FileLock", filelock.SoftFileLock)
    assert found(catalog)["lock"].state == "PASSED"

    class NoLock:
        def __init__(self, *arguments, **options):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *exception):
            pass

    monkeypatch.setattr(doctor_catalog, "FileLock", NoLock)
    finding = found(catalog)["lock"]
    assert finding.state == "FAILED"
    assert "is given to a second one" in finding.detail


def test_a_disk_that_is_nearly_full(no_machine, catalog, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(doctor_catalog.shutil, "disk_usage", lambda folder: usage(10, 9, 1))
    finding = found(catalog)["disk"]
    assert finding.state == "FAILED"
    assert finding.detail.startswith("0 MiB free, the current snapshot takes ")
    assert "motionary vacuum" in finding.mend


def test_what_writers_left(no_machine, catalog):
    (catalog / "tables" / "clips" / "x.parquet.0123.tmp").write_text("half")
    assert "1 unfinished, the first " in found(catalog)["left over"].detail


RECORDED = {"host": "elsewhere", "process": 12, "started": "2020-01-01T00:00:00+00:00"}


def test_a_writer_that_lives_and_one_that_died(no_machine, catalog):
    (catalog / RECORD).write_text(json.dumps(RECORDED))
    with filelock.FileLock(catalog / LOCK):
        assert found(catalog)["writer"] == Finding(
            "NOTE",
            "writer",
            "process 12 on elsewhere, since 2020-01-01T00:00:00+00:00 is writing it; a second run is refused "
            "until it ends",
        )
    finding = found(catalog)["writer"]
    assert "died while writing; the next run takes its place" in finding.detail
    assert (catalog / RECORD).exists()
    (catalog / RECORD).write_text("{")
    assert "was cut short" in found(catalog)["writer"].detail


def test_other_versions_than_those_that_computed_it_are_noted(no_machine, catalog, monkeypatch):
    snapshot = current_snapshot(Store(str(catalog)))
    here = {"numpy": "0.1"} | dict.fromkeys(snapshot.versions, "0.1")
    monkeypatch.setattr(doctor_catalog, "versions", lambda: here)
    manifest = catalog / "snapshots" / "000001.json"
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"versions": {"numpy": "2.0"}}))
    assert found(catalog)["versions"].detail == "the snapshot was computed by numpy 2.0 (here 0.1)"


def test_a_catalog_that_is_not_on_disk(no_machine, monkeypatch, tmp_path):
    url = f"memory://{tmp_path.name}"
    findings = found(url)
    assert "no lock keeps a second writer out" in findings["storage"].detail
    assert findings["access"].state == "PASSED"
    assert Store(url).names("") == []
    monkeypatch.setattr(
        Store, "read_bytes", lambda store, name: (_ for _ in ()).throw(PermissionError("denied"))
    )
    finding = found(url)["access"]
    assert (finding.state, finding.detail) == ("FAILED", "PermissionError: denied")
    assert "permission" in finding.mend


def test_the_command_says_it_line_by_line_and_exits_1_where_something_fails(motionary, catalog, monkeypatch):
    code, out, _ = motionary("doctor", catalog)
    assert code == 0
    assert [line.split("  ")[0] for line in out.splitlines()].count("FAILED") == 0
    assert "PASSED  lock: works in " in out
    monkeypatch.setattr(doctor.platform, "python_version", lambda: "3.10.1")
    code, out, _ = motionary("doctor")
    assert code == 1
    assert "FAILED  python: 3.10.1 is not <3.14,>=3.11; make an environment with Python" in out
