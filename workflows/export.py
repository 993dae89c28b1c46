"""Motions of a catalog as files, with progress and with what could not be written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager

from motionary.catalog.export import ExportedClip, write_export
from motionary.catalog.export_plan import ExportPlan
from motionary.workflows.progress import Advance
from motionary.workflows.summary import counted


def write_with_progress(
    plan: ExportPlan, show_progress: Callable[[Mapping[str, int]], AbstractContextManager[Advance]]
) -> list[ExportedClip]:
    """Write the files of a plan.

    Parameters
    ----------
    plan : ExportPlan
        See `motionary.catalog.export_plan.plan_export`.
    show_progress : callable
        As `motionary.workflows.progress.progress`.

    Returns
    -------
    list of ExportedClip
        The clips that could not be written.

    Raises
    ------
    CatalogError
        The folder cannot be written.
    """
    failed = []
    with show_progress({"export": len(plan.clips)}) as done:
        for one in write_export(plan):
            if one.reason is not None:
                failed.append(one)
            done("export")
    return failed


def export_summary(plan: ExportPlan, failed: int) -> str:
    """Say what was written where, in a line."""
    time = "in the time of their clusters' references" if plan.table == "aligned" else "as captured"
    written = counted(len(plan.clips) - failed, "clip")
    if plan.format == "parquet":
        names = f"{plan.table}.parquet, clips.parquet"
        return f"wrote {written}, {time}, to {plan.folder} ({names})"
    return f"wrote {written} as {plan.format.upper()}, {time}, to {plan.folder}"
