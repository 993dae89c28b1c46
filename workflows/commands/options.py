"""What several commands share: options, exit codes, where answers and remarks go."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Literal, NoReturn

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from motionary.catalog import Catalog

FAILED, QUARANTINED, UNVERIFIED = 1, 3, 4
"""Exit codes beside 0, done, and 2, usage: failed; done with quarantined clips; verification failed."""

COMPILING = "compiling the kernels, or waiting for who does: once on a machine, about a minute"

CatalogUrl = Annotated[
    str, typer.Argument(metavar="CATALOG", help="Folder of the catalog, or its fsspec URL.")
]
AtSnapshot = Annotated[
    str | None,
    typer.Option("--snapshot", help="A snapshot's number or a run's id.", show_default="the published one"),
]
OutputFormat = Annotated[
    Literal["table", "json", "csv", "parquet"], typer.Option("--format", help="How to write the answer.")
]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes on this machine.", show_default="one a core")
]


def _size(text: str) -> int:
    from motionary.workflows.costs.sizes import parse_size

    try:
        return parse_size(text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


Memory = Annotated[
    int | None,
    typer.Option(
        "--memory",
        parser=_size,
        metavar="SIZE",
        help="What all processes may hold together, as 4GB; on a running cluster, one worker.",
        show_default="what the machine has",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Answer as JSON.")]
Scheduler = Annotated[str | None, typer.Option("--scheduler", help="Address of a running Dask scheduler.")]


def examples(*lines: str) -> str:
    """Write the end of a command's help: each line a command, with what it gives after a #.

    What it gives stands above it, for a terminal folds lines that are longer than 80 characters. What would
    be markup is escaped.
    """
    split = (line.replace("[", r"\[").partition("  # ") for line in lines)
    shown = [[f"# {remark}"] * bool(remark) + [f"$ {command}"] for command, _, remark in split]
    return "\n".join(["Examples:", "", *(line for pair in shown for line in pair)])


def open_catalog(url: str, snapshot: str | None = None) -> Catalog:
    """Open a catalog's published snapshot, or an earlier one."""
    from motionary.catalog import Catalog

    return Catalog.open(url, snapshot)


def stderr_console() -> Console:
    """Return where remarks and progress go, so that stdout holds the answer only."""
    from rich.console import Console

    return Console(stderr=True)


def compile_first() -> None:
    """Compile the kernels before they are needed, one process alone: see `motionary.pipeline.compilation`."""
    from functools import partial

    from motionary.pipeline.compilation import compile_kernels

    compile_kernels(partial(stderr_console().print, COMPILING, highlight=False))


def fail(message: str) -> NoReturn:
    """Say on stderr what went wrong, and exit."""
    print(f"motionary: {message}", file=sys.stderr)
    sys.exit(FAILED)
