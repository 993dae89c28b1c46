"""`make bench`: motionary's distances against the field's, timed, checked and reported.

From the project's root: `python -m tests.benchmarks`. Exits with 0, also where a figure is missed; with 1
where the distances do not agree with the peers'.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from rich.console import Console

from motionary.pipeline.config import FeatureConfig
from tests.benchmarks.agreement import Agreement, with_ourselves, with_peers
from tests.benchmarks.clips import load_library
from tests.benchmarks.contests import FEWER_ROUNDS, all_tasks, two_threads
from tests.benchmarks.growth import measure_growth
from tests.benchmarks.limits import REPEATS, measure_limits
from tests.benchmarks.machine import can_pin, describe_machine, held_to_one_core, let_onto, one_thread
from tests.benchmarks.memory import measure_memory
from tests.benchmarks.peer_process import PeerProcess
from tests.benchmarks.report import Results, as_record
from tests.benchmarks.tables import WIDTH, print_tables

ROUNDS, GROWTH_ROUNDS = 5, 3
QUICK_CLIPS = 14


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks; return the exit code."""
    options = _parser().parse_args(arguments)
    with held_to_one_core() as cores, tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        peers = None
        if options.peers.exists():
            peers = stack.enter_context(PeerProcess(options.peers, Path(folder)))
        else:
            _say(f"no peers: there is no {options.peers}; `make bench` makes it")
        record = as_record(_measure(options, peers, cores, Path(folder)))
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    print_tables(record, Console(width=WIDTH))
    _say(f"all samples: {options.json}")
    return 0 if all(one["holds"] for one in record["agreement"]) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument(
        "--peers", type=Path, default=Path(".venv-peers/bin/python"), help="the peers' Python"
    )
    parser.add_argument("--json", type=Path, default=Path("motionary-bench/bench.json"), help="the record")
    parser.add_argument(
        "--embedded", action="store_true", help="the embedded library, also where real clips are"
    )
    parser.add_argument("--quick", action="store_true", help="few clips, one round: does it run at all?")
    return parser


def _measure(
    options: argparse.Namespace, peers: PeerProcess | None, cores: set[int], folder: Path
) -> Results:
    """Take every measurement, one after the other."""
    rounds = 1 if options.quick else ROUNDS
    _say("clips and features")
    library, sets = load_library(options.embedded, QUICK_CLIPS if options.quick else None)
    unmerged, merged = sets["unmerged"], sets["merged"]
    contests, agreements = {}, list[Agreement]()
    for kind, clips in sets.items():
        _say(f"contests, {kind}")
        contests[kind] = all_tasks(clips, peers, rounds)
        agreements += with_ourselves(clips)
        if peers is not None:
            agreements += with_peers(clips, peers)
    _say("two threads")
    with let_onto(cores):
        threads = two_threads(unmerged, rounds) if len(cores) > 1 else []
    _say("limits")
    limits = measure_limits(unmerged.dimensions, 1 if options.quick else REPEATS)
    _say("growth")
    growth_rounds = 1 if options.quick else GROWTH_ROUNDS
    growth = measure_growth(
        unmerged, peers, growth_rounds, QUICK_CLIPS if options.quick else len(unmerged.clips)
    )
    _say("memory")
    peaks = measure_memory(merged, folder, options.quick)
    return Results(
        machine=describe_machine(cores),
        settings={
            "features": FeatureConfig().kind,
            "rounds": rounds,
            "fewer_rounds": FEWER_ROUNDS,
            "growth_rounds": growth_rounds,
            "held_to_one_core": can_pin(),
            "quick": options.quick,
        },
        peers=None if peers is None else peers.versions(),
        library=library,
        sets=sets,
        contests=contests,
        threads=threads,
        limits=limits,
        agreements=agreements,
        growth=growth,
        peaks=peaks,
    )


def _say(step: str) -> None:
    print(step, file=sys.stderr, flush=True)


if __name__ == "__main__":
    # The numerical libraries read these when they are loaded, so the program starts over with them set.
    alone = one_thread(os.environ)
    if alone != dict(os.environ):
        os.execve(sys.executable, [sys.executable, "-m", "tests.benchmarks", *sys.argv[1:]], alone)
    sys.exit(main())
