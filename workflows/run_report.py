"""The report of a nightly run: `<run_id>.json`, written whole or not at all, also when the run fails.

A run that published leaves a page, `<run_id>.html`, beside it: see `motionary.workflows.report_page`.

Where another run has a report of that name, as one of another catalog that began in the same second, this one
is `<run_id>-2.json`: no report takes another's place.
"""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from motionary.catalog import Catalog
from motionary.catalog.views.cluster_table import cluster_table
from motionary.pipeline.writers import whole_file
from motionary.workflows.limits import Measured
from motionary.workflows.versions import versions


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@dataclass
class RunReport:
    """What became of a nightly run, filled while it runs.

    Parameters
    ----------
    config, catalog : str
        The configuration file; the catalog's folder or URL.
    libraries : list of str
    settings : mapping
        Of the job and its stages.
    run_id : str
        As in table `runs`; of a run that published nothing, its start and its status.
    status : {"published", "refused", "failed"}
        `refused` by a limit. With an `error`, `published` means that the catalog is new and that something
        failed afterwards.
    exit_code : int
    error : str, optional
    started_at, finished_at : str
        ISO 8601, UTC.
    snapshot_before, snapshot_after : str, optional
        Published before the run, and by it.
    clips : mapping
        How many are new, changed, renamed, removed, unchanged, and what there was to do.
    quarantined : list of mapping
        path, line, reason, mend.
    clusters : list of mapping
        cluster_id, label, size, labelled, purity, reference.
    removed, moved, relabelled : list of mapping
        Against the snapshot before.
    limits : list of Measured
    stage_seconds : mapping of str to float
        Summed over the workers.
    vacuumed : mapping, optional
    host : str
    versions : mapping of str to str
    """

    config: str
    catalog: str
    libraries: list[str]
    settings: Mapping[str, Any]
    run_id: str = ""
    status: Literal["published", "refused", "failed"] = "failed"
    exit_code: int = 1
    error: str | None = None
    started_at: str = field(default_factory=_now)
    finished_at: str | None = None
    snapshot_before: str | None = None
    snapshot_after: str | None = None
    clips: Mapping[str, Any] = field(default_factory=dict)
    quarantined: list[dict[str, Any]] = field(default_factory=list)
    clusters: list[dict[str, Any]] = field(default_factory=list)
    removed: list[dict[str, Any]] = field(default_factory=list)
    moved: list[dict[str, Any]] = field(default_factory=list)
    relabelled: list[dict[str, Any]] = field(default_factory=list)
    limits: list[Measured] = field(default_factory=list)
    stage_seconds: Mapping[str, float] = field(default_factory=dict)
    vacuumed: Mapping[str, Any] | None = None
    host: str = field(default_factory=platform.node)
    versions: Mapping[str, str] = field(default_factory=versions)

    def describe(self, catalog: Catalog) -> None:
        """Take down what a catalog holds: quarantine, clusters and the run's own record."""
        self.quarantined = rows(catalog.quarantine.to_arrow())
        self.clusters = rows(cluster_table(catalog))
        run = catalog.last_run
        self.run_id = run["run_id"]
        self.stage_seconds = dict(run["stage_seconds"])

    def end(self) -> None:
        """Note the end; a run that published nothing gets a name of its own."""
        self.finished_at = _now()
        if self.status != "published":
            at = datetime.fromisoformat(self.started_at)
            self.run_id = f"{at:%Y%m%dT%H%M%SZ}-{self.status}"

    def to_json(self) -> str:
        """Return the report as JSON."""
        return json.dumps(asdict(self), indent=1, default=str)

    def write(self, folder: Path) -> Path:
        """Write the report to a folder, which is made where there is none; return its path.

        Raises
        ------
        OSError
            The folder cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{self.run_id}.json"
        for number in count(2):
            with suppress(FileExistsError), whole_file(file) as temporary:
                with temporary.open("w", encoding="utf-8") as stream:
                    stream.write(self.to_json() + "\n")
                    stream.flush()
                    os.fsync(stream.fileno())
                file.touch(exist_ok=False)  # takes the name, which the block's end replaces
                break
            file = folder / f"{self.run_id}-{number}.json"
        return file


def rows(table: pa.Table) -> list[dict[str, Any]]:
    """Return a table's rows as JSON can hold them: a number that is none is null."""
    return [{name: _finite(value) for name, value in row.items()} for row in table.to_pylist()]


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
