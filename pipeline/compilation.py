"""Compiled kernels: made once on a machine before a job needs them, and never older than their sources.

Numba keeps the machine code of a kernel beside its source, or where NUMBA_CACHE_DIR says, or in the user's
cache folder. What it leaves to its users is done here:

- Processes that compile at the same time can spoil that cache. An index is read, added to and replaced, and
  the code is written after it; two processes that add different signatures of one kernel both name their
  code number 1, and the index of one comes to stand over the code of the other (numba issues 4807, 9348).
  So one process compiles all kernels, and a lock in the cache folder keeps others out meanwhile.
- A kernel's code counts as fresh while its own file has the same content. The kernels that are inlined into
  it may have changed, in a checkout and after an upgrade alike. So what was compiled from other sources is
  thrown away, all of it, before anything is loaded.

A mark in each cache folder says that every kernel of these very sources is there for this processor.
"""

from __future__ import annotations

import hashlib
import os
import platform
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MODULES = (
    "motionary.pipeline.alignment.agreement_kernels",
    "motionary.pipeline.alignment.banded_kernels",
    "motionary.pipeline.alignment.correlation_kernels",
    "motionary.pipeline.alignment.cotw_kernels",
    "motionary.pipeline.alignment.limited_kernels",
    "motionary.pipeline.alignment.online_kernels",
    "motionary.pipeline.alignment.whole_output_kernels",
    "motionary.pipeline.clustering.linkage_kernels",
    "motionary.pipeline.distances.pairwise",
)
"""Modules that name kernels of the commands, at least one of each folder that holds some."""

_LOCK = "motionary-kernels.lock"
_PATIENCE = 600.0  # seconds to wait for another process, which needs some twenty
_NO_CACHE = 75  # exit status: what is written to stderr is for people


class KernelCacheError(RuntimeError):
    """Compiled kernels cannot be kept; the message says what to do."""


@dataclass(frozen=True)
class KernelCache:
    """Where compiled kernels are kept, and whether all of them are there, of these very sources."""

    folders: Sequence[Path]
    compiled: bool


def kernel_cache() -> KernelCache:
    """Look for the compiled kernels.

    Raises
    ------
    KernelCacheError
        No folder can be written in which numba could keep the code.
    """
    folders = _cache_folders()
    return KernelCache(folders, _compiled(folders))


