"""The report of a catalog as a file: one HTML page, written whole or not at all."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from motionary.catalog import Catalog
from motionary.catalog.views.report.changes import changes_since, changes_since_last
from motionary.catalog.views.report.page import report_page
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
        The snapshot that it tells the changes since; None where none is left that can be read.
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
        Since when changes are told; the newest earlier snapshot that is left, where this is not given: the
        page says so if that cannot be read.
    overwrite : bool
        Replace a file that is there.

    Raises
    ------
    UserError
        The file is there already, or its folder is not; or `before` is not older than what is shown.
    CatalogError
        A file of the catalog, or of `before`, is damaged.
    """
    if file.is_dir():
        raise UserError(f"{file} is a folder; name a file in it")
    if file.exists() and not overwrite:
        raise UserError(f"{file} is there already; replace it with --overwrite, or name another file")
    if not file.absolute().parent.is_dir():
        raise UserError(f"there is no folder {file.absolute().parent} to write {file.name} to; make it")
    if before is not None:
        _refuse_unless_older(before.snapshot.snapshot_id, catalog.snapshot.snapshot_id)
    since = changes_since_last(catalog) if before is None else changes_since(catalog, before)
    content = report_page(catalog, since).encode("utf-8", "replace")
    with whole_file(file) as temporary, temporary.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    run = catalog.last_run
    against = None
    if since is not None and not isinstance(since.changes, str):
        against = since.snapshot.snapshot_id
    return WrittenReport(
        file=str(file),
        bytes=len(content),
        snapshot=catalog.snapshot.snapshot_id,
        against=against,
        clips=run["clips"],
        clusters=run["clusters"],
    )


def _refuse_unless_older(against: str, shown: str) -> None:
    if int(against) >= int(shown):
        raise UserError(
            f"snapshot {against} is not older than snapshot {shown}, which is shown: name an earlier one"
        )
