"""The record of a run as tables for a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from tests.benchmarks.contests import TASK_NAMES

# Wide enough for every table, also where the output is no terminal.
WIDTH = 124
MEBIBYTE = 2**20


def print_tables(record: dict, console: Console) -> None:
    """Print all of a record but its single samples."""
    _print_setting(record, console)
    for kind, rows in record["contests"].items():
        _show(console, *_contest(kind, rows, record))
    if record["peers"] is not None:
        for name, does in record["what_peers_compute"].items():
            console.print(f"{name}: {does}", highlight=False)
    _show(console, *_shares(record))
    _show(console, *_growth(record))
    _show(console, *_memory(record))
    console.print(
        "Beyond the result is one tile: its distances, its clips as the kernels read them (rows and lanes), "
        "and scratch by the cells of its largest matrix.",
        highlight=False,
    )
    _show(console, *_agreement(record))
    if not record["settings"]["quick"]:
        _show(console, *_targets(record))


def _print_setting(record: dict, console: Console) -> None:
    machine, settings = record["machine"], record["settings"]
    if settings["quick"]:
        console.print("A quick run, to see that it runs: its figures mean nothing.", highlight=False)
    peers = record["peers"] or {}
    packages = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    console.print(
        f"{machine['processor']}, {machine['cores']} cores, Python {machine['python']}", highlight=False
    )
    console.print(f"ours: {packages}", highlight=False)
    console.print(
        "peers: " + (", ".join(f"{name} {number}" for name, number in peers.items()) or "none took part"),
        highlight=False,
    )
    held = "one core" if settings["held_to_one_core"] else "no core (this system cannot)"
    console.print(
        f"{record['library']}; {settings['features']} features; rounds: {settings['rounds']}, in turn; "
        f"one thread each, held to {held}",
        highlight=False,
    )


def _show(console: Console, title: str, table: Table) -> None:
    # A table's own title would be folded to the width of the table.
    console.print(f"\n{title}", highlight=False)
    console.print(table)


def _table(*columns: str, text: int = 1) -> Table:
    """Make a table whose first columns hold text and whose others hold numbers."""
    table = Table()
    for place, column in enumerate(columns):
        table.add_column(column, justify="left" if place < text else "right")
    return table


def _contest(kind: str, rows: list[dict], record: dict) -> tuple[str, Table]:
    clips = record["clips"][kind]
    title = (
        f"All pairs, {kind}: {clips['clips']} clips, {clips['pairs']} pairs, "
        f"{clips['mean_frames']:.1f} frames on average, {clips['dimensions']} dimensions"
    )
    columns = ("task", "by", "us a pair", "least", "most", "million cells/s", "times ours")
    table = _table(*columns, text=2)
    for task, name in TASK_NAMES.items():
        for row in rows:
            if row["task"] == task:
                each = [1e6 * sample / clips["pairs"] for sample in row["samples"]]
                table.add_row(
                    name,
                    row["who"],
                    f"{row['microseconds_a_pair']:.2f}",
                    f"{min(each):.2f}",
                    f"{max(each):.2f}",
                    f"{row['cells_a_second'] / 1e6:.1f}",
                    f"{row['ratio_to_ours']:.2f}",
                )
        table.add_section()
    return title, table


def _shares(record: dict) -> tuple[str, Table]:
    limits = record["limits"]
    title = (
        f"Share of what one core can do: sgemm {limits['product_flops'] / 1e9:.1f} GFLOP/s "
        f"({limits['stacked_product_flops'] / 1e9:.1f} with the features' inner dimension); recurrence "
        f"{limits['recurrence_cells'] / 1e9:.2f} G cells/s ({limits['lanes']} lanes)"
    )
    table = _table("clips", "task", "sgemm's time", "recurrence's time", "both", text=2)
    for kind, rows in record["contests"].items():
        for row in rows:
            if "product_share" in row:
                product, recurrence = row["product_share"], row["recurrence_share"]
                table.add_row(
                    kind,
                    TASK_NAMES[row["task"]],
                    f"{product:.1%}",
                    f"{recurrence:.1%}",
                    f"{product + recurrence:.1%}",
                )
    return title, table


def _growth(record: dict) -> tuple[str, Table]:
    columns = ("varied", "value", "clips", "frames", "dimensions", "by", "us a pair", "ns a cell")
    table = _table(*columns)
    table.columns[5].justify = "left"
    varied = None
    for stage in record["growth"]:
        if varied not in (None, stage["varied"]):
            table.add_section()
        varied = stage["varied"]
        for timing in stage["timings"]:
            table.add_row(
                varied,
                str(stage["value"]),
                str(stage["clips"]),
                f"{stage['mean_frames']:.1f}",
                str(stage["dimensions"]),
                f"{timing['who']}, {TASK_NAMES[timing['task']]}",
                f"{timing['microseconds_a_pair']:.2f}",
                f"{timing['nanoseconds_a_cell']:.3f}",
            )
    return "Growth", table


def _memory(record: dict) -> tuple[str, Table]:
    title = f"Peak memory above that before the call, MiB, one thread ({record['memory'][0]['method']})"
    columns = ("task", "clips", "frames", "clips' own", "peak", "result", "beyond it")
    table = _table(*columns)
    for row in record["memory"]:
        table.add_row(
            TASK_NAMES[row["task"]],
            str(row["clips"]),
            str(row["frames"]),
            *(f"{row[name] / MEBIBYTE:.2f}" for name in ("inputs", "peak", "result", "beyond")),
        )
    return title, table


def _agreement(record: dict) -> tuple[str, Table]:
    table = _table("compared", "pairs", "largest relative difference", "allowed", "")
    for row in record["agreement"]:
        table.add_row(
            row["what"],
            str(row["pairs"]),
            f"{row['difference']:.1e}",
            f"{row['tolerance']:.0e}",
            "holds" if row["holds"] else "FAILS",
        )
    return "Agreement", table


def _targets(record: dict) -> tuple[str, Table]:
    table = _table("figure", "measured", "required", "goal", "")
    for row in record["targets"]:
        sign = ">=" if row["at_least"] else "<="
        table.add_row(
            row["what"],
            "not measured" if row["measured"] is None else f"{row['measured']:.2f}",
            f"{sign} {row['required']:g}",
            "" if row["goal"] is None else f"{sign} {row['goal']:g}",
            {None: "", True: "met", False: "MISSED"}[row["met"]],
        )
    return "What is asked for", table
