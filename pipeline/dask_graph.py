"""Tasks as Dask wants them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from dask.task_spec import List, TaskRef
from dask.task_spec import Task as DaskTask

from motionary.pipeline.task import TableStore, Task, TaskReport, run_task


def dask_graph(
    tasks: Iterable[Task],
    store: TableStore,
    run: Callable[[Task, TableStore, Sequence[TaskReport]], TaskReport] = run_task,
    suffix: str = "",
) -> dict[str, DaskTask]:
    """Write tasks as Dask wants them; each computes to its `TaskReport`.

    Parameters
    ----------
    tasks : iterable of Task
    store : TableStore
        Where results are.
    run : callable
        What runs one.
    suffix : str
        Ends their names: a scheduler takes tasks of one name for one, be they for two stores or not.
    """
    names = {task.key: f"{task.stage}-{task.key}{suffix}" for task in tasks}
    return {
        names[task.key]: DaskTask(
            names[task.key], run, task, store,
            List(*(TaskRef(names[key]) for key in task.after if key in names)),
        )
        for task in tasks
    }  # fmt: skip
