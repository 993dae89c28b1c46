"""How the time of generalized time warping grows with length, DTW's beside it.

From the project's root: `python -m tests.benchmarks.generalized`, with `--lengths 500,1000` for some lengths
and `--quick` to see that it runs. Two sequences of the same curve are aligned, one slowed. Of GTW it is
the Gauss-Newton iteration and the embedding step that must be linear in length; how many of them there are
hangs on the sequences, so a fixed number at most is timed. Beside each time stands the exponent of its growth
from the length before: 1 is linear, 2 quadratic.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from math import log
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

from motionary.pipeline.alignment import dtw
from motionary.pipeline.alignment.bases import USUAL_BASES, monotone_basis
from motionary.pipeline.alignment.generalized import generalized_time_warping
from motionary.pipeline.alignment.generalized_time import time_step, warp_steps
from motionary.pipeline.alignment.multiset_cca import multiset_cca
from motionary.pipeline.alignment.warp import interpolate
from tests.benchmarks.machine import held_to_one_core, one_thread
from tests.benchmarks.tables import WIDTH

LENGTHS, QUICK_LENGTHS = (500, 1000, 2000, 4000, 8000, 16000), (100, 200)
DTW_LENGTHS = 8000
"""Beyond, DTW's cost matrix alone takes more than half a gigabyte."""
DOFS, ITERATIONS, ROUNDS = 10, 10, 5


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit code."""
    options = _parser().parse_args(arguments)
    lengths = QUICK_LENGTHS if options.quick else options.lengths
    with held_to_one_core():
        rows = {length: _measured(length, 1 if options.quick else ROUNDS) for length in lengths}
    _print(rows)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.generalized", description=__doc__)
    parser.add_argument(
        "--lengths",
        type=lambda text: [int(one) for one in text.split(",")],
        default=LENGTHS,
        help="frames, as 500,1000",
    )
    parser.add_argument("--quick", action="store_true", help="short sequences: does it run at all?")
    return parser


def _measured(length: int, rounds: int) -> dict[str, float | None]:
    """Time both steps, all of GTW and DTW, in milliseconds."""
    print(f"{length:,} frames", file=sys.stderr, flush=True)
    moving, reference = _pair(length)
    steps = warp_steps([length])
    bases = [monotone_basis(USUAL_BASES, length, steps) for _ in range(2)]
    shown = [interpolate(one, np.linspace(0, length - 1, steps)) for one in (moving, reference)]

    def whole() -> object:
        return generalized_time_warping([moving, reference], rounds=5)

    return {
        f"time step, {ITERATIONS} iterations": _milliseconds(
            lambda: time_step([moving, reference], bases, iterations=ITERATIONS), rounds
        ),
        "embedding step": _milliseconds(lambda: multiset_cca(shown, 0.1), rounds),
        "GTW, 5 rounds, coarse start": _milliseconds(whole, min(rounds, 3)),
        "DTW": _milliseconds(lambda: dtw(moving, reference), min(rounds, 3))
        if length <= DTW_LENGTHS
        else None,
    }


def _pair(length: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the same curve of sines twice, once slowed; noise keeps it from coming to rest early."""
    rng = np.random.default_rng(0)
    pitch, phase = rng.uniform(1, 8, DOFS), rng.uniform(0, 6, DOFS)
    time_ = np.linspace(0, 1, length)[:, None]
    moving, reference = (np.sin(2 * np.pi * pitch * at + phase) for at in (time_**1.3, time_))
    return moving + rng.normal(0, 0.05, moving.shape), reference + rng.normal(0, 0.05, reference.shape)


def _milliseconds(work: Callable[[], object], rounds: int) -> float:
    """Return the median time of a call that was made once before."""
    work()
    samples = []
    for _ in range(rounds):
        began = time.perf_counter()
        work()
        samples.append(1e3 * (time.perf_counter() - began))
    return median(samples)


def _print(rows: dict[int, dict[str, float | None]]) -> None:
    table = Table(title=f"two sequences, {DOFS} DOFs, one core; medians in milliseconds (growth's exponent)")
    table.add_column("frames", justify="right")
    for name in next(iter(rows.values())):
        table.add_column(name, justify="right")
    last_length, last = None, {}
    for length, figures in rows.items():
        cells = [f"{length:,}"]
        for name, milliseconds in figures.items():
            if milliseconds is None:
                cells.append("-")
                continue
            cell = f"{milliseconds:,.1f}"
            if last_length is not None and last.get(name):
                cell += f" ({log(milliseconds / last[name]) / log(length / last_length):.2f})"
            cells.append(cell)
        table.add_row(*cells)
        last_length, last = length, figures
    Console(width=WIDTH).print(table)


if __name__ == "__main__":
    # The numerical libraries read these when they are loaded, so the program starts over with them set.
    alone = one_thread(os.environ)
    if alone != dict(os.environ):
        os.execve(
            sys.executable, [sys.executable, "-m", "tests.benchmarks.generalized", *sys.argv[1:]], alone
        )
    sys.exit(main())
