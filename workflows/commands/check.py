"""Commands that say whether a catalog, or the machine, is sound."""

from __future__ import annotations

from typing import Annotated

import typer

from motionary.workflows.commands.options import FAILED, UNVERIFIED, CatalogUrl, OutputFormat


def verify(
    catalog: CatalogUrl,
    snapshot: Annotated[
        str | None,
        typer.Option("--snapshot", help="A snapshot's or a run's id.", show_default="the published one"),
    ] = None,
    format_: OutputFormat = "table",
) -> None:
    """Check a snapshot of CATALOG: files, checksums, schemas, and that its tables agree.

    Exits with 4 if a check fails.
    """
    from motionary.catalog.verify import verify as checks

    made = []
    for check in checks(catalog, snapshot):
        made.append(check)
        if format_ == "table":
            print(f"{_result(check.passed)}  {check.name}: {check.detail}", flush=True)
    if format_ != "table":
        import pyarrow as pa

        from motionary.workflows.tables import write_table

        columns = {
            "check": [check.name for check in made],
            "result": [_result(check.passed) for check in made],
            "detail": [check.detail for check in made],
        }
        write_table(pa.table(columns), format_)
    if not all(check.passed for check in made):
        raise typer.Exit(UNVERIFIED)


def doctor(
    catalog: Annotated[
        str | None, typer.Argument(metavar="[CATALOG]", help="Look at this catalog's folder as well.")
    ] = None,
) -> None:
    """Check this machine, and the folder and state of CATALOG.

    Exits with 1 if something fails.
    """
    from motionary.workflows.doctor import examine

    failed = False
    for finding in examine(catalog):
        failed |= finding.state == "FAILED"
        mend = f"; {finding.mend}" if finding.mend else ""
        print(f"{finding.state}  {finding.what}: {finding.detail}{mend}", flush=True)
    if failed:
        raise typer.Exit(FAILED)


def _result(passed: bool) -> str:
    return "PASSED" if passed else "FAILED"
