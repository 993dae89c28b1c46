"""The page of one clip: to be watched beside its reference, what is known of it, and what is like it."""

from __future__ import annotations

from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.description import duration
from motionary.catalog.query import Catalog
from motionary.catalog.web.data import wanted_clip
from motionary.catalog.web.opened import Shown
from motionary.catalog.web.render import render, shown_to
from motionary.catalog.web.search import label_columns, near_rows
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.style.rig import REGIONS

_NEIGHBOURS = 12


def clip(request: Request) -> Response:
    """Answer /clip?id=."""
    shown = shown_to(request)
    clip_id = wanted_clip(request, "id")
    known = shown.keep("answer", ("clip", clip_id), lambda: _known(shown.catalog, clip_id))
    return render(
        request,
        "clip.html",
        clip_id=clip_id,
        joints=CANONICAL_JOINTS,
        neighbours=shown.keep("answer", ("similar", clip_id), lambda: _neighbours(shown, clip_id)),
        **known,
    )


def _known(catalog: Catalog, clip_id: str) -> dict[str, Any]:
    """Read what the tables tell of a clip."""
    takes = _row(catalog, "takes", clip_id)
    alignment = _row(catalog, "alignments", clip_id, "source_time", "nodes", "eta")
    style = _row(catalog, "styles", clip_id)
    return {
        "row": takes,
        "reference": alignment["reference_id"],
        "labels": [(name, takes[name]) for name in label_columns(catalog) if takes[name] is not None],
        "named": _why_so_called(catalog, takes),
        "facts": _facts(takes),
        "scores": _scores(alignment),
        "style": _style(style),
        "style_kind": "in rad²"
        if style["kind"] == "rotations"
        else "in leg lengths², for the rigs of its cluster differ",
        "notes": takes["notes"] or [],
    }


def _row(catalog: Catalog, table: str, clip_id: str, *without: str) -> dict[str, Any]:
    columns = f"* exclude ({', '.join(without)})" if without else "*"
    return catalog.sql(f"select {columns} from {table} where clip_id = ?", [clip_id]).to_pylist()[0]


def _facts(row: dict[str, Any]) -> list[tuple[str, str]]:
    unit = "not known" if row["unit"] is None else f"{row['unit']:g} m"
    return [
        ("length", f"{duration(row['seconds'])}, {row['frames']} frames at {row['fps']:g} a second"),
        ("format", row["format"]),
        ("skeleton", row["convention"]),
        ("leg length", f"{row['leg_length']:.4g} source units"),
        ("one source unit", unit),
        ("file", row["path"]),
    ]


def _why_so_called(catalog: Catalog, row: dict[str, Any]) -> str:
    """Tell where a clip's name comes from."""
    match row["label_source"]:
        case "override":
            said = catalog.sql(
                "select set_by, set_at from labels where clip_id = ?", [row["clip_id"]]
            ).to_pylist()
            who = f"{said[0]['set_by']} said so on {said[0]['set_at']:%Y-%m-%d %H:%M} UTC" if said else ""
            return who or "a person said so"
        case "supplied":
            return "the label that came with the library"
        case "propagated":
            return f"named after its cluster, confidence {row['confidence']:.2f}"
        case _:
            return "no name: its cluster has none, or it lies too far from the cluster's reference"


def _scores(row: dict[str, Any]) -> list[tuple[str, str, str]]:
    """List how well it is aligned: what, the figure, what that means."""
    seconds = row["segment_length"] / row["frame_rate"]
    frames = f"{row['segment_length']} frames at {row['frame_rate']:g} a second"
    return [
        ("correlation before", f"{row['correlation_before']:.3f}", "with the reference, only stretched"),
        ("correlation aligned", f"{row['correlation']:.3f}", "the same, in the reference's time"),
        ("distortion", f"{row['distortion']:.4f}", "|h| of CoTW: how much the warp bent the motion"),
        ("segment", f"{seconds:.2f} s", f"{frames}, bent by at most {row['slack']}"),
    ]  # fmt: skip


def _style(row: dict[str, Any]) -> list[tuple[str, float, float]]:
    """List what it does that its reference does not, by region: energy, and its share of the greatest."""
    energies = [(region, row[f"energy_{region}"]) for region in REGIONS]
    most = max(value for _, value in energies) or 1.0
    return [(region, value, value / most) for region, value in sorted(energies, key=lambda one: -one[1])]


def _neighbours(shown: Shown, clip_id: str) -> list[dict[str, Any]]:
    if len(shown.catalog.clips) < 2:
        return []
    return near_rows(shown.catalog, shown.catalog.similar(clip_id, _NEIGHBOURS))
