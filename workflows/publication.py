"""What a run leaves: its record, a new snapshot, the overview page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import UTC, datetime

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog import Catalog
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.snapshot import OVERVIEW, Snapshot, next_snapshot_id, publish
from motionary.catalog.store import Store
from motionary.catalog.views.overview import overview_page
from motionary.pipeline.task import MAKES, TaskReport
from motionary.workflows.errors import UserError
from motionary.workflows.preparation import Prepared
from motionary.workflows.versions import versions

Check = Callable[[Catalog | None, Catalog], object]
"""Given the published catalog, None where there is none, and the one to be published; raises to refuse."""


def publish_run(
    ready: Prepared,
    made: Sequence[TaskReport],
    started: datetime,
    check: Check,
) -> Catalog:
    """Write the run's record, publish the snapshot, and leave the overview page beside it.

    Parameters
    ----------
    ready : Prepared
        The job.
    made : sequence of TaskReport
        Of all its tasks.
    started : datetime
        When it began.
    check : callable
        Asked before anything is published.

    Raises
    ------
    UserError
        The page could not be written. The snapshot is published then.
    """
    store, before = ready.store, ready.before
    snapshot_id = next_snapshot_id(store)
    tables: dict[str, list[str]] = {}
    for report in made:
        for table in MAKES[report.stage]:
            tables.setdefault(table, []).append(store.part_name(table, report.key))
    parts = {
        store.part_name(table, report.key): facts for report in made for table, facts in report.stored.items()
    }
    run_id = f"{started:%Y%m%dT%H%M%SZ}-{snapshot_id}"
    runs = store.read(before.tables["runs"]) if before else SCHEMAS["runs"].empty_table()
    record = _record(ready, made, tables, run_id, started)
    own = {
        "inputs": ready.inputs,
        "labels": ready.labels,
        "runs": pa.concat_tables([runs, record], promote_options="default"),
    }
    for table, rows in own.items():
        file, parts[file] = store.save_whole(table, rows)
        tables[table] = [file]
    if before:
        parts = {**before.parts, **parts}
    facts = {file: parts[file] for file in sorted({file for files in tables.values() for file in files})}
    now = datetime.now(UTC).isoformat(timespec="seconds")
    snapshot = Snapshot(snapshot_id, now, tables, facts, ready.graph.settings, versions())

    catalog = Catalog(store, snapshot)
    check(Catalog(store, before) if before else None, catalog)
    publish(store, snapshot, before)
    _write_overview(catalog)
    return Catalog.open(store.url)


def _write_overview(catalog: Catalog) -> None:
    try:
        catalog.store.write(OVERVIEW, overview_page(catalog).encode())
    except OSError as error:
        raise UserError(
            f"snapshot {catalog.snapshot.snapshot_id} is published, but its page is not: "
            f"{catalog.store.full_path(OVERVIEW)}: {error.strerror or error}; mend that and run again"
        ) from error


def _record(
    ready: Prepared, made: Sequence[TaskReport], tables: dict[str, list[str]], run_id: str, started: datetime
) -> pa.Table:
    store, seconds = ready.store, dict.fromkeys(ready.graph.tasks_by_stage(), 0.0)
    for report in made:
        seconds[report.stage] += report.seconds
    row = {
        "run_id": run_id,
        "started_at": started,
        "finished_at": datetime.now(UTC),
        "version": versions()["motionary"],
        "library": list(ready.roots),
        "settings": json.dumps(asdict(ready.job.config), sort_keys=True),
        "clips": store.rows(tables["clips"]),
        "quarantined": store.rows(tables["quarantine"]),
        "clusters": store.rows(tables["references"]),
        "clips_read": ready.plan.to_read,
        "pairs_computed": ready.plan.to_store + _passing_pairs(store, made),
        "stage_seconds": list(seconds.items()),
        "side": ready.side,
    }
    return pa.Table.from_pylist([row], schema=SCHEMAS["runs"])


def _passing_pairs(store: Store, made: Sequence[TaskReport]) -> int:
    """Add up what tasks compared and did not keep, as they say."""
    counts = [
        pc.sum(store.load(report.key, table, ["compared"])["compared"]).as_py() or 0
        for report in made
        if report.computed
        for table in ("assigned", "refined")
        if table in MAKES[report.stage]
    ]
    return sum(counts)
