"""`make bench-alignment`: how fast motions are aligned, and what the quick search loses.

From the project's root: `python -m tests.benchmarks.alignment`. Exits with 0, also where a figure is missed;
with 1 where the naive recursion finds another optimum or a search ends below length-matching.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console

from motionary.pipeline.alignment import CotwWarp, cotw, cotw_search, mean_correlation, uniform
from motionary.pipeline.alignment.warp import interpolate
from tests.benchmarks.alignment_clips import (
    REAL_DATA,
    Classes,
    Pair,
    load_classes,
    long_pairs,
    smooth_sequence,
    to_references,
)
from tests.benchmarks.alignment_report import Figure, as_row, print_figures
from tests.benchmarks.contests import Contestant, alternate
from tests.benchmarks.machine import describe_machine, held_to_one_core, let_onto, one_thread
from tests.benchmarks.naive_cotw import naive_cotw
from tests.benchmarks.tables import WIDTH

ROUNDS, SEARCH_ROUNDS = 5, 3
# Frames, DOFs, L and slack of the alignment that is timed beside the naive one.
ALIGNMENT, QUICK_ALIGNMENT = (300, 60, 40, 20), (80, 6, 20, 5)
DRAWN, QUICK_CLIPS = 100, 3
# References above 96 frames are searched coarse to fine; of 240 the whole grid takes about a second.
LEAST_FRAMES, MOST_FRAMES = 97, 240
ALLOWED_LOSS = 0.01
ROUNDING = 1e-9
THREADS = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks; return the exit code."""
    options = _parser().parse_args(arguments)
    with held_to_one_core() as cores:
        figures = _measure(options.quick, cores)
        machine = describe_machine(cores)
    record = {"machine": machine, "quick": options.quick, "figures": [as_row(one) for one in figures]}
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(record, indent=1) + "\n")
    print_figures(record, Console(width=WIDTH))
    _say(f"all samples: {options.json}")
    return 0 if all(one.met for one in figures if one.binding) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.alignment", description=__doc__)
    parser.add_argument(
        "--json", type=Path, default=Path("motionary-bench/alignment.json"), help="the record"
    )
    parser.add_argument("--quick", action="store_true", help="few clips, one round: does it run at all?")
    return parser


def _measure(quick: bool, cores: set[int]) -> list[Figure]:
    """Take every measurement, one after the other."""
    frames, dofs, length, slack = QUICK_ALIGNMENT if quick else ALIGNMENT
    pair = smooth_sequence(frames, dofs, seed=1), smooth_sequence(frames, dofs, seed=2)
    rounds = 1 if quick else SEARCH_ROUNDS
    _say("one alignment, and the whole grid of it")
    figures = one_alignment(pair, length, slack, 1 if quick else ROUNDS)
    figures += whole_grid(pair, rounds)
    if not REAL_DATA.is_dir():
        _say("no real clips: there is no ../shared/data beside the project, and their figures are left out")
        return figures
    _say("real clips")
    classes = load_classes(QUICK_CLIPS if quick else None)
    hdm05, walks = to_references(classes, "hdm05"), to_references(classes, "bandai-1", "walk")
    with let_onto(cores):
        figures += whole_library(classes, rounds)
    figures += each_clip("HDM05", hdm05, rounds) + each_clip("Bandai walks", walks, rounds)
    _say("the quick search against the whole grid")
    drawn = long_pairs(classes, QUICK_CLIPS if quick else DRAWN, LEAST_FRAMES, MOST_FRAMES)
    with let_onto(cores):
        fast, full = searched(drawn, effort="fast"), searched(drawn, effort="full")
        figures += quick_against_full(fast, full)
        _say("open ends, and nodes at boundaries")
        closed = searched(hdm05)
        opened, bounded = searched(hdm05, open_ends=True), searched(hdm05, spacing="boundaries")
    figures += options_compared(closed, opened, bounded)
    return [*figures, never_below_uniform([*drawn, *drawn, *hdm05], [*fast, *full, *closed])]


def one_alignment(pair: Pair, length: int, slack: int, rounds: int) -> list[Figure]:
    """Time `cotw` and the naive recursion in turn, and compare what they find."""
    methods: dict[str, Callable[[], object]] = {
        "motionary": lambda: cotw(*pair, length, slack),
        "naive": lambda: naive_cotw(*pair, length, slack),
    }
    contestants = [
        Contestant(who, "alignment", lambda _, method=method: seconds(method))
        for who, method in methods.items()
    ]
    ours, naive = alternate(contestants, rounds)
    warp, (objective, eta) = cotw(*pair, length, slack), naive_cotw(*pair, length, slack)
    frames, dofs = pair[1].shape
    what = f"{frames} frames, {dofs} DOFs, segment {length}, slack {slack}"
    difference = abs(warp.objective - objective) / abs(objective)
    unlike = float(np.count_nonzero(warp.eta != np.array(eta)))
    return [
        Figure(f"{what}: milliseconds", 1e3 * ours.seconds, samples=ours.samples),
        Figure(f"{what}, naive: milliseconds", 1e3 * naive.seconds, samples=naive.samples),
        Figure("times faster than naive", naive.seconds / ours.seconds, ".0f", 80, at_least=True),
        Figure("objective, relative difference from naive", difference, ".0e", 1e-9, binding=True),
        Figure("segments stretched otherwise than by naive", unlike, ".0f", 0, binding=True),
    ]


