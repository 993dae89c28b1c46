"""`make torture`: what may happen to a catalog, on purpose and thousands of times.

From the project's root: `python -m tests.torture`, or one part of it: `fuzz`, `kill`, `readers`, `disk`,
`nights`. Exits with 1 where anything failed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.torture.disk import full_disk, print_disk
from tests.torture.fuzz import fuzz, print_tallies
from tests.torture.fuzz_motion import AMC, ASF, BVH
from tests.torture.fuzz_tables import CATALOG, LABELS, SETTINGS
from tests.torture.kill import Kills, plan, print_kills, run_kills, set_up
from tests.torture.nights import nights, print_nights
from tests.torture.readers import print_readers, readers_under_writing

KINDS = {kind.name: kind for kind in (BVH, ASF, AMC, LABELS, SETTINGS, CATALOG)}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all parts or one; return the exit code."""
    options = _parser().parse_args(arguments)
    parts = PARTS if options.part == "all" else {options.part: PARTS[options.part]}
    failed = 0
    for name, part in parts.items():
        print(f"\n== {name}", flush=True)
        started = time.monotonic()
        with tempfile.TemporaryDirectory(prefix=f"torture-{name}-", dir=options.work) as folder:
            failed += part(options, Path(folder))
        print(f"{time.monotonic() - started:.0f} s", flush=True)
    print(f"\n{'FAILED' if failed else 'PASSED'}: {failed} faults")
    return 1 if failed else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=__doc__)
    parser.add_argument("part", nargs="?", default="all", choices=["all", *PARTS])
    parser.add_argument("--cases", type=int, default=10_000, help="fuzz: damaged files")
    parser.add_argument("--only", choices=KINDS, help="fuzz: one kind of file")
    parser.add_argument(
        "--kills", type=int, default=200, help="kill: at random moments; all steps come on top"
    )
    parser.add_argument("--readers", type=int, default=8, help="readers: processes that query")
    parser.add_argument("--runs", type=int, default=20, help="readers: runs that publish meanwhile")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--work", type=Path, help="folder to work in (default: a temporary one)")
    return parser


def _fuzz(options: argparse.Namespace, work: Path) -> int:
    kinds = [KINDS[options.only]] if options.only else list(KINDS.values())
    return print_tallies(fuzz(kinds, options.cases, options.seed, work))


def _kill(options: argparse.Namespace, work: Path) -> int:
    scene = set_up(work)

    def show(done: int, kills: Kills) -> None:
        if done % 20 == 0:
            print(f"{done} kills, {len(kills.faults)} faults", file=sys.stderr, flush=True)

    found = run_kills(scene, plan(scene, options.kills, options.seed), show)
    print_kills(scene, found)
    return len(found.faults)


def _readers(options: argparse.Namespace, work: Path) -> int:
    found = readers_under_writing(work, options.readers, options.runs)
    print_readers(found)
    return len(found.reading.errors) + len(found.faults)


def _disk(options: argparse.Namespace, work: Path) -> int:
    found = full_disk(work)
    print_disk(found)
    return len(found.faults)


def _nights(options: argparse.Namespace, work: Path) -> int:
    return print_nights(nights(work))


PARTS: dict[str, Callable[[argparse.Namespace, Path], int]] = {
    "fuzz": _fuzz,
    "kill": _kill,
    "readers": _readers,
    "disk": _disk,
    "nights": _nights,
}

if __name__ == "__main__":
    sys.exit(main())
