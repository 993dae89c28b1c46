"""One run of the main job on an embedded library, measured from outside.

The run is the command line in a process of its own, with a fresh catalog; what it is asked beside the library
is the route. What was measured is kept beside the catalog, and is read from there when it is asked again.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO

from motionary.catalog import Catalog
from motionary.pipeline.layout import digest_of_settings
from motionary.pipeline.synthetic import write_library
from motionary.workflows.workplace import software
from tests.benchmarks.process_tree import TreePeak, watched
from tests.benchmarks.scale_kernel import kernel_seconds_a_pair
from tests.torture.world import PROGRAM, motionary


@dataclass(frozen=True)
class Route:
    """A way through a library.

    Parameters
    ----------
    name : str
        In the report, and in the catalog's folder.
    arguments : tuple of str
        Of `motionary run`, beside library, catalog, labels and workers.
    """

    name: str = "all pairs"
    arguments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Measured:
    """What a run took.

    Parameters
    ----------
    route : Route
    clips, pairs_computed, clusters : int
        As the run's record says.
    frames, merged_frames : int
        Of the whole library at the common rate, and with those of low motion merged.
    workers : int
        Processes.
    seconds : float
        From the command's start to its end.
    stages : dict of float
        Seconds of work of every stage, summed over the workers.
    peak : TreePeak
        Of the command's process and all that it starts.
    library : int
        Bytes of the library's motions.
    tables : dict of int
        Bytes by table.
    kernel : float
        Seconds that the kernel alone takes for a pair, timed right after the run by as many processes.
    foretold : dict, optional
        What `motionary plan --json` said before the run.
    """

    route: Route
    clips: int
    pairs_computed: int
    clusters: int
    frames: int
    merged_frames: int
    workers: int
    seconds: float
    stages: dict[str, float]
    peak: TreePeak
    library: int
    tables: dict[str, int]
    kernel: float
    foretold: dict | None

    @property
    def kernel_ratio(self) -> float:
        """Seconds that comparing took a pair, over those of the kernel alone."""
        return self.stages["compare"] / self.pairs_computed / self.kernel

    @property
    def disk(self) -> int:
        """Bytes of the catalog's tables."""
        return sum(self.tables.values())


def measured_run(
    folder: Path, route: Route, clips: int, workers: int, say: Callable[[str], object]
) -> Measured:
    """Measure a run, or read what was measured before.

    Parameters
    ----------
    folder : Path
        Where libraries, catalogs and measurements are kept.
    route : Route
    clips, workers : int
    say : callable
        Told what is being done.
    """
    name = f"{'-'.join(route.name.split())}-{clips}-by-{workers}"
    # What is measured depends on these: a measurement of other arguments or sources is another.
    about = digest_of_settings(route.arguments, software())
    kept = folder / f"{name}-{about[:8]}.json"
    if kept.exists():
        say(f"{clips:,} clips, {route.name}: measured before ({kept})")
        return _from_json(kept.read_text())
    library, catalog = embedded_library(folder, clips, workers, say), folder / f"catalog-{name}"
    shutil.rmtree(catalog, ignore_errors=True)
    given = [str(library), str(catalog), "--labels", str(library / "labels.csv")]
    given += ["--workers", str(workers), *route.arguments]
    foretold = _foretold(given)
    say(f"{clips:,} clips, {route.name}: motionary run {' '.join(given)}")
    with (folder / f"{name}.log").open("w") as log:
        seconds, peak = _watched_run(["run", *given], log)
    say(f"{clips:,} clips, {route.name}: the kernel alone")
    found = Measured(
        route=route, workers=workers, seconds=seconds, peak=peak, foretold=foretold,
        kernel=kernel_seconds_a_pair(catalog, workers), **_of_catalog(catalog),
        library=sum(file.stat().st_size for file in library.rglob("*.bvh")),
        tables=bytes_by_table(catalog),
    )  # fmt: skip
    kept.write_text(json.dumps(asdict(found), indent=1) + "\n")
    return found


def embedded_library(folder: Path, clips: int, workers: int, say: Callable[[str], object]) -> Path:
    """Return an embedded library of so many clips, written where it is not there."""
    library = folder / f"library-{clips}"
    if not (library / "labels.csv").exists():
        say(f"{clips:,} clips: writing {library}")
        write_library(library, clips=clips, processes=workers)
    return library


def bytes_by_table(catalog: Path) -> dict[str, int]:
    """Add up the files of every table of a catalog."""
    return {
        table.name: sum(file.stat().st_size for file in table.rglob("*") if file.is_file())
        for table in sorted((catalog / "tables").iterdir())
    }


def _watched_run(arguments: list[str], log: IO[str]) -> tuple[float, TreePeak]:
    start = time.perf_counter()
    process = subprocess.Popen([*PROGRAM, *arguments], stdout=log, stderr=subprocess.STDOUT, env=os.environ)
    try:
        with watched(process.pid) as watch:
            code = process.wait()
    finally:
        process.kill()
    if code:
        raise RuntimeError(f"motionary {' '.join(arguments)} ended with {code}; {log.name} says why")
    return time.perf_counter() - start, watch.peak


def _foretold(arguments: list[str]) -> dict:
    told = motionary("plan", *arguments, "--json")
    if told.returncode:
        raise RuntimeError(
            f"motionary plan {' '.join(arguments)} ended with {told.returncode}: {told.stderr}"
        )
    return json.loads(told.stdout)


def _of_catalog(catalog: Path) -> dict[str, int | dict[str, float]]:
    with Catalog.open(str(catalog)) as opened:
        run = opened.runs.to_arrow().to_pylist()[-1]
        counted = opened.sql(
            "select count(*) as merged, sum(last_frame - first_frame + 1) as frames from resampled"
        )
        (frames,) = counted.to_pylist()
    return {
        "clips": run["clips"],
        "pairs_computed": run["pairs_computed"],
        "clusters": run["clusters"],
        "frames": int(frames["frames"]),
        "merged_frames": frames["merged"],
        "stages": dict(run["stage_seconds"]),
    }


def _from_json(text: str) -> Measured:
    values = json.loads(text)
    route = Route(values["route"]["name"], tuple(values["route"]["arguments"]))
    return Measured(**values | {"route": route, "peak": TreePeak(**values["peak"])})
