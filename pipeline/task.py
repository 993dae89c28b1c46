"""A task: whose result it makes, from what, and how it is run. Dask is the graph's affair."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import pyarrow as pa
from threadpoolctl import threadpool_limits

from motionary.pipeline.parts import Parts
from motionary.pipeline.stages import (
    align,
    assign,
    cluster,
    compare,
    identify,
    ingest,
    name,
    refine,
    regroup,
    represent,
    resample,
    sample,
    stand,
    style,
)
from motionary.pipeline.tables import TABLES

MAKES = {
    "ingest": ingest.MAKES, "resample": resample.MAKES, "sample": sample.MAKES, "compare": compare.MAKES,
    "cluster": cluster.MAKES, "stand": stand.MAKES, "assign": assign.MAKES, "refine": refine.MAKES,
    "regroup": regroup.MAKES, "identify": identify.MAKES, "represent": represent.MAKES, "align": align.MAKES,
    "style": style.MAKES, "name": name.MAKES,
}  # fmt: skip
"""The tables that each stage's results consist of; the stages in the order of the run."""

OF_LANDMARKS = ("sample", "stand", "assign", "refine", "regroup")
"""Stages that a run has where it clusters by landmarks; no other has them."""


class TableStore(Protocol):
    """Where results are kept; it travels to the workers."""

    def save(self, key: str, tables: Mapping[str, pa.Table]) -> Mapping[str, Any]:
        """Store a result's tables and say of each what the caller wants to know."""

    def load(self, key: str, table: str, columns: Sequence[str] | None = None) -> pa.Table:
        """Return a stored table, or some of its columns with their text as dictionaries."""

    def stored(self, key: str, tables: Iterable[str]) -> Mapping[str, Any] | None:
        """Say of a result's tables what `save` said; None where one of them is missing or damaged."""


IsStored = Callable[[str, Iterable[str]], bool]
"""Given a key and tables, whether the store has them."""


@dataclass(frozen=True)
class Task:
    """A task of the graph.

    Parameters
    ----------
    stage, key : str
        Whose result it makes.
    body : callable
        Given the tables that it reads, those that it streams, the arguments and, where `carries` is not None,
        the carried results: the tables of `MAKES`.
    reads : sequence of (table, keys)
        Parts that are joined to one table each; no keys stand for an empty table.
    arguments : tuple
    streams : sequence of (table, keys)
        Tables that would not fit into memory whole: given as `Parts`.
    carries : sequence of (key, what), optional
        Results of the same stage that hold some of the rows, and which.
    """

    stage: str
    key: str
    body: Callable[..., dict[str, pa.Table]]
    reads: Sequence[tuple[str, Sequence[str]]]
    arguments: tuple[Any, ...]
    streams: Sequence[tuple[str, Sequence[str]]] = ()
    carries: Sequence[tuple[str, Any]] | None = None

    @property
    def makes(self) -> tuple[str, ...]:
        """The tables of its result."""
        return MAKES[self.stage]

    @property
    def after(self) -> list[str]:
        """The keys of the results that it waits for."""
        read = [key for _, keys in (*self.reads, *self.streams) for key in keys]
        return [*dict.fromkeys([*read, *(key for key, _ in self.carries or ())])]


@dataclass(frozen=True)
class TaskReport:
    """What a task tells its caller: whose result it made, in what time, or that it was there already.

    `stored` is what the store says of each table.
    """

    stage: str
    key: str
    seconds: float
    computed: bool
    stored: Mapping[str, Any]


def run_task(task: Task, store: TableStore, before: Sequence[TaskReport] = ()) -> TaskReport:
    """Run a stage's body on the tables it reads and store what it makes, unless that is there already.

    It is where a worker died after it had stored its result, and Dask repeats the task. `before` is what must
    have happened first; the tables themselves come from the store.
    """
    start = time.perf_counter()
    stored = store.stored(task.key, task.makes)
    computed = stored is None
    if stored is None:
        with threadpool_limits(1):  # workers share the cores among them, a process a core
            made = task.body(*_inputs(task, store))
        # In one piece: a file must not show how its table came about.
        stored = store.save(task.key, {table: rows.combine_chunks() for table, rows in made.items()})
    return TaskReport(task.stage, task.key, time.perf_counter() - start, computed, stored)


def _inputs(task: Task, store: TableStore) -> list[Any]:
    inputs: list[Any] = [_joined(store, table, keys) for table, keys in task.reads]
    inputs += [Parts(partial(_part, store, table), keys) for table, keys in task.streams]
    inputs += task.arguments
    if task.carries is not None:
        inputs.append(
            [({table: store.load(key, table) for table in task.makes}, what) for key, what in task.carries]
        )
    return inputs


def _joined(store: TableStore, table: str, keys: Sequence[str]) -> pa.Table:
    if not keys:
        return TABLES[table].empty_table()
    return pa.concat_tables([store.load(key, table) for key in keys])


def _part(store: TableStore, table: str, key: str, columns: Sequence[str] | None) -> pa.Table:
    return store.load(key, table, columns)
