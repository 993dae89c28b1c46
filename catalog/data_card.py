"""What a person should know who gets an export and not the catalog: the data card.

`card.json` for programs, `README.md` the same for people, `clips.jsonl` a line a clip: its file, its part of
a split, its cluster and name, every supplied label, `licence` among them. Counts are of the clips that were
written. Nothing in it depends on when or where the export is made: equal exports have equal cards.

Clips whose labels name no licence are counted apart, and listed: nobody has said what may be done with them.
"""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import PurePosixPath
from typing import Any

from motionary.catalog.card_text import card_text
from motionary.catalog.export_plan import ExportPlan, Split
from motionary.pipeline.writers import whole_file

_CREDITS = ("attribution", "citation", "source")
"""Label columns that say how a clip's source is to be named."""

_SOURCES = ("dataset", "format", "licence")


def write_card(plan: ExportPlan, failed: Mapping[str, str]) -> None:
    """Write the card and the list of clips into an export's folder.

    Parameters
    ----------
    plan : ExportPlan
    failed : mapping of str to str
        Clips that were not written, each with the reason.
    """
    clips = _clips(plan, failed)
    card = data_card(plan, clips, failed)
    lines = [json.dumps(clip, ensure_ascii=False, default=str) + "\n" for clip in clips]
    contents = {
        "clips.jsonl": "".join(lines),
        "card.json": json.dumps(card, ensure_ascii=False, indent=1, default=str) + "\n",
        "README.md": card_text(card),
    }
    for name, content in contents.items():
        with whole_file(plan.folder / name) as file:
            file.write_text(content, encoding="utf-8", newline="\n")


def data_card(plan: ExportPlan, clips: Sequence[Mapping], failed: Mapping[str, str]) -> dict[str, Any]:
    """Sum an export up.

    Parameters
    ----------
    plan : ExportPlan
    clips : sequence of mapping
        What is known of every clip that was written.
    failed : mapping of str to str
        As in `write_card`.

    Returns
    -------
    dict
        What `card.json` holds.
    """
    run = plan.catalog.last_run
    parts = list(plan.split.shares) if plan.split else []
    unlicensed = [clip for clip in clips if not clip.get("licence")]
    return {
        "catalog": PurePosixPath(plan.catalog.store.url.rstrip("/")).name,
        "snapshot": plan.catalog.snapshot.snapshot_id,
        "run": run["run_id"],
        "libraries": [PurePosixPath(root).name for root in run["library"]],
        "versions": {"run": run["version"]}
        | {name: version(name) for name in ("motionary", "numpy", "pyarrow")}
        | {"python": platform.python_version()},
        "format": plan.format,
        "poses": plan.table,
        "chosen_by": dict(plan.chosen_by),
        **_totals(clips),
        "not_written": dict(failed),
        "split": plan.split and _split(plan.split, clips),
        "labels": _summed(clips, ("label", "label_source"), parts),
        "clusters": _summed(clips, ("cluster_id",), parts),
        "sources": _summed(clips, _SOURCES, parts),
        "licences": _summed([clip for clip in clips if clip.get("licence")], ("licence",), parts),
        "without_licence": _totals(unlicensed) | {"clip_ids": [clip["clip_id"] for clip in unlicensed]},
        "credits": sorted({clip[name] for clip in clips for name in _CREDITS if clip.get(name)}),
        "settings": plan.catalog.settings,
    }


def _clips(plan: ExportPlan, failed: Mapping[str, str]) -> list[dict[str, Any]]:
    """Tell of every clip that was written what is known of it, and its file first."""
    found = []
    for known in plan.clips.drop_columns(["skeleton"]).to_pylist():
        clip_id = known["clip_id"]
        if clip_id not in failed:
            file = plan.paths[clip_id].relative_to(plan.folder).as_posix()
            found.append({"clip_id": clip_id, "file": file} | {k: v for k, v in known.items() if k != "file"})
    return found


def _split(split: Split, clips: Sequence[Mapping]) -> dict[str, Any]:
    parts = {name: [clip for clip in clips if clip["split"] == name] for name in split.shares}
    return {
        "parts": [
            {
                "part": name,
                "asked": share,
                "share": len(parts[name]) / max(len(clips), 1),
                "groups": split.groups[name],
            }
            | _totals(parts[name])
            for name, share in split.shares.items()
        ],
        "kept_together": ["bytes", *(["shared frames"] if split.shared_frames else []), *split.columns],
        "recordings": split.recordings,
        "without_value": split.without,
        "seed": split.seed,
    }


def _totals(clips: Sequence[Mapping]) -> dict[str, Any]:
    seconds = math.fsum(clip["seconds"] for clip in clips)
    return {
        "clips": len(clips),
        "seconds": round(seconds, 3),
        "frames": sum(clip["frames"] for clip in clips),
    }


def _summed(clips: Sequence[Mapping], columns: Sequence[str], parts: Sequence[str]) -> list[dict[str, Any]]:
    """Count clips by columns, the most first, and how many of them each part has."""
    groups: dict[tuple, list[Mapping]] = {}
    for clip in clips:
        groups.setdefault(tuple(clip.get(column) for column in columns), []).append(clip)
    ordered = sorted(groups.items(), key=lambda one: (-len(one[1]), *map(_order, one[0])))
    return [
        dict(zip(columns, values, strict=True))
        | _totals(members)
        | ({"parts": {part: sum(one["split"] == part for one in members) for part in parts}} if parts else {})
        for values, members in ordered
    ]


def _order(value: object) -> tuple[bool, int, str]:
    return value is None, value if isinstance(value, int) else 0, str(value)
