"""What the benchmarks run on, and how they are held to one thread of one core."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from threadpoolctl import threadpool_info

THREAD_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PACKAGES = ("motionary", "numpy", "scipy", "numba", "llvmlite")


def one_thread(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with every numerical library held to one thread."""
    return {**environment, **dict.fromkeys(THREAD_COUNTS, "1")}


def can_pin() -> bool:
    """Say whether a process can be held to a core here."""
    return hasattr(os, "sched_setaffinity")


@contextmanager
def held_to_one_core() -> Iterator[set[int]]:
    """Hold this thread, and the threads and processes it starts, to one core; give the set of all of them.

    Where the system cannot, nothing is held.
    """
    if not can_pin():
        yield set(range(os.cpu_count() or 1))
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield cores
    finally:
        os.sched_setaffinity(0, cores)


@contextmanager
def let_onto(cores: set[int]) -> Iterator[None]:
    """Let this thread, and those it starts, onto `cores` for a while."""
    if not can_pin():
        yield
        return
    held = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, held)


def describe_machine(cores: set[int]) -> dict[str, object]:
    """Name the processor, the cores, the system, Python, the packages and the BLAS in use."""
    return {
        "processor": _processor(),
        "cores": len(cores),
        "system": platform.platform(),
        "python": platform.python_version(),
        "packages": {name: version(name) for name in PACKAGES},
        "blas": [
            {key: str(pool.get(key)) for key in ("internal_api", "version", "architecture", "num_threads")}
            for pool in threadpool_info()
        ],
    }


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        for line in listing.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
