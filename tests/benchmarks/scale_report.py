"""Measured runs and the model of a larger library as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isnan

from rich.console import Console
from rich.table import Table

from tests.benchmarks.alignment_report import Figure
from tests.benchmarks.scale_model import (
    ASSUMPTIONS,
    DIVIDED,
    Model,
    fitted,
    growth_by_stage,
    seconds_by_stage,
)
from tests.benchmarks.scale_run import Measured

GIGABYTE = 1e9
BOUND_SIZE, BOUND_MEMORY, BOUND_KERNEL, BOUND_PLAN = 10_000, 6.0, 1.3, 1.5


def figures(runs: Sequence[Measured]) -> Iterator[Figure]:
    """List what was measured that has to reach something; at the largest size it has to."""
    for run in runs:
        bound = run.clips >= BOUND_SIZE
        of = f"{run.clips:,} clips, {run.route.name}"
        yield Figure(f"{of}: minutes", run.seconds / 60, ".1f")
        memory = run.peak.total / GIGABYTE
        yield Figure(
            f"{of}: peak memory of the process tree, GB", memory, required=BOUND_MEMORY * bound or None
        )
        ratio = run.kernel_ratio
        yield Figure(f"{of}: comparing, times the kernel's own", ratio, required=BOUND_KERNEL * bound or None)
        if run.foretold:
            off = off_by(run.foretold["seconds"], run.seconds)
            yield Figure(f"{of}: foretold time off by a factor of", off, required=BOUND_PLAN * bound or None)


def off_by(one: float, other: float) -> float:
    """Return by which factor two values differ, whichever is larger."""
    return max(one / other, other / one)


def print_runs(runs: Sequence[Measured], console: Console) -> None:
    """Print the runs of one route: what each took, and how that grows."""
    console.print(f"\n{runs[0].route.name.capitalize()}, {runs[0].workers} processes", highlight=False)
    console.print(_overview(runs))
    grown = growth_by_stage(runs)
    seconds = [seconds_by_stage(run) for run in runs]
    rows = {stage: [one[stage] for one in seconds] for stage in grown}
    console.print(_by_size("seconds of work", runs, rows, 1.0, ".1f"))
    console.print(_by_size("MB on disk", runs, large_tables(runs), 1e6, ",.1f"))
    memory = {
        "peak": [run.peak.total for run in runs],
        "without mapped files": [run.peak.own for run in runs],
    }
    console.print(_by_size("GB of memory", runs, memory, GIGABYTE, ".2f", summed=False))


def large_tables(runs: Sequence[Measured]) -> dict[str, list[int]]:
    """Return the bytes of every table by size; those of less than a hundredth of the whole as one."""
    last = runs[-1]
    large = [table for table, size in last.tables.items() if size >= last.disk / 100]
    found = {table: [run.tables.get(table, 0) for run in runs] for table in large}
    rest = [run.disk - sum(run.tables.get(table, 0) for table in large) for run in runs]
    return found | {"others": rest}


def print_model(found: Model, runs: Sequence[Measured], console: Console) -> None:
    """Print what a larger library would take, and what that assumes."""
    last = runs[-1]
    console.print(
        f"\nA model: {found.clips:,} clips of {found.frames_a_clip:.0f} frames on {found.workers} workers, "
        f"{last.route.name}, from the runs above",
        highlight=False,
    )
    table = _table("stage", "hours of work", "hours by the clock", "tasks", "divides")
    for stage, one in found.stages.items():
        divides = "yes" if stage in DIVIDED else "no"
        table.add_row(stage, f"{one.work / 3600:.2f}", f"{one.elapsed / 3600:.2f}", f"{one.tasks:,}", divides)
    table.add_section()
    work = sum(one.work for one in found.stages.values())
    table.add_row("all", f"{work / 3600:.2f}", f"{found.seconds / 3600:.2f}", "", "")
    console.print(table)
    disk = sum(found.disk.values()) / GIGABYTE
    memory = "unknown of so few runs" if isnan(found.memory) else f"{found.memory / GIGABYTE:,.1f} GB"
    for line in (
        f"Disk: {disk:,.0f} GB, of these pairs {found.disk.get('pairs', 0) / GIGABYTE:,.0f} GB. Memory of "
        f"{last.workers} processes, without mapped files and were it not held to less: {memory}.",
        f"The scheduler is sent {found.scheduled / 1e6:,.1f} MB of tasks; comparing reads "
        f"{found.read / GIGABYTE:,.0f} GB and writes the pairs: {_rate(found):,.0f} MB a second.",
        *checked(runs),
        "It assumes:",
        *(f"- {one}" for one in ASSUMPTIONS),
    ):
        console.print(line, highlight=False, soft_wrap=True)


def checked(runs: Sequence[Measured]) -> list[str]:
    """Say how well the smaller runs foretell the largest, as the model foretells a larger one yet."""
    if len(runs) < 3:
        return []
    last = runs[-1]
    grown = growth_by_stage(runs[:-1])
    told = sum(growth.at(last.clips) for growth in grown.values())
    work = sum(seconds_by_stage(last).values())
    return [
        f"In the same way the smaller runs foretell {told:,.0f} s of work for {last.clips:,} clips; it took "
        f"{work:,.0f} s."
    ]


def _rate(found: Model) -> float:
    return (found.read + found.disk.get("pairs", 0.0)) / 1e6 / max(found.stages["compare"].elapsed, 1e-9)


def _overview(runs: Sequence[Measured]) -> Table:
    table = _table(
        "clips", "pairs compared", "minutes", "foretold", "peak GB", "own GB", "disk GB", "us a pair",
        "kernel", "ratio", "clusters",
    )  # fmt: skip
    for run in runs:
        each = 1e6 * run.stages["compare"] / max(run.pairs_computed, 1)
        table.add_row(
            f"{run.clips:,}",
            f"{run.pairs_computed:,}",
            f"{run.seconds / 60:.2f}",
            f"{run.foretold['seconds'] / 60:.2f}" if run.foretold else "",
            f"{run.peak.total / GIGABYTE:.2f}",
            f"{run.peak.own / GIGABYTE:.2f}",
            f"{run.disk / GIGABYTE:.2f}",
            f"{each:.2f}",
            f"{1e6 * run.kernel:.2f}",
            f"{run.kernel_ratio:.2f}",
            str(run.clusters),
        )
    return table


def _by_size(
    what: str,
    runs: Sequence[Measured],
    rows: Mapping[str, Sequence[float]],
    unit: float,
    form: str,
    *,
    summed: bool = True,
) -> Table:
    """Show a quantity by size, with its exponent over all sizes and that of the last step."""
    table = _table(what, *(f"{run.clips:,}" for run in runs), "exponent", "last step")
    clips = [run.clips for run in runs]

    def add(name: str, values: Sequence[float]) -> None:
        exponents = (fitted(clips, values).exponent, fitted(clips[-2:], values[-2:]).exponent)
        shown = ("" if isnan(one) else f"{one:.2f}" for one in exponents)
        table.add_row(name, *(format(one / unit, form) for one in values), *shown)

    for name, values in rows.items():
        add(name, values)
    if summed:
        table.add_section()
        add("all", [sum(column) for column in zip(*rows.values(), strict=True)])
    return table


def _table(*columns: str) -> Table:
    table = Table()
    for place, column in enumerate(columns):
        table.add_column(column, justify="right" if place else "left")
    return table
