"""How many pairs the bounds on the weighted distance spare complete linkage at mu, and what that saves.

From the project's root: `python -m tests.benchmarks.pruning`, with `--catalog FOLDER` for clips of a catalog,
as often as wanted. Exits with 1 where a pruned comparison finds other pairs or other bits than the full one.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from motionary.catalog import Catalog
from motionary.pipeline.clustering import complete_linkage, strip_of
from motionary.pipeline.distances import PairwiseDistances, pairwise_distances
from motionary.pipeline.distances.pruned import PairsUnder, pairwise_under
from motionary.pipeline.features import motion_features
from motionary.pipeline.synthetic import synthetic_library
from tests.benchmarks.clips import Clip, spread
from tests.benchmarks.machine import describe_machine, held_to_one_core, one_thread
from tests.benchmarks.tables import WIDTH

SIZES, QUICK_SIZES = (80, 320, 1_000), (40,)
QUANTILES = (0.25, 0.5, 0.75)
BOUNDS = ("by_boxes", "by_low", "by_profile", "by_sum")
FIELDS = ("dtw", "b_dtw", "curve", "weighted", "fuzzy_low", "fuzzy_high")
# Actions and styles of the embedded library, of which it makes any number of takes.
KINDS = 40


@dataclass(frozen=True, eq=False)
class Library:
    """Clips and their classes; None where a clip has none."""

    name: str
    clips: list[Clip]
    classes: list[str | None]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    options = _parser().parse_args(arguments)
    rows = []
    with held_to_one_core() as cores:
        for library in _libraries(options):
            _say(f"{library.name}: {len(library.clips):,} clips")
            rows += _measured(library)
    record = {"machine": describe_machine(cores), "quick": options.quick, "rows": rows}
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    _print(record, Console(width=WIDTH))
    _say(f"all figures: {options.json}")
    return 0 if all(row["same"] for row in rows) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.pruning", description=__doc__)
    parser.add_argument("--json", type=Path, default=Path("motionary-bench/pruning.json"), help="the record")
    parser.add_argument("--catalog", type=Path, action="append", default=[], help="one to take clips of")
    parser.add_argument("--most", type=int, default=1_000, help="clips of a catalog, spread over it")
    parser.add_argument("--quick", action="store_true", help="40 embedded clips: does it run at all?")
    return parser


def _libraries(options: argparse.Namespace) -> Iterator[Library]:
    for size in QUICK_SIZES if options.quick else SIZES:
        takes = spread(synthetic_library(takes=-(-size // KINDS)), size)
        yield Library(
            "embedded", [motion_features(take.motion) for take in takes], [take.action for take in takes]
        )
    for folder in options.catalog:
        if not folder.is_dir():
            _say(f"{folder} is left out: there is no such folder")
            continue
        yield _of_catalog(folder, options.most)


def _of_catalog(folder: Path, most: int) -> Library:
    with Catalog.open(str(folder)) as catalog:
        known = catalog.sql("select clip_id, action from clips order by clip_id").to_pylist()
        chosen = spread(known, most)
        ids = [row["clip_id"] for row in chosen]
        frames = catalog.sql(
            "select clip_id, list(feature order by frame) as frames from resampled "
            "where list_contains($ids, clip_id) group by clip_id order by clip_id",
            {"ids": ids},
        )
    clips = [np.array(one, dtype=np.float32) for one in frames["frames"].to_pylist()]
    return Library(folder.parent.name, clips, [row["action"] for row in chosen])


def _measured(library: Library) -> Iterator[dict]:
    """Compare a library in full, then by every mu."""
    few = library.clips[:2]
    pairwise_distances(few, n_jobs=1)
    pairwise_under(few, 1.0)
    start = time.perf_counter()
    full = pairwise_distances(library.clips, n_jobs=1)
    whole = time.perf_counter() - start
    for what, mu in _thresholds(library, full):
        start = time.perf_counter()
        found = pairwise_under(library.clips, mu)
        seconds = time.perf_counter() - start
        pairs = found.pruning.pairs
        yield {
            "library": library.name,
            "clips": len(library.clips),
            "mu_is": what,
            "mu": mu,
            "under": len(found.first) / pairs,
            **{bound: getattr(found.pruning, bound) / pairs for bound in BOUNDS},
            "whole": found.pruning.whole / pairs,
            "seconds": seconds,
            "seconds_in_full": whole,
            "pruning": asdict(found.pruning),
            "same": _same(found, full, len(library.clips), mu),
        }


def _thresholds(library: Library, full: PairwiseDistances) -> Iterator[tuple[str, float]]:
    """Quantiles of the distances inside classes, and the middle of the strip of the true kappa."""
    classes = np.array([name or "" for name in library.classes])
    i, j = np.triu_indices(len(classes), 1)
    within = full.weighted[(classes[i] == classes[j]) & (classes[i] != "")]
    if not len(within):
        _say(f"{library.name} is left out: no two of its clips have one action")
        return
    for quantile in QUANTILES:
        yield f"{100 * quantile:.0f} % of classes", float(np.quantile(within, quantile))
    kappa = len(set(classes) - {""})
    yield f"true kappa, {kappa}", strip_of(complete_linkage(full.weighted), kappa).mu


def _same(found: PairsUnder, full: PairwiseDistances, clips: int, mu: float) -> bool:
    kept: NDArray[np.bool_] = full.weighted.astype(np.float32).astype(np.float64) <= mu
    i, j = np.triu_indices(clips, 1)
    return (
        np.array_equal(found.first, i[kept])
        and np.array_equal(found.second, j[kept])
        and all(np.array_equal(getattr(found.distances, name), getattr(full, name)[kept]) for name in FIELDS)
    )


def _print(record: dict, console: Console) -> None:
    if record["quick"]:
        console.print("A quick run, to see that it runs: its figures mean nothing.", highlight=False)
    machine = record["machine"]
    console.print(f"{machine['processor']}, one thread; shares of all pairs in %", highlight=False)
    table = Table(title="Pairs refused by each bound, and time")
    columns = (
        "clips",
        "mu",
        "",
        "under",
        "boxes",
        "least",
        "profile",
        "sum",
        "whole",
        "s",
        "in full",
        "faster",
    )
    for column in columns:
        table.add_column(column, justify="left" if column in ("clips", "") else "right")
    for row in record["rows"]:
        shares = [100 * row[name] for name in ("under", *BOUNDS, "whole")]
        table.add_row(
            f"{row['clips']:,} {row['library']}",
            f"{row['mu']:.3f}",
            row["mu_is"],
            *(f"{share:.1f}" for share in shares),
            f"{row['seconds']:.2f}",
            f"{row['seconds_in_full']:.2f}",
            f"{row['seconds_in_full'] / row['seconds']:.1f}" if row["same"] else "OTHER BITS",
        )
    console.print(table)


def _say(step: str) -> None:
    print(step, file=sys.stderr, flush=True)


if __name__ == "__main__":
    # The numerical libraries read these when they are loaded, so the program starts over with them set.
    alone = one_thread(os.environ)
    if alone != dict(os.environ):
        os.execve(sys.executable, [sys.executable, "-m", "tests.benchmarks.pruning", *sys.argv[1:]], alone)
    sys.exit(main())
