"""Commands that show what a catalog holds."""

from __future__ import annotations

from typing import Annotated

import typer

from motionary.workflows.commands.options import AtSnapshot, CatalogUrl, OutputFormat, open_catalog


def status(
    catalog: CatalogUrl,
    clip: Annotated[str | None, typer.Option("--clip", help="Show one clip instead.")] = None,
    snapshot: AtSnapshot = None,
) -> None:
    """Show what a catalog holds: clips, clusters, scores, quarantine."""
    from motionary.workflows.summary import print_clip, print_summary
    from motionary.workflows.tables import output_console

    opened = open_catalog(catalog, snapshot)
    if clip is None:
        print_summary(opened, output_console())
    else:
        print_clip(opened, clip, output_console())


def query(
    catalog: CatalogUrl,
    sql: Annotated[str, typer.Argument(metavar="SQL", help="A statement in DuckDB's SQL.")],
    format_: OutputFormat = "table",
    snapshot: AtSnapshot = None,
) -> None:
    """Ask CATALOG a question in SQL; every table is a view of its name."""
    from motionary.workflows.tables import write_table

    write_table(open_catalog(catalog, snapshot).sql(sql), format_)