def compile_kernels(announce: Callable[[], object]) -> None:
    """Compile every kernel that a command calls, unless that has been done on this machine.

    The work is done by a process of its own: this one may have loaded code of older sources already.

    Parameters
    ----------
    announce : callable
        Called before a compilation, which takes about a minute.

    Raises
    ------
    KernelCacheError
        No folder can be written in which numba could keep the code, or another process has held the lock for
        ten minutes.
    RuntimeError
        The compilation failed; the message is its traceback.
    """
    if _compiled(_cache_folders()):
        return
    announce()
    done = subprocess.run(
        # Modules are looked for where this process found them: a folder `motionary` where the user stands,
        # such as a clone, holds others.
        [sys.executable, "-P", "-m", "motionary.pipeline.compilation"],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(one or str(Path.cwd()) for one in sys.path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode == _NO_CACHE:
        raise KernelCacheError(done.stderr.strip())
    if done.returncode:
        raise RuntimeError(f"the kernels could not be compiled:\n{done.stderr}")


def _compile_in_this_process() -> None:
    folders = _cache_folders()
    with _locked(folders[0], _PATIENCE):
        if _compiled(folders):
            return
        _discard_stale(folders)
        _call_every_kernel()
        for folder in folders:
            (folder / _mark()).write_text(_sources())


def _call_every_kernel() -> None:
    """Call what commands call, with their types: features float32, rotations and distances float64."""
    from motionary.pipeline.alignment import cotw, cotw_search
    from motionary.pipeline.alignment.registry import ALIGNERS
    from motionary.pipeline.clustering import complete_linkage, nearest_neighbour_graph, ward_linkage
    from motionary.pipeline.clustering.condensed_kernels import first_repeated
    from motionary.pipeline.clustering.sparse_linkage import complete_linkage_under
    from motionary.pipeline.distances import compare_clips, pairwise_distances
    from motionary.pipeline.distances.explain import explain_pair, feature_parts
    from motionary.pipeline.distances.nearest import nearest_clips, pack_library
    from motionary.pipeline.distances.pruned import pairwise_under
    from motionary.pipeline.distances.subsequence import find_occurrences, pack_takes

    random = np.random.default_rng(0)
    clips = [random.random((10, 59), dtype=np.float32) for _ in range(3)]
    pairs = pairwise_distances(clips, n_jobs=1)
    compare_clips(clips[:2], clips[2:])
    nearest_clips(clips[0], pack_library(clips))
    explain_pair(clips[0], clips[1], feature_parts("pose+travel"))
    find_occurrences(clips[0], pack_takes(clips), 1)
    pairwise_under(clips, mu=1.0)
    near = np.array([0, 0]), np.array([1, 2]), pairs.weighted[:2].astype(np.float32)
    complete_linkage_under(3, lambda: [near])
    for values in (pairs.weighted, pairs.weighted.astype(np.float32)):
        complete_linkage(values)
        nearest_neighbour_graph(values)
    ward_linkage(pairs.weighted)
    first_repeated(np.zeros(1, np.uint8), np.zeros(1, np.int64))
    cotw(clips[0], clips[1], segment_length=5, slack=1)
    # Long enough for a coarse version and its refinement.
    moving, reference = (random.random((frames, 59), dtype=np.float32) for frames in (30, 100))
    cotw_search(moving, reference, effort="fast")
    quaternions = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (9, 2, 4))
    read: dict[str, NDArray[Any]] = {
        "features": clips[0],
        "postures": clips[0].astype(np.float64),
        "rotations": quaternions,
    }
    for aligner in ALIGNERS.values():
        aligner.align(read[aligner.reads], read[aligner.reads])


@cache
def _kernels() -> list[Any]:
    """Load the kernels' modules and return the kernels that they name.

    Raises
    ------
    KernelCacheError
        Numba refuses, since it finds no folder for their code.
    """
    from numba.extending import is_jitted

    try:
        modules = [import_module(name) for name in _MODULES]
    except RuntimeError as error:
        if "cannot cache" not in str(error):
            raise
        raise KernelCacheError(
            f"{platform.node()} has no folder in which compiled kernels could be kept: the installation, the "
            "user's cache folder and NUMBA_CACHE_DIR cannot be written; set NUMBA_CACHE_DIR to one that can"
        ) from error
    return [value for module in modules for value in vars(module).values() if is_jitted(value)]


def _cache_folders() -> list[Path]:
    """Return where numba keeps the kernels' code."""
    return sorted({Path(kernel.stats.cache_path) for kernel in _kernels()})


@cache
def _sources() -> str:
    """Return a digest of the numba version and of every source in the kernels' folders."""
    import numba

    digest = hashlib.blake2b(numba.__version__.encode(), digest_size=16)
    for folder in sorted({Path(kernel.py_func.__code__.co_filename).parent for kernel in _kernels()}):
        for file in sorted(folder.glob("*.py")):
            digest.update(f"{folder.name}/{file.name}".encode())
            digest.update(hashlib.blake2b(file.read_bytes()).digest())
    return digest.hexdigest()


@cache
def _mark() -> str:
    """Name the mark of this Python and this processor; several may share a cache folder."""
    from numba.core.registry import cpu_target

    target = repr((sys.implementation.cache_tag, cpu_target.target_context.codegen().magic_tuple()))
    return f"motionary-{hashlib.blake2b(target.encode(), digest_size=6).hexdigest()}.compiled"


def _compiled(folders: Sequence[Path]) -> bool:
    return all(_content(folder / _mark()) == _sources() for folder in folders)


def _discard_stale(folders: Sequence[Path]) -> None:
    """Remove all code from the folders in which some is of other sources, or of who knows which."""
    for folder in folders:
        marks = list(folder.glob("motionary-*.compiled"))
        if not marks or any(_content(mark) != _sources() for mark in marks):
            for file in (*folder.glob("*.nbi"), *folder.glob("*.nbc"), *marks):
                file.unlink(missing_ok=True)


def _content(file: Path) -> str | None:
    try:
        return file.read_text()
    except FileNotFoundError:
        return None


@contextmanager
def _locked(folder: Path, patience: float) -> Iterator[None]:
    """Hold a lock that ends with this process, however it ends: that of an SQLite file with nothing in it."""
    with closing(sqlite3.connect(folder / _LOCK, timeout=patience, isolation_level=None)) as lock:
        try:
            lock.execute("begin exclusive")
        except sqlite3.OperationalError as error:
            raise KernelCacheError(
                f"cannot lock {folder / _LOCK} ({error}): another process is compiling there, or the file "
                "system knows no locks; end that process, or set NUMBA_CACHE_DIR to a folder of a local disk"
            ) from error
        yield


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends this at once, even where workers ignore it
    try:
        _compile_in_this_process()
    except KernelCacheError as error:
        print(error, file=sys.stderr)
        sys.exit(_NO_CACHE)
