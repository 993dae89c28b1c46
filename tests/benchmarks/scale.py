"""`make scale`: how a run grows with its library, and a model of a larger one on more workers.

From the project's root: `python -m tests.benchmarks.scale`. Runs the main job on embedded libraries of 300 to
10,000 clips, each in a fresh catalog, and prints time by stage, peak memory of the process tree, bytes on
disk and fitted exponents. A size that was measured before is not run again; remove its JSON to have it run.
Exits with 0, also where a figure is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from motionary.pipeline.compilation import compile_kernels
from tests.benchmarks.alignment_report import as_row, print_figures
from tests.benchmarks.machine import describe_machine
from tests.benchmarks.scale_graph import graph_of
from tests.benchmarks.scale_model import ASSUMPTIONS, Model, growth_by_stage, model
from tests.benchmarks.scale_report import figures, print_model, print_runs
from tests.benchmarks.scale_run import Measured, Route, measured_run
from tests.benchmarks.tables import WIDTH

SIZES, QUICK_SIZES = (300, 1_000, 3_000, 10_000), (40, 80)
MODEL_CLIPS, MODEL_WORKERS = 142_000, 64


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    options = _parser().parse_args(arguments)
    sizes = sorted(QUICK_SIZES if options.quick else options.sizes)
    options.folder.mkdir(parents=True, exist_ok=True)
    compile_kernels(lambda: _say("compiling the kernels, so that no run is measured that does"))
    by_route = [
        [measured_run(options.folder, route, clips, options.workers, _say) for clips in sizes]
        for route in (Route(), *options.route)
    ]
    graph = graph_of(options.model_clips)
    asked = (options.model_clips, options.model_workers, options.model_frames, graph)
    models = [model(runs, *asked) if len(runs) > 1 else None for runs in by_route]
    record = _record(by_route, models, options.quick)
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    console = Console(width=WIDTH)
    print_figures(record, console, f"{options.workers} processes, each run once")
    for runs, found in zip(by_route, models, strict=True):
        print_runs(runs, console)
        if found:
            print_model(found, runs, console)
    _say(f"the record: {options.json}")
    return 0


def _record(by_route: Sequence[Sequence[Measured]], models: Sequence[Model | None], quick: bool) -> dict:
    routes = []
    for runs, found in zip(by_route, models, strict=True):
        grown = {stage: growth.exponent for stage, growth in growth_by_stage(runs).items()}
        told = asdict(found) | {"seconds": found.seconds} if found else None
        routes.append({"runs": [asdict(run) for run in runs], "exponents": grown, "model": told})
    return {
        "machine": describe_machine(_cores()),
        "quick": quick,
        "figures": [as_row(one) for runs in by_route for one in figures(runs)],
        "routes": routes,
        "assumptions": ASSUMPTIONS,
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.scale", description=__doc__)
    parser.add_argument("--json", type=Path, default=Path("motionary-bench/scale.json"), help="the record")
    parser.add_argument(
        "--folder",
        type=Path,
        default=Path("motionary-bench/scale"),
        help="of libraries, catalogs and measurements, kept",
    )
    parser.add_argument(
        "--sizes",
        type=lambda text: [int(one) for one in text.split(",")],
        default=SIZES,
        help="clips, as 300,1000",
    )
    parser.add_argument("--workers", type=int, default=len(_cores()), help="processes of a run")
    parser.add_argument(
        "--route",
        type=_route,
        action="append",
        default=[],
        metavar="NAME=ARGUMENTS",
        help="measure another way too: arguments of `motionary run`, as 'cut=--primary complete --mu 0.4'",
    )
    parser.add_argument("--model-clips", type=int, default=MODEL_CLIPS, help="of the library to be modelled")
    parser.add_argument("--model-workers", type=int, default=MODEL_WORKERS, help="that it is given")
    parser.add_argument(
        "--model-frames", type=float, help="of its clips, at 30 a second; else as many as here"
    )
    parser.add_argument("--quick", action="store_true", help="40 and 80 clips: does it run at all?")
    return parser


def _route(text: str) -> Route:
    name, _, arguments = text.partition("=")
    return Route(name, tuple(shlex.split(arguments)))


def _cores() -> set[int]:
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))


def _say(step: str) -> None:
    print(step, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
