"""The command that tells which clusters new files belong to."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from motionary.workflows.commands.options import (
    QUARANTINED,
    AtSnapshot,
    CatalogUrl,
    OutputFormat,
    compile_first,
    open_catalog,
    stderr_console,
)

EXAMPLES = {
    "assign": (
        "motionary assign CATALOG new_take.bvh  # its cluster, what it is called there, or that it is new",
        "motionary assign CATALOG FOLDER --format csv > names.csv  # every motion file below it",
        "motionary assign CATALOG 'takes/**/*.bvh' --format json | jq '.[].label'",
    )
}

_SHOWN = (
    "file", "status", "cluster_id", "label", "confidence", "degree", "distance_to_reference",
    "nearest_clip", "distance", "second_cluster", "second_distance",
)  # fmt: skip


def assign(
    catalog: CatalogUrl,
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="Motion files, folders of them, or patterns in quotes."),
    ],
    format_: OutputFormat = "table",
    snapshot: AtSnapshot = None,
) -> None:
    """Tell which cluster of CATALOG each file belongs to, and what it is called.

    It belongs to the cluster of the clip nearest to it, or to none where that
    clip or the cluster's reference is too far. Nothing is written. A file that
    cannot be read is a row that says why, and makes the exit code 3.
    """
    from functools import partial

    import pyarrow.compute as pc

    from motionary.catalog.given_files import given_motions
    from motionary.workflows.progress import progress
    from motionary.workflows.summary import counted
    from motionary.workflows.tables import write_table

    opened, given = open_catalog(catalog, snapshot), given_motions(files)
    compile_first()
    with progress({"assign": len(given)}, stderr_console()) as advance:
        found = opened.assign(given, advance=partial(advance, "assign"))
    write_table(found.select(_SHOWN) if format_ == "table" else found, format_)
    unreadable = found.filter(pc.equal(found["status"], "unreadable")).to_pylist()
    for row in unreadable:
        place = row["file"] if row["line"] is None else f"{row['file']}:{row['line']}"
        print(f"motionary: {place}: {row['reason']}; {row['mend']}", file=sys.stderr)
    assigned = found["status"].to_pylist().count("assigned")
    print(
        f"{counted(len(found), 'file')}: {assigned} assigned, "
        f"{len(found) - assigned - len(unreadable)} unassigned, {len(unreadable)} unreadable",
        file=sys.stderr,
    )
    if unreadable:
        raise typer.Exit(QUARANTINED)
