"""Runs in forked copies of this process: everything is imported once, and a run starts at once.

The process that forks stays without threads: whatever starts some (Dask, Arrow, DuckDB) happens in a child.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import dask
import duckdb  # noqa: F401
import plotly.graph_objects  # noqa: F401

import motionary.catalog.vacuum
import motionary.catalog.verify
import motionary.catalog.views.overview
import motionary.workflows.main_job
import motionary.workflows.progress
import motionary.workflows.summary  # noqa: F401
from motionary.pipeline.compilation import compile_kernels
from motionary.workflows import cli

Result = TypeVar("Result")

_PATIENCE = 600.0
"""Seconds after which a child hangs."""


def warm_up(work: Path) -> None:
    """Compile the kernels where they are not kept yet, and have Dask's own files in the folder to work in."""
    dask.config.set({"temporary_directory": str(work / "dask")})
    call(lambda: compile_kernels(lambda: None))


def call(function: Callable[[], Result]) -> Result:
    """Call a function in a child and return what it returns.

    Raises
    ------
    RuntimeError
        It raised something, or the child died.
    """
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        with os.fdopen(write_end, "wb") as out:
            try:
                pickle.dump((function(), None), out)
            except BaseException:
                pickle.dump((None, traceback.format_exc()), out)
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as answer:
        content = answer.read()
    _, status = os.waitpid(child, 0)
    if not content:
        raise RuntimeError(f"a child died: {os.waitstatus_to_exitcode(status)}")
    result, error = pickle.loads(content)
    if error:
        raise RuntimeError(error)
    return result


def start(arguments: list[str], log: Path, before: Callable[[], object] = lambda: None) -> int:
    """Start the command line in a child, the leader of a process group of its own; return its number.

    `before` is called in the child first.
    """
    child = os.fork()
    if child:
        os.setpgid(child, child)  # here as well as there, so that it is so whoever comes first
        return child
    code = 1
    try:
        os.setpgid(0, 0)
        with log.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        # The parent may have put something else in their places, as pytest does.
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        before()
        code = run_here(arguments)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def run_here(arguments: list[str]) -> int:
    """Run the command line in this process and return its exit code."""
    sys.argv = ["motionary", *arguments]
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def wait(child: int, seconds: float = _PATIENCE) -> int | None:
    """Wait for a child's end and return its exit code, below 0 for a signal; None if it goes on."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(min(0.002, left))
    return None


def kill(child: int) -> None:
    """Kill a child that leads a process group, and its group."""
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    wait_for_group(child)


def wait_for_group(leader: int) -> None:
    """Give the other processes of a killed group the moment that they need to be gone."""
    for _ in range(200):
        try:
            os.killpg(leader, 0)
        except ProcessLookupError:
            return
        time.sleep(0.01)
