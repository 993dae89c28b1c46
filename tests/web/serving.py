"""The application on a real server of this machine, and catalogs to be changed."""

import csv
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import uvicorn

from motionary.catalog.web.access import Guard
from motionary.catalog.web.app import create_app
from motionary.catalog.web.desk import Editor
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.browse import LabelEditor
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from tests.catalogs import copied


@contextmanager
def served(
    url: str,
    *,
    guard: Guard | None = None,
    editor: Editor | None = None,
) -> Iterator[httpx.Client]:
    """Serve a catalog on a free port; gives a client that asks as a page of it does."""
    listening = socket.create_server(("127.0.0.1", 0))
    app = create_app(url, guard=guard or Guard(), editor=editor)
    server = uvicorn.Server(uvicorn.Config(app, log_level="critical", ws="none", timeout_graceful_shutdown=5))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    base = f"http://127.0.0.1:{listening.getsockname()[1]}"
    try:
        with httpx.Client(base_url=base, headers={"Origin": base}, timeout=60) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join()
        listening.close()


def editor_of(url: str, user: str = "ada") -> LabelEditor:
    """Return what publishes labels, as the command has it."""
    return LabelEditor(url, user, lambda dead: None)


def with_mistakes(library: Path, catalog: str, folder: Path, progress: Callable) -> str:
    """Copy the embedded library's catalog and run it again with six labels exchanged; return its URL."""
    url = copied(catalog, folder)
    with (library / "labels.csv").open() as file:
        rows = list(csv.DictReader(file))
    actions = [row["action"] for row in rows]
    for row in rows:
        row["path"] = str(library / row["path"])
    for number in (0, 11, 22, 33, 44, 55):
        rows[number]["action"] = actions[(number + 25) % len(rows)]
    with (folder / "labels.csv").open("w") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    run(Job([str(library)], url, PipelineConfig(), folder / "labels.csv"), progress)
    return url


def tree(catalog: str) -> dict[str, bytes]:
    """Return every file of a catalog, but for the leases that readers take."""
    return {
        str(file.relative_to(catalog)): file.read_bytes()
        for file in sorted(Path(catalog).rglob("*"))
        if file.is_file() and file.parent.name != "leases"
    }