def whole_grid(pair: Pair, rounds: int) -> list[Figure]:
    """Time the search over every segment length and slack."""
    combinations = sum(length - 4 for length in range(8, len(pair[1]) // 2 + 1))
    cotw_search(pair[0][:40], pair[1][:40])
    samples = [seconds(lambda: cotw_search(*pair)) for _ in range(rounds)]
    return [Figure(f"the whole grid of it, {combinations:,}: seconds", median(samples), samples=samples)]


def whole_library(classes: Classes, rounds: int) -> list[Figure]:
    """Time all HDM05 clips by two threads, the choice of the references with them."""
    figures = []
    clips = sum(len(poses) for (dataset, _), poses in classes.items() if dataset == "hdm05")
    for effort, name, required in (("full", "the whole grid", 300.0), ("fast", "a run's default", 10.0)):
        samples = [
            seconds(lambda effort=effort: searched(to_references(classes, "hdm05"), effort=effort))
            for _ in range(rounds)
        ]
        what = f"HDM05, {clips} clips, {THREADS} threads, {name}: seconds"
        figures.append(Figure(what, median(samples), required=required, samples=samples))
    return figures


def each_clip(name: str, pairs: Sequence[Pair], rounds: int) -> list[Figure]:
    """Time the quick search of every clip by one thread, the median of some rounds each."""
    turns = [
        [seconds(lambda pair=pair: cotw_search(*pair, effort="fast")) for pair in pairs]
        for _ in range(rounds)
    ]
    each = [float(one) for one in np.median(turns, axis=0)]
    what = f"{name}, {len(pairs)} clips, a run's default, milliseconds a clip"
    return [
        Figure(f"{what}: largest", 1e3 * max(each), ".1f", 50, samples=each),
        Figure(f"{what}: mean", 1e3 * sum(each) / len(each), ".1f"),
    ]


def quick_against_full(fast: Sequence[CotwWarp], full: Sequence[CotwWarp]) -> list[Figure]:
    """What the quick search loses in eq. 8's value against the whole grid."""
    losses = np.array([value(b) - value(a) for a, b in zip(fast, full, strict=True)])
    what = f"loss of a run's default, {len(losses)} long pairs"
    over = float((losses > ALLOWED_LOSS).sum())
    return [
        Figure(f"{what}: largest", float(losses.max()), ".3f", ALLOWED_LOSS),
        Figure(f"{what}: mean (less than 0 is a gain)", float(losses.mean()), ".3f"),
        Figure(f"{what}: how many lose more than {ALLOWED_LOSS}", over, ".0f"),
    ]


def options_compared(
    closed: Sequence[CotwWarp], opened: Sequence[CotwWarp], bounded: Sequence[CotwWarp]
) -> list[Figure]:
    """Nodes at boundaries against equal spacing by eq. 8's value, open ends against closed by correlation."""
    name = f"HDM05, {len(closed)} clips, the whole grid, mean"
    rho = [float(np.mean([warp.correlation for warp in warps])) for warps in (closed, opened)]
    return [
        Figure(f"{name} of eq. 8: equal spacing", float(np.mean([*map(value, closed)])), ".4f"),
        Figure(f"{name} of eq. 8: at boundaries", float(np.mean([*map(value, bounded)])), ".4f"),
        Figure(f"{name} correlation: closed", rho[0], ".4f"),
        Figure(f"{name} correlation: open ends", rho[1], ".4f"),
    ]


def never_below_uniform(pairs: Sequence[Pair], warps: Sequence[CotwWarp]) -> Figure:
    """Count the searches whose output correlates less with the reference than the length-matched input."""
    below = 0
    for (moving, reference), warp in zip(pairs, warps, strict=True):
        matched = uniform(moving, reference).apply(moving.astype(np.float64))
        times = warp.source_time * ((len(matched) - 1) / (len(moving) - 1))
        before, after = (mean_correlation(one, reference) for one in (matched, interpolate(matched, times)))
        below += after < before - ROUNDING
    return Figure(f"correlations below UTW's, {len(warps)} searches", below, ".0f", 0, binding=True)


def searched(pairs: Sequence[Pair], **options: object) -> list[CotwWarp]:
    """Search for the warps of all pairs by two threads; the kernels let go of the interpreter."""
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(lambda pair: cotw_search(*pair, **options), pairs))


def value(warp: CotwWarp) -> float:
    """Equation 8 with the paper's alpha."""
    return warp.correlation - 0.5 * warp.distortion


def seconds(work: Callable[[], object]) -> float:
    """Return how long a call takes."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def _say(step: str) -> None:
    print(step, file=sys.stderr, flush=True)


if __name__ == "__main__":
    # The numerical libraries read these when they are loaded, so the program starts over with them set.
    alone = one_thread(os.environ)
    if alone != dict(os.environ):
        os.execve(sys.executable, [sys.executable, "-m", "tests.benchmarks.alignment", *sys.argv[1:]], alone)
    sys.exit(main())
