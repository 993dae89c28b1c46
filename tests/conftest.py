"""Fixtures that more than one test module uses."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import fsspec
import numpy as np
import pyarrow as pa
import pytest
import requests
from filelock import FileLock

from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import Snapshot, current_snapshot, next_snapshot_id, publish
from motionary.catalog.store import PartFacts, Store
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.synthetic import write_library
from motionary.workflows import cli
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real motion capture that lies beside the project, where it does."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no real motion capture at {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture(scope="session")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[Path], object]], Path]:
    """Return a way of making something of a name once for all processes that the tests are shared out to."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:  # each has a folder of its own in that of the whole run
        folder = folder.parent

    def make_once(name: str, make: Callable[[Path], object]) -> Path:
        made, mark = folder / name, folder / f"{name.replace('/', '-')}.made"
        with FileLock(mark.with_suffix(".lock")):
            if not mark.exists():
                made.parent.mkdir(exist_ok=True)
                make(made)
                mark.touch()
        return made

    return make_once


@pytest.fixture(scope="session")
def demo_library(made_once: Callable) -> Path:
    """Write the embedded library once; tests read it and do not change it."""
    return made_once("demo/library", write_library)


@pytest.fixture(scope="session")
def demo_catalog(demo_library: Path, made_once: Callable) -> str:
    """Run the main job on the embedded library once; tests only read the catalog."""

    def make(folder: Path) -> None:
        run(Job([str(demo_library)], str(folder), PipelineConfig(), demo_library / "labels.csv"), silent)

    return str(made_once("demo/catalog", make))


@pytest.fixture
def cart() -> Motion:
    """Return a motion of something that is no figure."""
    skeleton = Skeleton(("body", "wheel"), (-1, 0), np.ones((2, 3)))
    return Motion("cart", skeleton, 30, np.zeros((2, 3)), np.ones((2, 2, 4)))


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    """Serve S3 on this machine, with one bucket; returns its URL."""
    pytest.importorskip("s3fs")
    server = pytest.importorskip("moto.server").ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://{host}:{port}",
            "AWS_ACCESS_KEY_ID": "nobody",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_DEFAULT_REGION": "us-east-1",
        }.items():
            patch.setenv(name, value)
        # What another module's server held, and who knows its address, would come along.
        requests.post(f"http://{host}:{port}/moto-api/reset", timeout=60).raise_for_status()
        fsspec.get_filesystem_class("s3").clear_instance_cache()
        fsspec.filesystem("s3", use_listings_cache=False).mkdir("motionary-test")
        yield "s3://motionary-test"
    server.stop()


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

    monkeypatch.delenv("COLUMNS", raising=False)  # what shares the tests out sets it

    def call(*arguments: object, binary: bool = False):
        monkeypatch.setattr(sys, "argv", ["motionary", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        out, err = capfdbinary.readouterr()
        return stop.value.code, out if binary else out.decode(), err.decode()

    return call


@pytest.fixture(scope="session")
def publish_rows() -> Callable[..., Snapshot]:
    """Return a way of publishing a snapshot without a run: of tables that are empty but for rows given.

    `parts` names further, empty parts of `pairs`; a column that a row leaves out has any value of its type.
    """

    def publish_them(
        store: Store, made: str | None = None, parts: Iterable[str] = (), **rows: Sequence[dict]
    ) -> Snapshot:
        before = current_snapshot(store)
        tables: dict[str, list[str]] = {}
        facts: dict[str, PartFacts] = {}
        for name in PUBLISHED:
            keys = [f"of-{next_snapshot_id(store)}" if name in rows else "none"]
            for key in [*keys, *(parts if name == "pairs" else ())]:
                file = store.part_name(name, key)
                if store.stored(key, [name]) is None:
                    filled = [_filled(name, row) for row in rows.get(name, ())]
                    store.save(key, {name: pa.Table.from_pylist(filled, SCHEMAS[name])})
                facts[file] = store.facts(file)
                tables.setdefault(name, []).append(file)
        made = made or datetime.now(UTC).isoformat()
        snapshot = Snapshot(next_snapshot_id(store), made, tables, facts)
        publish(store, snapshot, before)
        return replace(snapshot, after=before.snapshot_id if before else None)

    return publish_them


def _filled(name: str, row: dict) -> dict:
    """Complete a row."""
    text, moment, nothing = "", datetime(2020, 1, 1, tzinfo=UTC), {"joints": [], "parents": [], "offsets": []}
    usual: dict[str, object] = {"string": text, "bool": False, "timestamp[us, tz=UTC]": moment}
    filled = {}
    for field in SCHEMAS[name]:
        number = 0 if pa.types.is_integer(field.type) or pa.types.is_floating(field.type) else []
        value = nothing if pa.types.is_struct(field.type) else usual.get(str(field.type), number)
        filled[field.name] = row.get(field.name, None if field.nullable else value)
    return filled
