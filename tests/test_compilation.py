"""Kernels: compiled once by one process, all that the main job needs, and never taken from older sources."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from motionary.pipeline import compilation
from motionary.pipeline.compilation import KernelCacheError

COMPILE_ON_A_CLUSTER = """
from distributed import Client, LocalCluster
from motionary.workflows.scheduler import compile_on_every_machine

def announce():
    print("compiling", flush=True)

if __name__ == "__main__":
    options = dict(n_workers=3, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0")
    with LocalCluster(**options) as cluster, Client(cluster) as client:
        compile_on_every_machine(client, announce)
        print("again", flush=True)
        compile_on_every_machine(client, announce)
"""

RUN_JOBS = """
import json, sys
from contextlib import contextmanager
from numba.core import event
from motionary.pipeline.config import (
    AlignmentConfig, ClusterConfig, DistanceConfig, FeatureConfig, PipelineConfig
)
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

compiled = []

class Listener(event.Listener):
    def on_start(self, event):
        compiled.append(f"{event.data['dispatcher']} {event.data['args']}")

    def on_end(self, event):
        pass

@contextmanager
def silent(totals):
    yield lambda stage: None

event.register("numba:compile", Listener())
configs = [
    PipelineConfig(),
    PipelineConfig(
        features=FeatureConfig(kind="paper"),
        distances=DistanceConfig(thresholds="random", tile=3),
        clusters=ClusterConfig(primary="average", cut="strip"),
        alignment=AlignmentConfig(segment_length=1000),
    ),
    PipelineConfig(clusters=ClusterConfig(primary="fuzzy", metric="dtw"), distances=DistanceConfig(tile=1)),
    PipelineConfig(
        distances=DistanceConfig(pairs="pruned"), clusters=ClusterConfig(primary="complete", threshold=0.2)
    ),
    PipelineConfig(distances=DistanceConfig(pairs="landmarks"), clusters=ClusterConfig(landmarks=4)),
]
eight, one, out = sys.argv[1:]
announced = []
for library in (eight, one):
    for number, config in enumerate(configs):
        catalog = f"{out}/{library.rpartition('/')[2]}-{number}"
        run(Job([library], catalog, config), silent, lambda: announced.append(1))
print(json.dumps([compiled, announced]))
"""

RUN_AGAIN = """
import sys
from contextlib import contextmanager
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

@contextmanager
def silent(totals):
    yield lambda stage: None

library, catalog = sys.argv[1:]
result = run(Job([library], catalog, PipelineConfig()), silent)
print(result.computed, "numba" in sys.modules)
"""

COMMAND_LINE = "from motionary.workflows.cli import main; main()"


def python(
    *arguments: str | Path, check: bool = True, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=check,
        env=os.environ | environment,
    )


def cached(folder: Path) -> dict[str, int]:
    """Return when each file of a kernel's code was written."""
    files = [*folder.rglob("*.nbc"), *folder.rglob("*.nbi")]
    return {str(file.relative_to(folder)): file.stat().st_mtime_ns for file in files}


@pytest.fixture(scope="module")
def cold(tmp_path_factory) -> SimpleNamespace:
    """Compile into an empty cache from a cluster of processes, once for this module."""
    root = tmp_path_factory.mktemp("cold")
    script = root / "cluster.py"
    script.write_text(COMPILE_ON_A_CLUSTER)
    done = python(script, NUMBA_CACHE_DIR=str(root / "cache"))
    return SimpleNamespace(cache=root / "cache", said=done.stdout.split())


@pytest.fixture(scope="module")
def libraries(tmp_path_factory, demo_library) -> tuple[Path, Path]:
    """Eight clips of two actions, and one clip."""
    root = tmp_path_factory.mktemp("libraries")
    for action in ("walk", "squat"):
        for file in sorted((demo_library / action).glob("*.bvh"))[:4]:
            (root / "eight" / action).mkdir(parents=True, exist_ok=True)
            shutil.copy(file, root / "eight" / action)
    (root / "one").mkdir()
    shutil.copy(file, root / "one")
    return root / "eight", root / "one"


@pytest.mark.slow
def test_a_cluster_of_processes_compiles_once_and_says_so_once(cold):
    assert cold.said == ["compiling", "again"]
    folders = {file.parent for file in cold.cache.rglob("*.nbc")}
    assert {folder.name.partition("_")[0] for folder in folders} == {"distances", "clustering", "alignment"}
    assert all(list(folder.glob("motionary-*.compiled")) for folder in folders)


def test_the_main_job_finds_all_its_kernels_compiled_and_without_work_loads_no_compiler(libraries, tmp_path):
    compilation.compile_kernels(lambda: None)
    done = python("-c", RUN_JOBS, *libraries, tmp_path)
    compiled, announced = json.loads(done.stdout)
    assert compiled == []
    assert announced == []
    again = python("-c", RUN_AGAIN, libraries[0], tmp_path / "eight-0")
    assert again.stdout.split() == ["0", "False"]


def test_where_no_folder_can_be_written_the_command_line_says_what_to_do(libraries, tmp_path):
    (tmp_path / "file").write_text("")
    done = python(
        *("-c", COMMAND_LINE, "run", libraries[1], tmp_path / "out", "--workers", "1"),
        check=False,
        NUMBA_CACHE_DIR=str(tmp_path / "file" / "below"),
        NUMBA_CACHE_LOCATOR_CLASSES="UserProvidedCacheLocator,UserWideCacheLocator",
        XDG_CACHE_HOME=str(tmp_path / "file" / "below"),
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.splitlines()[-1].startswith("motionary: ")
    assert "has no folder in which compiled kernels could be kept" in done.stderr
    assert "set NUMBA_CACHE_DIR" in done.stderr


def test_a_second_process_waits_for_the_lock_and_gives_up_by_name(tmp_path):
    with compilation._locked(tmp_path, 1.0):
        with pytest.raises(KernelCacheError, match=r"motionary-kernels\.lock \(database is locked\)"):
            with compilation._locked(tmp_path, 0.1):
                pass
    with compilation._locked(tmp_path, 0.1):
        pass


@pytest.mark.parametrize(
    ("marks", "kept"),
    [
        ({"one": "these sources"}, True),
        ({"one": "these sources", "other": "these sources"}, True),
        ({"one": "these sources", "other": "older sources"}, False),
        ({}, False),  # compiled by hand, or by a run that was killed
    ],
)
def test_code_of_other_sources_is_thrown_away(tmp_path, monkeypatch, marks, kept):
    monkeypatch.setattr(compilation, "_sources", lambda: "these sources")
    for name in ("kernel-1.py311.nbi", "kernel-1.py311.1.nbc", "module.pyc"):
        (tmp_path / name).write_text("")
    for processor, content in marks.items():
        (tmp_path / f"motionary-{processor}.compiled").write_text(content)
    compilation._discard_stale([tmp_path])
    assert (tmp_path / "module.pyc").exists()
    assert bool(cached(tmp_path)) == kept
    assert len(list(tmp_path.glob("*.compiled"))) == (len(marks) if kept else 0)


def test_a_change_in_any_module_beside_a_kernel_counts(tmp_path, monkeypatch):
    def digest() -> str:
        return compilation._sources.__wrapped__()

    (tmp_path / "kernel.py").write_text("def kernel():\n    return callee()\n")
    (tmp_path / "callee.py").write_text("def callee():\n    return 1\n")
    names: dict = {}
    exec(compile((tmp_path / "kernel.py").read_text(), tmp_path / "kernel.py", "exec"), names)
    monkeypatch.setattr(compilation, "_kernels", lambda: [SimpleNamespace(py_func=names["kernel"])])
    before = digest()
    assert digest() == before
    (tmp_path / "callee.py").write_text("def callee():\n    return 2\n")
    assert digest() != before


def test_what_this_process_has_loaded_is_compiled_whatever_lies_where_the_user_stands(tmp_path, monkeypatch):
    (tmp_path / "motionary" / "pipeline").mkdir(parents=True)
    (tmp_path / "motionary" / "pipeline" / "__init__.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compilation, "_compiled", lambda folders: False)
    found = []

    def ask(command: list[str], **options):
        where = "import motionary.pipeline; print(motionary.pipeline.__file__)"
        done = subprocess.CompletedProcess(command, 0)
        assert command[-2:] == ["-m", "motionary.pipeline.compilation"]
        found.append(usual([*command[:-2], "-c", where], **options).stdout.strip())
        return done

    usual = subprocess.run
    monkeypatch.setattr(compilation.subprocess, "run", ask)
    compilation.compile_kernels(lambda: None)
    assert found == [str(Path(compilation.__file__).parent / "__init__.py")]


@pytest.mark.slow
def test_two_runs_at_once_compile_once_and_older_code_is_replaced(cold, tmp_path):
    cache = tmp_path / "cache"
    shutil.copytree(cold.cache, cache)
    for mark in cache.rglob("*.compiled"):
        mark.write_text("older sources")
    before = cached(cache)
    command = "from motionary.pipeline.compilation import compile_kernels; compile_kernels(print)"
    both = [
        subprocess.Popen([sys.executable, "-c", command], env=os.environ | {"NUMBA_CACHE_DIR": str(cache)})
        for _ in range(2)
    ]
    assert [one.wait() for one in both] == [0, 0]
    after = cached(cache)
    assert after.keys() == before.keys()
    assert all(after[file] > before[file] for file in after)
    python("-c", command.replace("print", "exit"), NUMBA_CACHE_DIR=str(cache))
