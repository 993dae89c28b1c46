"""The command that brings public sets of motion capture."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from motionary.workflows.commands.options import OutputFormat, fail, stderr_console

if TYPE_CHECKING:
    from motionary.workflows.fetch.registry import PublicSet

EXAMPLES = {
    "fetch": (
        "motionary fetch  # the public sets that are known",
        "motionary fetch lafan1  # one of them: licence, terms, attribution, what is not documented",
        "motionary fetch lafan1 DIR --accept-licence  # download, unpack and label it",
        "motionary run DIR CATALOG --labels DIR/labels.csv",
    )
}


def fetch(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Of a public set.", show_default="list them")
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR", help="Where it goes; made if missing.", show_default="describe the set"
        ),
    ] = None,
    accept: Annotated[
        bool, typer.Option("--accept-licence", help="You have read the set's licence and accept it.")
    ] = False,
    registry: Annotated[
        Path | None,
        typer.Option(
            "--registry", help="Sets of your own, TOML as the built-in ones.", show_default="built in"
        ),
    ] = None,
    format_: OutputFormat = "table",
) -> None:
    """Download a public set of motion capture, and label it for a run.

    Without DIR nothing is downloaded. The same command again goes on with an
    interrupted download; a set that is complete is not downloaded again.
    """
    from motionary.workflows.fetch.job import source_text
    from motionary.workflows.fetch.registry import load_registry, set_named, table_of_sets
    from motionary.workflows.tables import write_table

    sets = load_registry(registry)
    if name is None:
        table = table_of_sets(sets)
        write_table(table.select(table.column_names[:7]) if format_ == "table" else table, format_)
        return
    wanted = set_named(name, sets)
    if folder is not None:
        if not accept:
            print(source_text(wanted), file=sys.stderr)
            fail(
                f"nothing is downloaded before you accept the licence, {wanted.licence}: add --accept-licence"
            )
        _fetch(wanted, folder)
    elif format_ == "table":
        print(source_text(wanted), end="")
    else:
        write_table(table_of_sets({name: wanted}), format_)


def _fetch(wanted: PublicSet, folder: Path) -> None:
    from functools import partial

    from motionary.workflows.fetch.job import fetch_set
    from motionary.workflows.fetch.meter import download_meter
    from motionary.workflows.progress import progress
    from motionary.workflows.summary import counted

    log = stderr_console()
    try:
        done = fetch_set(wanted, folder, partial(download_meter, log), partial(progress, console=log))
    except KeyboardInterrupt:
        fail("interrupted; the same command goes on with it")
    if done.kept_labels:
        print(f"motionary: {done.labels} was there and is as it was", file=sys.stderr)
    if done.untold:
        clips = counted(done.untold, "clip")
        print(f"motionary: the names of {clips} do not tell their labels", file=sys.stderr)
    clips = counted(done.clips, "clip")
    there = "were there already" if done.was_complete else "are there"
    print(f"{folder}: {clips} of {wanted.name} {there}; licence: {wanted.licence}")
    print(f"Attribution: {wanted.attribution}")
    print(f"Next: motionary run {folder} CATALOG --labels {done.labels}")
