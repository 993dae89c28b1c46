"""What changed since an earlier snapshot: how much of what, and which clips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pyarrow as pa

from motionary.catalog.history import diff
from motionary.catalog.query import Catalog
from motionary.catalog.views.page import Cell, Html, details, facts, isolated, section, table
from motionary.catalog.views.sections import left_out

MOST_ROWS = 100
_NAME, _TITLE = "changes", "What changed"

Row = dict[str, Any]


def changes_section(catalog: Catalog, before: Catalog | None) -> str:
    """Tell what changed since `before`, or what the catalog still knows of that where it is gone."""
    if before is None:
        return _without_snapshot(catalog)
    changes = diff(before, catalog)
    kinds: list[tuple[str, str, pa.Table, Sequence[str], Callable[[Row], list[Cell]]]] = [
        ("added", "added", changes.added, ["clip"], lambda row: [_clip(row)]),
        ("removed", "removed or set aside", changes.removed, ["clip"], lambda row: [_clip(row)]),
        (
            "renamed",
            "renamed",
            changes.renamed,
            ["clip", "was called"],
            lambda row: [_clip(row), isolated(row["previous_clip_id"])],
        ),
        ("changed", "changed", changes.changed, ["clip"], lambda row: [_clip(row)]),
        (
            "moved",
            "moved to another cluster",
            changes.moved,
            ["clip", "from cluster", "to cluster"],
            lambda row: [_clip(row), row["previous_cluster_id"], row["cluster_id"]],
        ),
        (
            "relabelled",
            "with another name",
            changes.relabelled,
            ["clip", "was", "is", "by"],
            lambda row: [_clip(row), _name(row["previous_label"]), _name(row["label"]), row["label_source"]],
        ),
        (
            "reference",
            "references replaced",
            changes.references,
            ["cluster", "was", "is"],
            lambda row: [row["cluster_id"], isolated(row["previous_clip_id"]), _clip(row)],
        ),
    ]  # fmt: skip
    then = f"Since snapshot {before.snapshot.snapshot_id} of {before.snapshot.created_at[:10]}"
    if not any(len(found) for _, _, found, _, _ in kinds):
        return section(_TITLE, f"{then}: nothing.", _lineage(catalog, before), name=_NAME)
    query = f"motionary diff CATALOG {before.snapshot.snapshot_id} {catalog.snapshot.snapshot_id}"
    return section(
        _TITLE,
        f"{then}; {query} lists all of it.",
        facts([(title, len(found)) for _, title, found, _, _ in kinds]),
        _lineage(catalog, before),
        *(
            details(f"{len(found):,} {title}", _rows(found, columns, cells))
            for _, title, found, columns, cells in kinds
            if len(found)
        ),
        name=_NAME,
    )


def _without_snapshot(catalog: Catalog) -> str:
    runs = catalog.runs.to_arrow().sort_by("started_at").to_pylist()
    if len(runs) < 2:
        return section(_TITLE, "This is the catalog's first run: all of it is new.", name=_NAME)
    was, now = runs[-2:]
    return section(
        _TITLE,
        "The snapshot before is gone (motionary vacuum removes old ones), and with it which clips changed. "
        "This much is known of the run before:",
        table(
            ["run", "clips", "clusters", "quarantined"],
            [[one["run_id"], one["clips"], one["clusters"], one["quarantined"]] for one in (was, now)],
        ),
        name=_NAME,
    )


def _lineage(catalog: Catalog, before: Catalog) -> str:
    """Say which clusters came, went, split or merged since."""
    told = {
        "new": "cluster {cluster_id} is new",
        "gone": "cluster {previous_id} is gone",
        "split": "cluster {cluster_id} split off {previous_id} with {clips} clips",
        "merged": "cluster {previous_id} went into {cluster_id} with {clips} clips",
    }
    rows = catalog.lineage.to_arrow().to_pylist()
    since = [row for row in rows if row["event"] in told and row["after"] >= before.snapshot.snapshot_id]
    if not since:
        return ""
    lines = [f"<li>{told[row['event']].format(**row)}</li>" for row in since[:MOST_ROWS]]
    more = left_out(len(since) - len(lines), "events", "from lineage")
    return f'<ul class="events">{"".join(lines)}</ul>{more}'


def _rows(found: pa.Table, columns: Sequence[str], cells: Callable[[Row], list[Cell]]) -> str:
    shown = [cells(row) for row in found[:MOST_ROWS].to_pylist()]
    more = len(found) - len(shown)
    return table(columns, shown) + (f'<p class="quiet after">and {more:,} more</p>' if more else "")


def _clip(row: Row) -> Html:
    return isolated(row["clip_id"])


def _name(label: str | None) -> Cell:
    return "no name" if label is None else isolated(label)
