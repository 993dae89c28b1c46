"""Commands that show what a catalog holds."""

from __future__ import annotations

from typing import Annotated

import typer

from motionary.workflows.commands.options import AsJson, AtSnapshot, CatalogUrl, OutputFormat, open_catalog

EXAMPLES = {
    "status": (
        "motionary status CATALOG",
        "motionary status CATALOG --clip walk/walk_tired_alex_01.bvh  # what is known of one clip",
        "motionary status CATALOG --json | jq '.clusters[0]'",
    ),
    "query": (
        'motionary query CATALOG "select label, count(*) from takes group by label"',
        'motionary query CATALOG "from takes where seconds > 3" --format csv',
        'motionary query CATALOG "describe clips"  # its columns',
    ),
}


def status(
    catalog: CatalogUrl,
    clip: Annotated[str | None, typer.Option("--clip", help="Show one clip instead.")] = None,
    snapshot: AtSnapshot = None,
    as_json: AsJson = False,
) -> None:
    """Show what a catalog holds: clips, clusters, scores, quarantine."""
    from motionary.workflows.summary import clip_record, print_clip, print_summary, summary_record
    from motionary.workflows.tables import output_console, write_json

    opened = open_catalog(catalog, snapshot)
    if as_json:
        write_json(summary_record(opened) if clip is None else clip_record(opened, clip))
    elif clip is None:
        print_summary(opened, output_console())
    else:
        print_clip(opened, clip, output_console())


def query(
    catalog: CatalogUrl,
    sql: Annotated[str, typer.Argument(metavar="SQL", help="A statement in DuckDB's SQL.")],
    format_: OutputFormat = "table",
    snapshot: AtSnapshot = None,
) -> None:
    """Ask CATALOG a question in SQL; every table is a view of its name.

    View `takes` joins `clips` and `clusters`: a row a clip, with all that is known of it.
    """
    from motionary.workflows.tables import write_table

    write_table(open_catalog(catalog, snapshot).sql(sql), format_)
