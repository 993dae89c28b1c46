"""Runs what is not stored yet, and remembers what has been stored."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import cached_property

from motionary.catalog.errors import CatalogError
from motionary.catalog.snapshot import Snapshot, read_snapshot, snapshot_ids
from motionary.catalog.store import PartFacts, Store
from motionary.pipeline.task import Task, TaskReport
from motionary.workflows.scheduler import Workers


class StoredParts:
    """The parts that a catalog's folder holds, whether a snapshot names them or not: one listing a table.

    Parameters
    ----------
    store : Store
        The catalog.
    before : Snapshot, optional
        The published one.
    """

    def __init__(self, store: Store, before: Snapshot | None) -> None:
        self._store = store
        self._before = before
        self._keys: dict[str, set[str]] = {}
        self._damaged: set[str] = set()

    def __call__(self, key: str, tables: Iterable[str]) -> bool:
        """Say whether a result is stored whole."""
        return all(key in self._of(table) for table in tables)

    def facts(self, key: str, tables: Iterable[str]) -> dict[str, PartFacts] | None:
        """Return what the parts of a result are known by; None where one is missing or not what was written.

        Parts of the published snapshot are taken at its word, which `verify` checks. Others were left by a
        run that was cut short, or belong to older snapshots: they are read.
        """
        tables = tuple(tables)
        if not self(key, tables):
            return None
        found = {}
        for table in tables:
            file = self._store.part_name(table, key)
            if self._before and file in self._before.parts:
                found[table] = self._before.parts[file]
                continue
            try:
                facts = self._store.facts(file)
            except (OSError, ValueError):  # pyarrow says so of a damaged file
                facts = None
            if facts is None or facts != self._older.get(file, facts):
                self._damaged.add(file)
                return None
            found[table] = facts
        return found

    def remove_damaged(self) -> None:
        """Remove the files that `facts` found not to be what was written: a task would take them for done."""
        while self._damaged:
            self._store.delete(self._damaged.pop())

    def add(self, report: TaskReport) -> None:
        """Take note of a result that has been stored."""
        for table in report.stored:
            self._of(table).add(report.key)

    @cached_property
    def _older(self) -> dict[str, PartFacts]:
        facts: dict[str, PartFacts] = {}
        for one in snapshot_ids(self._store):
            with suppress(CatalogError, FileNotFoundError):  # a manifest that is damaged knows nothing
                facts |= read_snapshot(self._store, one).parts
        return facts

    def _of(self, table: str) -> set[str]:
        if table not in self._keys:
            paths = self._store.names(f"tables/{table}")
            self._keys[table] = {
                posixpath.basename(path).removesuffix(".parquet")
                for path in paths
                if path.endswith(".parquet")
            }
        return self._keys[table]


class Computation:
    """The part of a run that computes.

    Parameters
    ----------
    store : Store
        Where results go.
    stored : StoredParts
        What is there.
    workers : Workers
        Who computes the rest.
    done : callable
        Called with the stage of every task that is done.
    """

    def __init__(
        self, store: Store, stored: StoredParts, workers: Workers, done: Callable[[str], object]
    ) -> None:
        self._store, self._stored, self._workers, self._done = store, stored, workers, done

    def run(self, tasks: Sequence[Task]) -> list[TaskReport]:
        """Compute what is not stored.

        Returns
        -------
        list of TaskReport
            Of all tasks, in their order.
        """
        stored = {task.key: self._stored.facts(task.key, task.makes) for task in tasks}
        missing = [task for task in tasks if stored[task.key] is None]
        self._stored.remove_damaged()
        reports = {report.key: report for report in self._workers.compute(missing, self._store, self._done)}
        for report in reports.values():
            self._stored.add(report)
        found = []
        for task in tasks:
            if task.key not in reports:
                self._done(task.stage)
            facts = stored[task.key] or {}
            found.append(reports.get(task.key) or TaskReport(task.stage, task.key, 0.0, False, facts))
        return found
