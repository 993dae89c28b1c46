"""From the options of `run` to its job."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from motionary.workflows.preparation import Job


def job_of(
    *,
    library: Path,
    catalog: str,
    also: list[Path] | None,
    labels: Path | None,
    label_pattern: str | None,
    label_column: str | None,
    paper: bool,
    primary: str | None,
    metric: str | None,
    clusters: int | None,
    threshold: float | None,
    prune: bool,
    landmarks: str | None,
    weights: str | None,
    full_grid: bool,
    travel: bool,
    config: Path | None,
    workers: int | None,
    memory: int | None,
    scheduler: str | None,
) -> Job:
    """Make a job of the options of `run`."""
    from motionary.workflows.preparation import Job
    from motionary.workflows.settings import PAPER, load_settings

    if clusters is not None and threshold is not None:
        raise typer.BadParameter("give --clusters or --threshold, not both")
    options: dict[str, dict[str, Any]] = {"clusters": {}, "features": {}}
    if paper:
        options = {stage: dict(fields) for stage, fields in PAPER.items()}
    given = {
        "primary": primary, "metric": metric, "n_clusters": clusters, "threshold": threshold,
        "label_column": label_column,
    }  # fmt: skip
    options["clusters"] |= {name: value for name, value in given.items() if value is not None}
    # Of two that exclude each other the one given here wins over one of the file or the environment.
    if clusters is not None:
        options["clusters"]["threshold"] = None
    if threshold is not None:
        options["clusters"]["n_clusters"] = None
    if not travel:
        options["features"]["travel_time"] = 0.0
    if prune and landmarks is not None:
        raise typer.BadParameter("give --prune or --landmarks, not both")
    if prune:
        options["distances"] = {"pairs": "pruned"}
        options["clusters"]["landmarks"] = None
    if landmarks is not None:
        options["distances"] = {"pairs": "landmarks"}
        options["clusters"]["landmarks"] = _landmarks(landmarks)
    options["alignment"] = ({"weights": weights} if weights else {}) | (
        {"search": "full"} if full_grid else {}
    )
    libraries = [str(one) for one in (library, *(also or []))]
    settings = load_settings(config, options)
    return Job(libraries, catalog, settings, labels, worker_count(workers), scheduler, label_pattern, memory)


def worker_count(workers: int | None) -> int:
    """Return how many worker processes there are to be: as many as cores, unless somebody says."""
    from dask.system import CPU_COUNT

    return workers or CPU_COUNT


def _landmarks(given: str) -> int | None:
    if given == "auto":
        return None
    if not given.isdecimal() or not int(given):
        raise typer.BadParameter(f"--landmarks is {given!r}; give a number from 1, or auto")
    return int(given)
