"""How long online alignment takes for a live frame, by method, window and number of joints [FP Table 2].

From the project's root: `python -m tests.benchmarks.online`. A walk of the embedded library at 120 frames a
second, over and over, is followed with one like it; under Type V, so that the prerecorded one is never
finished and every frame has a whole window. Exits with 1 where a median with a window of up to 40 frames is
longer than a frame lasts, 8,333 microseconds; a quick run judges nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console

from motionary.pipeline.alignment.online import Method, OnlineAligner
from motionary.pipeline.joint_rotations import joint_rotations
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic import template
from motionary.workflows.reproduce.fp_dtw_report import TABLE_2
from tests.benchmarks.alignment_report import Figure, as_row, print_figures
from tests.benchmarks.machine import describe_machine, held_to_one_core
from tests.benchmarks.tables import WIDTH

RATE = 120.0
FRAME = 1e6 / RATE
"""Microseconds between two live frames."""
WINDOWS = (10, 20, 40, 80)
JOINTS = (8, 100)
FRAMES, QUICK_FRAMES = 600, 20
JUDGED_WINDOW = 40
"""Frames, the widest with which a push must be done before the next frame comes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.online", description=__doc__)
    parser.add_argument("--json", type=Path, default=Path("motionary-bench/online.json"), help="the record")
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_FRAMES} frames: does it run at all?")
    options = parser.parse_args(arguments)
    with held_to_one_core() as cores:
        figures = list(_measured(options.quick))
        machine = describe_machine(cores)
    record = {"machine": machine, "quick": options.quick, "figures": [as_row(one) for one in figures]}
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    console = Console(width=WIDTH)
    print_figures(record, console, "one core; medians over live frames")
    if options.quick:
        return 0
    late = [one.what for one in figures if one.binding and not one.met]
    said = f"MISSED by {'; '.join(late)}" if late else "met by every method"
    console.print(f"A push within {FRAME:.0f} us, windows up to {JUDGED_WINDOW}: {said}", highlight=False)
    return 1 if late else 0


def _measured(quick: bool) -> Iterator[Figure]:
    cases: list[tuple[Method, int]] = [("A", 2), *(("B", one) for one in WINDOWS)]
    cases += [("C", one) for one in WINDOWS]
    for joints in JOINTS:
        for method, window in cases:
            samples = _samples(method, window, joints, QUICK_FRAMES if quick else FRAMES)
            theirs = TABLE_2.get(f"M{method.lower()} w{window}") if joints == JOINTS[0] else None
            said = f" (Table 2: {theirs})" if theirs else ""
            what = f"{method}, window {window}, {joints} joints, us a frame"
            judged = window <= JUDGED_WINDOW
            required = FRAME if judged else None
            binds = judged and not quick
            yield Figure(f"{what}{said}", median(samples), ".0f", required, binding=binds, samples=samples)
            yield Figure(f"{what}, 99th percentile", float(np.percentile(samples, 99)), ".0f", required)


def _samples(method: Method, window: int, joints: int, frames: int) -> list[float]:
    """Push live frames; return the microseconds that each took."""
    aligner = OnlineAligner(_walking(3 * frames + window + 1, joints), method, window, "type-v")
    samples = []
    for frame in _walking(frames, joints, start=5):
        began = time.perf_counter()
        aligner.push(frame)
        samples.append((time.perf_counter() - began) * 1e6)
    return samples[3:]  # the first three are mapped without looking


def _walking(frames: int, joints: int, start: int = 0) -> FloatArray:
    walk = joint_rotations(template("walk"), rate=RATE)
    shown = np.take(walk, np.arange(start, start + frames), axis=0, mode="wrap")
    return np.take(shown, np.arange(joints), axis=1, mode="wrap")


if __name__ == "__main__":
    sys.exit(main())
