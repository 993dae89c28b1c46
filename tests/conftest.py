"""Fixtures that more than one test module uses."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.synthetic import write_library
from motionary.workflows import cli
from motionary.workflows.main_job import Job, run

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real motion capture that lies beside the project, where it does."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no real motion capture at {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture(scope="session")
def demo_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the embedded library once; tests read it and do not change it."""
    folder = tmp_path_factory.mktemp("demo") / "library"
    write_library(folder)
    return folder


@pytest.fixture(scope="session")
def demo_catalog(demo_library: Path) -> str:
    """Run the main job on the embedded library once; tests only read the catalog."""
    url = str(demo_library.parent / "catalog")
    run(Job([str(demo_library)], url, PipelineConfig(), demo_library / "labels.csv"), silent)
    return url


@contextmanager
def silent(totals: object) -> Iterator[Callable[[str], None]]:
    """Show no progress."""
    yield lambda stage: None


@pytest.fixture(scope="session")
def silent_progress() -> Callable:
    """Return a way of showing progress that shows none."""
    return silent


@pytest.fixture
def motionary(monkeypatch, capfdbinary):
    """Run a command in this process; returns exit code, stdout and stderr."""

    def call(*arguments: object, binary: bool = False):
        monkeypatch.setattr(sys, "argv", ["motionary", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        out, err = capfdbinary.readouterr()
        return stop.value.code, out if binary else out.decode(), err.decode()

    return call
