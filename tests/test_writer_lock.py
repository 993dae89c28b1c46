"""One writer a catalog: the second is refused by name, a dead one's place is taken and told."""

import json
import os
import platform
import signal
import subprocess
import sys

import pytest

from motionary.catalog import CatalogError
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import RECORD, Writer, the_only_writer
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

HOLD = """
import sys, time
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import the_only_writer
with the_only_writer(Store(sys.argv[1]), print):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds the lock of a catalog."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


def refused(writer):
    raise AssertionError(f"{writer} was taken for dead")


def test_a_second_writer_is_told_who_the_first_is(tmp_path, holder):
    with (
        pytest.raises(CatalogError, match=rf"written by process {holder.pid} on {platform.node()}, since 20"),
        the_only_writer(Store(str(tmp_path)), refused),
    ):
        raise AssertionError("two writers at once")


def test_a_run_is_refused_while_another_writes(tmp_path, holder, demo_library, silent_progress):
    (tmp_path / "tables").mkdir()
    with pytest.raises(CatalogError, match="being written by process"):
        run(Job([str(demo_library)], str(tmp_path), PipelineConfig()), silent_progress)
    assert [path.name for path in (tmp_path / "tables").iterdir()] == []


def test_the_place_of_a_writer_that_was_killed_is_taken_and_told(tmp_path, holder):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    told = []
    with the_only_writer(Store(str(tmp_path)), told.append):
        assert json.loads((tmp_path / RECORD).read_text())["process"] == os.getpid()
    assert [writer.process for writer in told] == [holder.pid]
    with the_only_writer(Store(str(tmp_path)), refused):
        pass


@pytest.mark.parametrize("left", ["", "{", "[1]", '{"host": "a"}'])
def test_a_record_cut_short_says_nothing(tmp_path, left):
    (tmp_path / RECORD).write_text(left)
    with the_only_writer(Store(str(tmp_path)), refused):
        pass
    assert not (tmp_path / RECORD).exists()


def test_a_writer_that_fails_frees_the_lock(tmp_path):
    with pytest.raises(KeyError), the_only_writer(Store(str(tmp_path)), refused):
        raise KeyError
    told = []
    with the_only_writer(Store(str(tmp_path)), told.append):
        pass
    assert told == []


def test_elsewhere_than_on_disk_nothing_is_locked():
    store = Store("memory://catalog-without-lock")
    with the_only_writer(store, refused), the_only_writer(store, refused):
        assert not store.names("")


def test_a_writer_reads_well():
    assert str(Writer("studio-7", 41, "2026-01-02T03:04:05+00:00")) == (
        "process 41 on studio-7, since 2026-01-02T03:04:05+00:00"
    )
