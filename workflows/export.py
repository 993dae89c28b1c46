"""Motions of a catalog as files, with progress and with what could not be written."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from motionary.catalog.export import ExportedClip, write_export
from motionary.catalog.export_plan import ONE_FILE, ExportPlan
from motionary.workflows.progress import Advance
from motionary.workflows.summary import counted

_FAR = 0.02  # of all clips: shares further off are worth a remark


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


def export_summary(plan: ExportPlan, failed: Sequence[ExportedClip]) -> str:
    """Say what was written where, in a line, and in one more for a split."""
    time = "in the time of their clusters' references" if plan.table == "aligned" else "as captured"
    written = counted(len(plan.clips) - len(failed), "clip")
    line = f"wrote {written} as {plan.format.upper()}, {time}, to {plan.folder}"
    if plan.format in ONE_FILE:
        names = dict.fromkeys(path.relative_to(plan.folder).as_posix() for path in plan.paths.values())
        listed = [*names, *(["clips.parquet"] if plan.format == "parquet" else [])]
        line = f"wrote {written}, {time}, to {plan.folder} ({', '.join(listed)})"
    if plan.split is None:
        return line
    lost = {one.clip_id for one in failed}
    counts = Counter(part for clip_id, part in plan.split.part_of.items() if clip_id not in lost)
    total = max(counts.total(), 1)
    parts = [
        f"{part} {counts[part]} ({counts[part] / total:.1%}, asked {share:.4g})"
        for part, share in plan.split.shares.items()
    ]
    return f"{line}\n{', '.join(parts)}; {plan.folder / 'README.md'} tells what was kept together"


def export_record(plan: ExportPlan, failed: Sequence[ExportedClip]) -> dict[str, Any]:
    """Say as plain values what was written where."""
    lost = {one.clip_id for one in failed}
    part_of = plan.split.part_of if plan.split else {}
    return {
        "folder": str(plan.folder),
        "format": plan.format,
        "written": [
            {"clip_id": clip_id, "path": str(path), "split": part_of.get(clip_id)}
            for clip_id, path in plan.paths.items()
            if clip_id not in lost
        ],
        "failed": [{"clip_id": one.clip_id, "reason": one.reason} for one in failed],
    }


def split_remarks(plan: ExportPlan) -> list[str]:
    """Say what a person should know of a split before trusting it."""
    if plan.split is None:
        return []
    split, remarks = plan.split, []
    if split.without:
        remarks.append(
            f"{counted(split.without, 'clip')} without a value in {' or '.join(split.columns)} "
            f"{'is' if split.without == 1 else 'are'} kept together: they may be of one that another part has"
        )
    counts = Counter(split.part_of.values())
    for part, share in split.shares.items():
        got = counts[part] / len(split.part_of)
        if abs(got - share) > _FAR:
            remarks.append(
                f"part {part} has {got:.0%} of the clips instead of {share:.0%}: whole groups allow no nearer"
            )
    return remarks
