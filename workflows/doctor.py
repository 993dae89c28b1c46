"""Whether this machine can run the main job, and a catalog's folder hold what it makes.

Every finding is PASSED, FAILED with its mend, or a NOTE: worth knowing, and nothing to mend. Nothing is left
behind: what is tried in a folder is tried in temporary files.
"""

from __future__ import annotations

import platform
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from pathlib import Path
from typing import Literal

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

State = Literal["PASSED", "FAILED", "NOTE"]


@dataclass(frozen=True)
class Finding:
    """One line of the doctor's.

    Parameters
    ----------
    state : {"PASSED", "FAILED", "NOTE"}
    what : str
        What was looked at.
    detail : str
        What was seen.
    mend : str
        What to do about it, where it failed.
    """

    state: State
    what: str
    detail: str
    mend: str = ""


def examine(catalog: str | None = None) -> Iterator[Finding]:
    """Look at Python, packages, cores, memory and kernels; then at a catalog, if one is named.

    Parameters
    ----------
    catalog : str, optional
        Folder or fsspec URL; it need not be there yet.

    Yields
    ------
    Finding
        As soon as it is known. A look that crashes is a finding that failed.
    """
    looks: list[tuple[str, Callable[[], Iterator[Finding]]]] = [
        ("python", python_version),
        ("packages", package_versions),
        ("machine", machine),
        ("kernels", kernels),
    ]
    if catalog is not None:
        from motionary.workflows.doctor_catalog import looks_at

        looks += looks_at(catalog)
    for what, look in looks:
        try:
            yield from look()
        except Exception as error:  # whatever is broken here is what is to be told
            told = " ".join(f"{type(error).__name__}: {error}".split())
            yield Finding("FAILED", what, told, "mend what it names and ask again")


def python_version() -> Iterator[Finding]:
    """Compare Python with what the package asks for, which is what it is tested with."""
    wanted, here = metadata("motionary")["Requires-Python"], platform.python_version()
    if SpecifierSet(wanted).contains(here, prereleases=True):
        yield Finding("PASSED", "python", f"{here} ({wanted}) at {sys.executable}")
    else:
        mend = f"make an environment with Python {wanted}"
        yield Finding("FAILED", "python", f"{here} is not {wanted}", mend)


def package_versions() -> Iterator[Finding]:
    """Compare every package with the version that is asked for."""
    fits, wrong = [], []
    for line in requires("motionary") or []:
        wanted = Requirement(line)
        if wanted.marker and not wanted.marker.evaluate({"extra": ""}):
            continue
        try:
            here = version(wanted.name)
        except PackageNotFoundError:
            wrong.append((wanted, f"{wanted.name} is missing"))
            continue
        if wanted.specifier.contains(here, prereleases=True):
            fits.append(f"{wanted.name} {here}")
        else:
            wrong.append((wanted, f"{wanted.name} {here} is not {wanted.specifier}"))
    if wrong:
        detail = ", ".join(problem for _, problem in wrong)
        asked = " ".join(f'"{wanted.name}{wanted.specifier}"' for wanted, _ in wrong)
        yield Finding("FAILED", "packages", detail, f"pip install {asked}")
    else:
        yield Finding("PASSED", "packages", ", ".join(fits))


def machine() -> Iterator[Finding]:
    """Tell what a run may use: cores and memory, as far as a container is allowed them."""
    from dask.system import CPU_COUNT
    from distributed.system import MEMORY_LIMIT

    yield Finding(
        "NOTE",
        "machine",
        f"{CPU_COUNT} cores, {MEMORY_LIMIT / 2**30:.1f} GiB of memory; a run starts its own workers, "
        "no Dask scheduler is needed",
    )


def kernels() -> Iterator[Finding]:
    """Look whether compiled kernels can be kept, and are there."""
    from motionary.pipeline.compilation import KernelCacheError, kernel_cache

    try:
        cache = kernel_cache()
    except KernelCacheError as error:
        mend = "set NUMBA_CACHE_DIR to a folder that can be written"
        yield Finding("FAILED", "kernels", str(error), mend)
        return
    place = ", ".join(map(str, sorted({_above(folder) for folder in cache.folders})))
    if cache.compiled:
        yield Finding("PASSED", "kernels", f"compiled, in {place}")
    else:
        yield Finding("NOTE", "kernels", f"the next run compiles them first, into {place}")


def _above(folder: Path) -> Path:
    return folder.parent.parent if folder.name == "__pycache__" else folder.parent
