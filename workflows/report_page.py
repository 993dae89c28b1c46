"""The report of a catalog as a file: one HTML page, written whole or not at all."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from motionary.catalog import Catalog
from motionary.catalog.views.report.page import report_page, snapshot_before
from motionary.pipeline.writers import whole_file
from motionary.workflows.errors import UserError


@dataclass(frozen=True)
class WrittenReport:
    """A report that was written.

    Parameters
    ----------
    file : str
    bytes : int
    snapshot : str
        What it shows.
    against : str or None
        The snapshot that it tells the changes since; None where none is left.
    clips, clusters : int
    """

    file: str
    bytes: int
    snapshot: str
    against: str | None
    clips: int
    clusters: int


def write_report_page(
    catalog: Catalog, file: Path, before: Catalog | None = None, *, overwrite: bool = False
) -> WrittenReport:
    """Write the report of a catalog.

    Parameters
    ----------
    catalog : Catalog
    file : Path
        HTML, in a folder that is there.
    before : Catalog, optional
        Since when changes are told; the newest earlier snapshot that is left, where this is not given.
    overwrite : bool
        Replace a file that is there.

    Raises
    ------
    UserError
        The file is there already, or its folder is not.
    """
    if file.is_dir():
        raise UserError(f"{file} is a folder; name a file in it")
    if file.exists() and not overwrite:
        raise UserError(f"{file} is there already; replace it with --overwrite, or name another file")
    if not file.absolute().parent.is_dir():
        raise UserError(f"there is no folder {file.absolute().parent} to write {file.name} to; make it")
    earlier = before or snapshot_before(catalog)
    try:
        content = report_page(catalog, earlier).encode("utf-8", "replace")
    finally:
        if earlier is not None and earlier is not before:
            earlier.close()
    with whole_file(file) as temporary, temporary.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    run = catalog.last_run
    against = None if earlier is None else earlier.snapshot.snapshot_id
    return WrittenReport(
        str(file), len(content), catalog.snapshot.snapshot_id, against, run["clips"], run["clusters"]
    )
