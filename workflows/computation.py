"""Runs what is not stored yet, and remembers what has been stored."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Iterable, Sequence

from motionary.catalog.store import Store
from motionary.pipeline.task import Task, TaskReport
from motionary.workflows.scheduler import Workers


class StoredParts:
    """The parts that a catalog's folder holds, whether a snapshot names them or not: one listing a table."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._keys: dict[str, set[str]] = {}

    def __call__(self, key: str, tables: Iterable[str]) -> bool:
        """Say whether a result is stored whole."""
        return all(key in self._of(table) for table in tables)

    def add(self, report: TaskReport) -> None:
        """Take note of a result that has been stored."""
        for table in report.stored:
            self._of(table).add(report.key)

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
        missing = [task for task in tasks if not self._stored(task.key, task.makes)]
        reports = {report.key: report for report in self._workers.compute(missing, self._store, self._done)}
        for report in reports.values():
            self._stored.add(report)
        found = []
        for task in tasks:
            if task.key not in reports:
                self._done(task.stage)
            found.append(reports.get(task.key) or TaskReport(task.stage, task.key, 0.0, False, {}))
        return found
