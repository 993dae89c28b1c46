"""The command that shows a catalog on one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from motionary.workflows.commands.options import AsJson, AtSnapshot, CatalogUrl, open_catalog

EXAMPLES = {
    "report": (
        "motionary report CATALOG report.html  # what changed, every cluster with takes to play, charts",
        "motionary report CATALOG report.html --against 3 --overwrite  # what changed since snapshot 3",
    )
}


def report(
    catalog: CatalogUrl,
    out: Annotated[Path, typer.Argument(metavar="OUT.html", help="The page; it needs nothing beside it.")],
    snapshot: AtSnapshot = None,
    against: Annotated[
        str | None,
        typer.Option(
            "--against",
            metavar="RUN",
            help="Tell what changed since this earlier run, or snapshot's number.",
            show_default="the newest earlier snapshot that is left",
        ),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT.html.")] = False,
    as_json: AsJson = False,
) -> None:
    """Show CATALOG on one HTML page: changes, clusters to watch, review, charts.

    It opens anywhere, without a network, and stays under 10 MB: of long takes and
    large catalogs it says what it leaves out.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"{out} does not end in .html", param_hint="OUT.html")
    from contextlib import nullcontext
    from dataclasses import asdict

    from motionary.workflows.report_page import write_report_page
    from motionary.workflows.tables import write_json

    earlier = nullcontext() if against is None else open_catalog(catalog, against)
    with open_catalog(catalog, snapshot) as opened, earlier as before:
        made = write_report_page(opened, out, before, overwrite=overwrite)
    if as_json:
        write_json(asdict(made))
        return
    since = (
        f"changes since snapshot {made.against}"
        if made.against
        else "no earlier snapshot that can be compared with"
    )
    print(f"wrote {made.file}: {made.bytes / 1e6:.1f} MB, snapshot {made.snapshot}, {since}")
