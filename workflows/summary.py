"""What a run or a catalog has to show, in a terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console, Group, RenderableType
from rich.markup import escape

from motionary.catalog import Catalog
from motionary.catalog.landmarks import route_note, route_of
from motionary.catalog.snapshot import OVERVIEW
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.views.linkages import linkages_by_distance
from motionary.catalog.views.scores import score_columns, score_note, score_row
from motionary.workflows.tables import text_table

_MOST_CLUSTERS = 40


_HOW_FAR = (
    " How far they may be from exact: motionary reproduce landmarks, on a catalog of all pairs of a smaller "
    "library"
)


def print_summary(catalog: Catalog, console: Console) -> None:
    """Print a catalog's clips, clusters, scores, times and place."""
    run = catalog.last_run
    clips, clusters = counted(run["clips"], "clip"), counted(run["clusters"], "cluster")
    console.print(f"{clips}, {run['quarantined']} quarantined, {clusters}")
    if note := route_note(catalog):
        console.print(f"{note}{_HOW_FAR}" if route_of(catalog) == "landmarks" else note)
    parts: list[RenderableType] = []
    if run["quarantined"]:
        parts += ["", quarantine_table(catalog)]
    if run["clips"]:
        parts += ["", clusters_shown(catalog), "", cut_table(catalog)]
    parts += ["", _times(run), "", _places(catalog)]
    console.print(Group(*parts))


def summary_record(catalog: Catalog) -> dict[str, Any]:
    """Say as plain values what `print_summary` prints."""
    run = catalog.last_run
    return {
        "catalog": catalog.store.url,
        "snapshot": catalog.snapshot.snapshot_id,
        "run_id": run["run_id"],
        "clips": run["clips"],
        "clusters": cluster_table(catalog).to_pylist(),
        "cuts": catalog.cuts.to_arrow().to_pylist(),
        "quarantine": catalog.quarantine.to_arrow().to_pylist(),
        "seconds": (run["finished_at"] - run["started_at"]).total_seconds(),
        "stage_seconds": dict(run["stage_seconds"]),
        "overview": catalog.store.full_path(OVERVIEW),
    }


def clusters_shown(catalog: Catalog) -> RenderableType:
    """List the published clusters: size, labelled clips, name, purity where labels are known, reference."""
    clusters = cluster_table(catalog).to_pylist()
    rows = [
        [
            str(one["cluster_id"]),
            str(one["size"]),
            str(one["labelled"]),
            one["label"] or "unnamed",
            _purity(one["purity"]),
            one["reference"],
        ]
        for one in clusters[:_MOST_CLUSTERS]
    ]
    title = "Clusters"
    if len(clusters) > _MOST_CLUSTERS:
        title += f' (the {_MOST_CLUSTERS} largest of {len(clusters)}; all: select * from "references")'
    return text_table(["cluster", "clips", "labelled", "name", "purity", "reference"], rows, title)


def cut_table(catalog: Catalog) -> RenderableType:
    """List a cut for each distance with its scores."""
    cuts = [one.cut for one in linkages_by_distance(catalog)]
    return text_table(
        score_columns(cuts), [score_row(cut) for cut in cuts], f"Distances ({score_note(cuts)})"
    )


def quarantine_table(catalog: Catalog) -> RenderableType:
    """List the files that could not be read."""
    rows = [
        [row["path"], str(row["line"] or ""), row["reason"], row["mend"]]
        for row in catalog.quarantine.to_arrow().to_pylist()
    ]
    return text_table(["file", "line", "reason", "mend"], rows, "Quarantined")


def clip_record(catalog: Catalog, clip_id: str) -> dict[str, Any]:
    """Say as plain values what is known of one clip.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    """
    catalog.require(clip_id)
    query = """select takes.*, reference_id, correlation_before, correlation
               from takes join alignments using (clip_id) where clip_id = ?"""
    return catalog.sql(query, [clip_id]).to_pylist()[0]


def print_clip(catalog: Catalog, clip_id: str, console: Console) -> None:
    """Print what is known of one clip.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    """
    row = clip_record(catalog, clip_id)
    facts = {
        "frames": f"{row['frames']} at {row['fps']:g} a second, {row['seconds']:.2f} s",
        "label": f"{row['label'] or 'none'} ({row['label_source']}, confidence {row['confidence']:.2f})",
        "cluster": str(row["cluster_id"]) + (", its reference" if row["is_reference"] else ""),
        "reference": f"{row['reference_id']}, at distance {row['distance_to_reference']:.4f}",
        "correlation": f"{row['correlation_before']:.3f} length-matched, {row['correlation']:.3f} aligned",
        "notes": "; ".join(row["notes"]) or "none",
    }
    console.print(text_table([clip_id, ""], list(facts.items())))


def _times(run: dict) -> str:
    total = (run["finished_at"] - run["started_at"]).total_seconds()
    stages = ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in run["stage_seconds"])
    return f"Time: {total:.1f} s from start to end; seconds of work: {stages}"


def _places(catalog: Catalog) -> str:
    store = catalog.store
    return (
        f"Catalog:  {escape(store.url)} (snapshot {catalog.snapshot.snapshot_id})\n"
        f"Overview: {escape(store.full_path(OVERVIEW))}"
    )


def _purity(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def counted(number: int, noun: str) -> str:
    """Say how many."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
