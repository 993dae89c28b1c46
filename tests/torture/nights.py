"""Nights over a library: what a run costs when nothing, or little, is new, beside the first."""

from __future__ import annotations

import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from motionary.catalog import Catalog
from motionary.pipeline.synthetic import write_library
from tests.torture.world import motionary

CLIPS, NEW = 270, 10
BOUNDS = {"unchanged": 0.05, f"{NEW} new clips": 0.15}
"""The most of the first run's time that a later one may take."""


@dataclass(frozen=True)
class Night:
    """One run.

    Parameters
    ----------
    process : float
        Seconds from the command's start to its end.
    run : float
        Seconds that the run records: without starting Python and printing.
    read, compared : int
        Clips read and pairs computed.
    """

    process: float
    run: float
    read: int
    compared: int


def nights(work: Path) -> dict[str, Night]:
    """Run on a library of embedded clips, again unchanged, and with some clips more."""
    library, catalog, spare = work / "library", work / "catalog", work / "spare"
    for seed in range((CLIPS + NEW) // 80 + 1):
        write_library(spare / str(seed), seed=seed)
    clips = sorted(spare.rglob("*.bvh"), key=lambda path: path.name)[: CLIPS + NEW]
    coming = clips[:: len(clips) // NEW][:NEW]
    for path in set(clips) - set(coming):
        _add(path, spare, library)
    time.sleep(3)  # until the files' times tell that they were not touched
    found = {"first": _night(library, catalog), "unchanged": _night(library, catalog)}
    for path in coming:
        _add(path, spare, library)
    return found | {f"{NEW} new clips": _night(library, catalog)}


def print_nights(found: Mapping[str, Night]) -> int:
    """Print what each run took beside the first; return how many computed what they need not have.

    The shares of time are printed and not judged: they are the machine's of the moment.
    """
    first = found["first"]
    titles = ("process, s", "of first", "run, s", "of first", "read", "compared")
    print(" " * 14 + "".join(f"{title:>11}" for title in titles))
    for name, night in found.items():
        print(
            f"{name:14}{night.process:11.1f}{night.process / first.process:11.1%}{night.run:11.1f}"
            f"{night.run / first.run:11.1%}{night.read:11}{night.compared:11}"
        )
    print(", ".join(f"{name}: wanted under {bound:.0%}" for name, bound in BOUNDS.items()))
    expected = {
        "first": (CLIPS, CLIPS * (CLIPS - 1) // 2),
        "unchanged": (0, 0),
        f"{NEW} new clips": (NEW, NEW * CLIPS + NEW * (NEW - 1) // 2),
    }
    return sum((found[name].read, found[name].compared) != counts for name, counts in expected.items())


def _night(library: Path, catalog: Path) -> Night:
    start = time.monotonic()
    done = motionary("run", str(library), str(catalog))
    process = time.monotonic() - start
    if done.returncode:
        raise RuntimeError(done.stderr)
    run = Catalog.open(str(catalog)).runs.to_arrow().to_pylist()[-1]
    seconds = (run["finished_at"] - run["started_at"]).total_seconds()
    return Night(process, seconds, run["clips_read"], run["pairs_computed"])


def _add(path: Path, spare: Path, library: Path) -> None:
    there = library / path.relative_to(spare)
    there.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(path, there)
