"""Commands that say whether a catalog, or the machine, is sound."""

from __future__ import annotations

from typing import Annotated

import typer

from motionary.workflows.commands.options import FAILED, UNVERIFIED, AtSnapshot, CatalogUrl, OutputFormat

EXAMPLES = {
    "verify": (
        "motionary verify CATALOG",
        "motionary verify CATALOG --snapshot 3 --format json",
    ),
    "doctor": (
        "motionary doctor  # this machine",
        "motionary doctor CATALOG --format json  # and that folder",
    ),
}


def verify(
    catalog: CatalogUrl,
    snapshot: AtSnapshot = None,
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
        rows = [{"check": one.name, "result": _result(one.passed), "detail": one.detail} for one in made]
        _write_rows(rows, format_)
    if not all(check.passed for check in made):
        raise typer.Exit(UNVERIFIED)


def doctor(
    catalog: Annotated[
        str | None, typer.Argument(metavar="[CATALOG]", help="Look at this catalog's folder as well.")
    ] = None,
    format_: OutputFormat = "table",
) -> None:
    """Check this machine, and the folder and state of CATALOG.

    Exits with 1 if something fails.
    """
    from motionary.workflows.doctor import examine

    found = []
    for finding in examine(catalog):
        found.append(finding)
        if format_ == "table":
            mend = f"; {finding.mend}" if finding.mend else ""
            print(f"{finding.state}  {finding.what}: {finding.detail}{mend}", flush=True)
    if format_ != "table":
        _write_rows([vars(finding) for finding in found], format_)
    if any(finding.state == "FAILED" for finding in found):
        raise typer.Exit(FAILED)


def _write_rows(rows: list[dict[str, str]], format_: OutputFormat) -> None:
    import pyarrow as pa

    from motionary.workflows.tables import write_table

    write_table(pa.Table.from_pylist(rows), format_)


def _result(passed: bool) -> str:
    return "PASSED" if passed else "FAILED"
