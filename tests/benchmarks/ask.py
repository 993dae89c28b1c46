"""`make bench-ask`: how fast a catalog answers, and how that grows with the number of clips.

From the project's root: `python -m tests.benchmarks.ask`. The catalogs are of embedded clips, each made by
the main job where it is not there from before; that of 10,000 clips takes some ten minutes. Exits with 0,
also where a figure is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median

from rich.console import Console

from motionary.catalog import Catalog, CatalogError
from motionary.pipeline.distances.tiles import usable_processors
from motionary.pipeline.synthetic import write_library
from tests.benchmarks.alignment_report import Figure, as_row, print_figures
from tests.benchmarks.machine import describe_machine
from tests.benchmarks.tables import WIDTH
from tests.torture.world import motionary

SIZES, QUICK_SIZES = (300, 1_000, 3_000, 10_000), (80,)
ROUNDS = 9
UNSEEN = 99_999
"""The seed of the files that no catalog holds."""
PATTERN = "(?P<action>[a-z]+)_(?P<style>[a-z]+)_(?P<subject>[a-z]+)_"

QUESTIONS = {
    "names counted": "select label, count(*) as clips from clusters group by label order by clips desc",
    "tired walks over 2 s": "select clip_id, seconds from takes "
    "where label = 'walk' and style = 'tired' and seconds > 2 order by clip_id",
    "clips by subject and style": "select subject, style, avg(seconds) from clips group by all order by all",
}
# What a catalog of this many clips has to reach, in seconds, and files a second.
BOUND_SIZE, SQL_BOUND, CLIP_BOUND, FILE_BOUND, ASSIGN_BOUND = 10_000, 0.050, 0.100, 2.0, 10.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    options = _parser().parse_args(arguments)
    sizes = QUICK_SIZES if options.quick else options.sizes
    files = _unseen(options.folder)
    figures = [figure for size in sizes for figure in _measured(_made(options.folder, size), size, files)]
    machine = describe_machine(set(range(usable_processors())))
    record = {"machine": machine, "quick": options.quick, "figures": [as_row(one) for one in figures]}
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    print_figures(record, Console(width=WIDTH), "warm, all cores; medians")
    _say(f"all samples: {options.json}")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.ask", description=__doc__)
    parser.add_argument("--json", type=Path, default=Path("motionary-bench/ask.json"), help="the record")
    parser.add_argument(
        "--folder",
        type=Path,
        default=Path("motionary-bench/ask"),
        help="of libraries and catalogs, kept",
    )
    parser.add_argument(
        "--sizes",
        type=lambda text: [int(one) for one in text.split(",")],
        default=SIZES,
        help="clips, as 300,1000",
    )
    parser.add_argument("--quick", action="store_true", help="80 clips: does it run at all?")
    return parser


def _measured(url: str, size: int, files: Sequence[Path]) -> Iterator[Figure]:
    """Ask a catalog everything, once to warm it and then again and again."""
    _say(f"{size:,} clips: asking")
    bound = size >= BOUND_SIZE

    def milliseconds(what: str, ask: Callable[[int], object], most: float) -> Figure:
        samples = _timed(ask)
        what = f"{size:,} clips: {what}, ms"
        return Figure(what, 1e3 * median(samples), ".1f", 1e3 * most if bound else None, samples=samples)

    start = time.perf_counter()
    with Catalog.open(url) as catalog:
        clips = catalog.sample(ROUNDS + 1).clip_ids
        yield Figure(f"{size:,} clips: opened and its clips listed, s", time.perf_counter() - start)
        for what, query in QUESTIONS.items():
            yield milliseconds(f"SQL, {what}", lambda _, query=query: catalog.sql(query), SQL_BOUND)
        yield milliseconds("similar to one of them", lambda i: catalog.similar(clips[i]), CLIP_BOUND)
        yield milliseconds("similar to a new file", lambda i: catalog.similar(files[i]), FILE_BOUND)
        found = [catalog.similar(file) for file in files]
        pruned = sum(one.pruned for one in found) / (len(found) * len(catalog.clips))
        yield Figure(f"{size:,} clips: comparisons that bounds spared it, %", 100 * pruned, ".1f")
        samples = _timed(lambda _: catalog.assign(files))
        rate = len(files) / median(samples)
        least = ASSIGN_BOUND if bound else None
        yield Figure(
            f"{size:,} clips: files assigned a second", rate, ".1f", least, at_least=True, samples=samples
        )


def _timed(ask: Callable[[int], object]) -> list[float]:
    """Return how long it takes, once warm, in seconds; each round is asked about another clip."""
    ask(0)
    samples = []
    for number in range(1, ROUNDS + 1):
        start = time.perf_counter()
        ask(number)
        samples.append(time.perf_counter() - start)
    return samples


def _made(folder: Path, size: int) -> str:
    """Return a catalog of so many embedded clips; the main job makes it, or goes on where it was stopped."""
    library, catalog = folder / f"library-{size}", folder / f"catalog-{size}"
    try:
        with Catalog.open(catalog):
            return str(catalog)
    except CatalogError:
        _say(f"{size:,} clips: making the catalog {catalog}")
    write_library(library, clips=size)
    done = motionary("run", str(library), str(catalog), "--label-pattern", PATTERN)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return str(catalog)


def _unseen(folder: Path) -> list[Path]:
    """Write files that are in none of the libraries."""
    write_library(folder / "unseen", seed=UNSEEN)
    files = sorted((folder / "unseen").rglob("*.bvh"))
    return files[:: len(files) // (ROUNDS + 1)][: ROUNDS + 1]


def _say(step: str) -> None:
    print(step, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
