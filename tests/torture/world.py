"""What the parts of `make torture` share: small libraries, the command line, and what a catalog holds."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.schema import PUBLISHED
from motionary.pipeline.synthetic import write_library

PROGRAM = (sys.executable, "-c", "from motionary.workflows.cli import main; main()")
NOT_COMPARED = "runs"
"""The one table that may differ between two runs over the same library: it holds times."""


def embedded_library(folder: Path) -> Path:
    """Write the embedded library, unless it is there."""
    if not (folder / "labels.csv").exists():
        write_library(folder)
    return folder


def take_clips(source: Path, library: Path, count: int, skip: int = 0) -> list[str]:
    """Copy clips of the embedded library, spread over its actions, with its labels; return their paths."""
    chosen = spread(source)[skip : skip + count]
    for name in chosen:
        add_clip(source, library, name)
    shutil.copy(source / "labels.csv", library / "labels.csv")
    return chosen


def spread(source: Path) -> list[str]:
    """List the clips of a library such that any first few are of different actions."""
    by_action = [sorted(folder.glob("*.bvh")) for folder in sorted(source.iterdir()) if folder.is_dir()]
    longest = max(map(len, by_action))
    turns = [files[turn] for turn in range(longest) for files in by_action if turn < len(files)]
    return [str(path.relative_to(source)) for path in turns]


def add_clip(source: Path, library: Path, name: str, under: str | None = None) -> None:
    """Copy one clip, by default under its own name."""
    path = library / (under or name)
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(source / name, path)


def run_arguments(library: Path, catalog: Path, workers: int = 1) -> list[str]:
    """Return the arguments of `motionary run`."""
    given = ["--labels", str(library / "labels.csv"), "--workers", str(workers)]
    return ["run", str(library), str(catalog), *given]


def motionary(
    *arguments: str, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own."""
    return subprocess.run(
        [*PROGRAM, *arguments],
        text=True,
        capture_output=True,
        check=False,
        env={**os.environ, **(environment or {})},
    )


def linked_copy(catalog: Path, to: Path) -> Path:
    """Copy a catalog without copying its parts, which are never changed."""

    def copy(source: str, target: str) -> None:
        (os.link if source.endswith(".parquet") else shutil.copy2)(source, target)

    return Path(shutil.copytree(catalog, to, copy_function=copy))


def contents(catalog: Path) -> dict[str, pa.Table]:
    """Return every published table that two runs over the same library have in common."""
    with Catalog.open(str(catalog)) as opened:
        names = [name for name in PUBLISHED if name != NOT_COMPARED]
        return {name: opened.store.read(opened.files(name)) for name in names}


def differences(one: Mapping[str, pa.Table], other: Mapping[str, pa.Table]) -> Sequence[str]:
    """Name the tables that differ, each with its row counts."""
    return [
        f"{name} ({len(one[name])} and {len(other[name])} rows)"
        for name in one
        if name not in other or not one[name].equals(other[name])
    ]
