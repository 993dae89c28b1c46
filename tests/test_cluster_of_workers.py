"""A real scheduler and worker processes: a death in the middle changes no byte, and what is missing is told.

Every scheduler and worker here is a process of its own, as a cluster has them; they are killed with SIGKILL.
"""

import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pyarrow as pa
import pytest
from distributed import Client, LocalCluster
from threadpoolctl import threadpool_info

from motionary.catalog.store import Store
from motionary.pipeline.config import DistanceConfig, PipelineConfig
from motionary.pipeline.dask_graph import dask_graph
from motionary.pipeline.readers.library import scan_library
from motionary.pipeline.task import Task, run_task
from motionary.workflows import crew
from motionary.workflows.crew import SchedulerError
from motionary.workflows.dashboard import dashboard_hint
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job, prepare
from motionary.workflows.progress import _TimeLeft
from motionary.workflows.workplace import UnfitWorkerError, Workplace, look_around


class Cluster:
    """A Dask scheduler and its workers, each a process."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.address = ""
        self._log = (folder / "log.txt").open("w")
        self._processes: list[subprocess.Popen] = []

    def scheduler(self, *options: str) -> subprocess.Popen:
        # Without a dashboard it still serves its health, on a port of which there is one.
        usual = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0", "--no-dashboard")
        started = self._start("scheduler", *(options or usual))
        while not self.address:
            time.sleep(0.05)
            if self.file.exists() and (text := self.file.read_text()):
                self.address = json.loads(text)["address"]
        return started

    def worker(self, first: str = "") -> subprocess.Popen:
        """Start a worker, which runs some code before anything else."""
        code = self.file.with_name(f"first_{len(self._processes)}.py")
        code.write_text(first)
        options = ("--nthreads", "1", "--memory-limit", "0", "--no-nanny", "--no-dashboard")
        return self._start("worker", *options, "--preload", str(code))

    def wait_for(self, workers: int) -> None:
        with Client(self.address) as client:
            client.wait_for_workers(workers, timeout=120)

    def close(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()
        self._log.close()

    def _start(self, what: str, *options: str) -> subprocess.Popen:
        program = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--scheduler-file", str(self.file)]
        started = subprocess.Popen([*program, *options], stdout=self._log, stderr=self._log)
        self._processes.append(started)
        return started


@pytest.fixture
def cluster(tmp_path) -> Iterator[Cluster]:
    (tmp_path / "cluster").mkdir()
    made = Cluster(tmp_path / "cluster")
    yield made
    made.close()


@pytest.fixture(scope="module")
def few(demo_library, tmp_path_factory) -> Path:
    """Six clips of two actions: with a clip a tile, 21 pairs of tiles."""
    library = tmp_path_factory.mktemp("few") / "library"
    for action in ("walk", "squat"):
        (library / action).mkdir(parents=True)
        for file in sorted((demo_library / action).glob("*.bvh"))[:3]:
            shutil.copy(file, library / action)
    return library


@pytest.fixture(scope="module")
def undisturbed(few, tmp_path_factory, silent_progress) -> Path:
    """The catalog that one process of this machine makes of them."""
    catalog = tmp_path_factory.mktemp("undisturbed") / "catalog"
    run(job(few, catalog), silent_progress)
    return catalog


def job(library: Path, catalog: Path, **options) -> Job:
    config = PipelineConfig(distances=DistanceConfig(tile=1))
    return Job([str(library)], str(catalog), config, **options)


def table_bytes(catalog: Path) -> dict[str, bytes]:
    """Every file of a snapshot but those that hold times."""
    current = (catalog / "CURRENT").read_text()
    tables = json.loads((catalog / "snapshots" / f"{current}.json").read_text())["tables"]
    files = [file for name in tables if name not in ("runs", "inputs") for file in tables[name]]
    return {file: (catalog / file).read_bytes() for file in files}


def at(stage: str, number: int, act: Callable[[], object]):
    """Show no progress, and do something when the so manieth task of a stage is done."""

    @contextmanager
    def shown(totals: object) -> Iterator[Callable[[str], None]]:
        done: Counter[str] = Counter()

        def advance(finished: str) -> None:
            done[finished] += 1
            if finished == stage and done[stage] == number:
                act()

        yield advance

    return shown


def kill(process: subprocess.Popen) -> None:
    process.kill()
    process.wait()


def test_a_worker_killed_in_the_middle_changes_no_byte(cluster, few, undisturbed, tmp_path, monkeypatch):
    cluster.scheduler()
    _, victim = cluster.worker(), cluster.worker()
    cluster.wait_for(2)

    def die() -> None:
        kill(victim)
        while Client.current().scheduler_info(n_workers=0)["n_workers"] == 2:
            time.sleep(0.05)

    remarks: list[str] = []
    asked = job(few, tmp_path / "out", scheduler=cluster.address)
    monkeypatch.setattr(crew, "_TICK", 0.01)
    run(asked, at("compare", 2, die), remark=remarks.append)
    assert remarks == ["2 workers; the scheduler was started without a dashboard", "1 worker now, 2 before"]
    assert table_bytes(tmp_path / "out") == table_bytes(undisturbed)
    assert not list((tmp_path / "out").rglob("*.tmp"))


@pytest.mark.slow
def test_a_scheduler_killed_in_the_middle_ends_the_run_and_the_next_goes_on(
    cluster, few, undisturbed, tmp_path, silent_progress
):
    scheduler, worker = cluster.scheduler(), cluster.worker()
    out = tmp_path / "out"
    with pytest.raises(SchedulerError, match=f"scheduler at {cluster.address} is gone.*is stored"):
        run(job(few, out, scheduler=cluster.address), at("compare", 5, lambda: kill(scheduler)))
    assert not (out / ".writer.json").exists()
    assert not (out / "CURRENT").exists()
    worker.wait(60)  # it stores what it has in hand, and ends for want of a scheduler
    tables = ("ingested", "resampled", "pairs")
    stored = {name: len([*(out / "tables" / name).glob("*.parquet")]) for name in tables}
    assert 5 <= stored["pairs"] < 21
    resumed = run(job(few, out), silent_progress)
    assert resumed.reused == sum(stored.values())
    assert table_bytes(out) == table_bytes(undisturbed)


@pytest.mark.slow
def test_the_command_line_says_in_a_line_that_the_scheduler_is_gone(cluster, few, tmp_path):
    scheduler = cluster.scheduler()
    cluster.worker()
    config = tmp_path / "settings.toml"
    config.write_text("[distances]\ntile = 1\n")
    program = [sys.executable, "-c", "from motionary.workflows.cli import main; main()"]
    options = ["run", str(few), str(tmp_path / "out"), "--config", str(config)]
    with subprocess.Popen(
        [*program, *options, "--scheduler", cluster.address], stderr=subprocess.PIPE, text=True
    ) as started:
        while not list((tmp_path / "out" / "tables" / "pairs").glob("*.parquet")):
            time.sleep(0.02)
        kill(scheduler)
        said = started.communicate()[1]
    assert started.returncode == 1
    assert said.splitlines()[-1].startswith(f"motionary: the scheduler at {cluster.address} is gone")
    assert "Traceback" not in said
    assert "distributed." not in said


@pytest.mark.slow
def test_local_workers_are_started_again_when_killed(few, undisturbed, tmp_path):
    def kill_one() -> None:
        os.kill(next(iter(Client.current().run(os.getpid).values())), signal.SIGKILL)

    remarks: list[str] = []
    run(job(few, tmp_path / "out", workers=3), at("compare", 2, kill_one), remark=remarks.append)
    assert remarks[0].startswith("3 workers; ")
    assert table_bytes(tmp_path / "out") == table_bytes(undisturbed)


@pytest.mark.slow
def test_workers_that_join_late_work_along(cluster, few, undisturbed, tmp_path):
    cluster.scheduler()
    remarks: list[str] = []

    def remark(text: str) -> None:
        if text.startswith("no workers"):
            cluster.worker()
        remarks.append(text)

    def another() -> None:
        cluster.worker()
        Client.current().wait_for_workers(2, timeout=120)

    run(job(few, tmp_path / "out", scheduler=cluster.address), at("ingest", 1, another), remark=remark)
    assert remarks[0] == f"no workers at {cluster.address}; waiting for some, 30 minutes at most"
    assert "1 worker; the scheduler was started without a dashboard" in remarks
    assert "2 workers now, 1 before" in remarks
    assert table_bytes(tmp_path / "out") == table_bytes(undisturbed)


@pytest.mark.slow
def test_without_workers_a_run_waits_and_then_refuses(cluster, few, tmp_path, silent_progress, monkeypatch):
    cluster.scheduler()
    monkeypatch.setattr(crew, "_PATIENCE", 0.5)
    with pytest.raises(SchedulerError, match="has had no workers for"):
        run(job(few, tmp_path / "out", scheduler=cluster.address), silent_progress)


@pytest.mark.slow
def test_a_task_that_ends_every_worker_is_named_with_its_clips(
    cluster, few, tmp_path, silent_progress, monkeypatch
):
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    cluster.scheduler()
    # As where memory is used up: the process is gone.
    cluster.worker(
        "import os\nfrom motionary.pipeline.stages import ingest\ningest.ingest = lambda *_: os._exit(9)"
    )
    with pytest.raises(SchedulerError) as told:
        run(job(few, tmp_path / "out", scheduler=cluster.address), silent_progress)
    assert re.match(
        r"one task of stage ingest \(clips .*\.bvh to .*\.bvh, 1 of them\) was the end of 1 worker: .*memory",
        str(told.value),
    )


@pytest.mark.slow
def test_a_worker_of_other_versions_computes_nothing_even_if_it_joins_late(cluster, few, tmp_path):
    cluster.scheduler()
    cluster.worker()
    other = "from motionary.workflows import workplace\nworkplace.software = lambda: (('numpy', '1.0'),)\n"

    def another() -> None:
        cluster.worker(other)
        Client.current().wait_for_workers(2, timeout=120)

    with pytest.raises(UnfitWorkerError, match=r"worker tcp://.* has .*numpy 1\.0 instead of"):
        run(job(few, tmp_path / "out", scheduler=cluster.address), at("ingest", 1, another))


@pytest.mark.slow
def test_two_runs_over_one_library_at_once_each_fill_their_catalog(
    cluster, few, undisturbed, tmp_path, silent_progress
):
    cluster.scheduler()
    cluster.worker()
    one, other = tmp_path / "one", tmp_path / "other"

    def meanwhile() -> None:
        run(job(few, other, scheduler=cluster.address), silent_progress)

    run(job(few, one, scheduler=cluster.address), at("ingest", 1, meanwhile))
    assert table_bytes(one) == table_bytes(other) == table_bytes(undisturbed)


@pytest.mark.slow
def test_a_task_on_a_worker_has_one_thread_for_its_algebra(cluster):
    class Store:
        def stored(self, key, tables):
            return None

        def save(self, key, tables):
            return {name: table["threads"].to_pylist() for name, table in tables.items()}

    def body():
        threads = [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]
        return {"seen": pa.table({"threads": threads})}

    cluster.scheduler()
    cluster.worker()
    with Client(cluster.address) as client:
        report = client.submit(run_task, Task("name", "key", body, (), ()), Store()).result()
    assert set(report.stored["seen"]) == {1}


def test_what_travels_is_bounded_by_the_tile_whatever_the_library(demo_library, few, tmp_path):
    sizes = {}
    for library in (few, demo_library):
        graph = prepare(job(library, tmp_path / "none")).graph
        tasks = dask_graph(graph.comparison(), Store(str(tmp_path / "none")))
        for stage in ("ingest", "resample", "compare"):
            of_stage = [len(pickle.dumps(one)) for name, one in tasks.items() if name.startswith(stage)]
            sizes.setdefault(stage, []).append(max(of_stage))
    for stage, (small, large) in sizes.items():
        assert large < small + 100, stage  # the library's size is in paths and keys at most
        assert large < 4096, stage


# What a worker must find where it is


@pytest.fixture
def workplace(few, tmp_path) -> Iterator[Workplace]:
    (tmp_path / "catalog").mkdir()
    made = Workplace.of(Store(str(tmp_path / "catalog")), scan_library([few]))
    made.open()
    yield made
    made.close()
    assert not list((tmp_path / "catalog").rglob("*.tmp"))


def test_a_worker_that_finds_everything_is_fit(workplace):
    look_around(workplace, "worker tcp://1 on there")


def test_a_worker_that_cannot_read_the_library_says_so(workplace, tmp_path):
    elsewhere = replace(workplace, files=(str(tmp_path / "gone.bvh"),))
    with pytest.raises(
        UnfitWorkerError, match=r"worker 1 cannot read the library: .*gone\.bvh: No such file"
    ):
        look_around(elsewhere, "worker 1")


def test_a_worker_that_sees_another_folder_under_the_catalogs_path_says_so(workplace, tmp_path):
    elsewhere = replace(workplace, store=Store(str(tmp_path / "local")))
    with pytest.raises(UnfitWorkerError, match="worker 1 does not see the catalog at .*local"):
        look_around(elsewhere, "worker 1")


def test_a_worker_that_may_not_write_the_catalog_says_so(workplace, monkeypatch):
    def refused(self, name, content):
        raise PermissionError(13, "Permission denied", name)

    monkeypatch.setattr(Store, "write", refused)
    with pytest.raises(UnfitWorkerError, match="worker 1 cannot write the catalog .*: Permission denied"):
        look_around(workplace, "worker 1")


def test_a_worker_with_other_software_says_both_versions(workplace):
    other = tuple((name, "0.0") if name == "scipy" else (name, found) for name, found in workplace.software)
    with pytest.raises(UnfitWorkerError, match=r"worker 1 has scipy [1-9][0-9.]* instead of 0\.0: "):
        look_around(replace(workplace, software=other), "worker 1")


def test_a_worker_opens_the_zip_that_a_clip_lies_in(few, tmp_path):
    (tmp_path / "zipped").mkdir()
    shutil.make_archive(str(tmp_path / "zipped" / "takes"), "zip", few)
    found = Workplace.of(Store(str(tmp_path / "catalog")), scan_library([tmp_path / "zipped"]))
    assert found.files == (str(tmp_path / "zipped" / "takes.zip"),)


def test_the_dashboards_link_is_said_where_it_leads_there():
    pytest.importorskip("bokeh")
    options = {"n_workers": 0, "protocol": "tcp://", "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**options) as local, Client(local) as client:
        assert dashboard_hint(client) == f"dashboard {client.dashboard_link}"
    with LocalCluster(**options, scheduler_kwargs={"dashboard": False}) as local, Client(local) as client:
        assert dashboard_hint(client) == "the scheduler was started without a dashboard"


def test_where_bokeh_is_missing_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed.dashboard.scheduler", None)
    options = {"n_workers": 0, "protocol": "tcp://", "dashboard_address": "127.0.0.1:0"}
    with LocalCluster(**options) as local, Client(local) as client:
        assert dashboard_hint(client).startswith("for a dashboard install motionary[dashboard]")


def test_a_stages_bar_says_what_is_left_while_that_is_known():
    shown = [
        str(_TimeLeft().render(SimpleNamespace(finished=finished, time_remaining=seconds)))
        for finished, seconds in ((False, None), (False, 75.4), (True, 0.0))
    ]
    assert shown == ["", "0:01:15 left", ""]


def test_a_killed_task_of_the_whole_library_names_every_clip_once(demo_library, tmp_path):
    config = PipelineConfig(distances=DistanceConfig(tile=8))
    graph = prepare(Job([str(demo_library)], str(tmp_path / "none"), config)).graph
    killed = SimpleNamespace(task=f"cluster-{graph.clustered.key}-run", allowed_failures=3)
    told = crew._of_killed(killed, graph.comparison())
    assert "stage cluster (clips jump/jump_energetic" in told
    assert ", 80 of them) was the end of 4 workers" in told
