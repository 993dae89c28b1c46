"""What changed since an earlier snapshot: how much of what, and which clips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import pyarrow as pa

from motionary.catalog.errors import CatalogError
from motionary.catalog.history import Difference, diff
from motionary.catalog.query import Catalog
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.views.page import Cell, Html, details, facts, isolated, section, table
from motionary.catalog.views.sections import left_out

MOST_ROWS = 100
_NAME, _TITLE = "changes", "What changed"

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Since:
    """An earlier snapshot, and what changed since.

    Parameters
    ----------
    snapshot : Snapshot
        The earlier one.
    changes : Difference or str
        Or why nothing can be told: what of it cannot be read.
    """

    snapshot: Snapshot
    changes: Difference | str


def changes_since(catalog: Catalog, before: Catalog) -> Since:
    """Tell what changed since a snapshot that somebody chose.

    Raises
    ------
    CatalogError
        A file of either is damaged.
    """
    return Since(before.snapshot, diff(before, catalog))


def changes_since_last(catalog: Catalog) -> Since | None:
    """Tell what changed since the newest snapshot that is older than a catalog's own; None: none is left."""
    earlier = [one for one in catalog.snapshots() if int(one) < int(catalog.snapshot.snapshot_id)]
    for snapshot_id in reversed(earlier):
        with suppress(CatalogError), Catalog.open(catalog.store.url, snapshot_id) as before:
            # What suppress passes over is a manifest that was vacuumed since, or cannot be read.
            try:
                return changes_since(catalog, before)
            except (CatalogError, OSError) as error:  # a part that this snapshot no longer needs
                return Since(before.snapshot, str(error))
    return None


class _Kind(NamedTuple):
    """A kind of change: its attribute of `Difference`, what it is called, and how its rows are shown."""

    name: str
    title: str
    columns: Sequence[str]
    cells: Callable[[Row], list[Cell]]


def changes_section(catalog: Catalog, since: Since | None) -> str:
    """Show what changed, or what the catalog still knows of it where the earlier snapshot is gone."""
    if since is None:
        return _without_snapshot(catalog)
    earlier, changes = since.snapshot.snapshot_id, since.changes
    then = f"snapshot {earlier} of {since.snapshot.created_at[:10]}"
    if isinstance(changes, str):
        said = f"What changed since {then} cannot be told, for it cannot be read: {changes}"
        return section(_TITLE, said, _lineage(catalog, earlier), name=_NAME)
    found = [(kind, getattr(changes, kind.name)) for kind in _KINDS]
    if not any(len(rows) for _, rows in found):
        return section(_TITLE, f"Since {then}: nothing.", _lineage(catalog, earlier), name=_NAME)
    return section(
        _TITLE,
        f"Since {then}; motionary diff CATALOG {earlier} {catalog.snapshot.snapshot_id} lists all of it.",
        facts([(kind.title, len(rows)) for kind, rows in found]),
        _lineage(catalog, earlier),
        *(details(f"{len(rows):,} {kind.title}", _rows(rows, kind)) for kind, rows in found if len(rows)),
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


def _lineage(catalog: Catalog, earlier: str) -> str:
    """Say which clusters came, went, split or merged since a snapshot."""
    told = {
        "new": "cluster {cluster_id} is new",
        "gone": "cluster {previous_id} is gone",
        "split": "cluster {cluster_id} split off {previous_id} with {clips} clips",
        "merged": "cluster {previous_id} went into {cluster_id} with {clips} clips",
    }
    rows = catalog.lineage.to_arrow().to_pylist()
    since = [row for row in rows if row["event"] in told and row["after"] >= earlier]
    if not since:
        return ""
    lines = [f"<li>{told[row['event']].format(**row)}</li>" for row in since[:MOST_ROWS]]
    more = left_out(len(since) - len(lines), "events", "from lineage")
    return f'<ul class="events">{"".join(lines)}</ul>{more}'


def _rows(found: pa.Table, kind: _Kind) -> str:
    shown = [kind.cells(row) for row in found[:MOST_ROWS].to_pylist()]
    more = len(found) - len(shown)
    return table(kind.columns, shown) + (f'<p class="quiet after">and {more:,} more</p>' if more else "")


def _clip(row: Row) -> Html:
    return isolated(row["clip_id"])


def _name(label: str | None) -> Cell:
    return "no name" if label is None else isolated(label)


_KINDS = (
    _Kind("added", "added", ["clip"], lambda row: [_clip(row)]),
    _Kind("removed", "removed or set aside", ["clip"], lambda row: [_clip(row)]),
    _Kind(
        "renamed",
        "renamed",
        ["clip", "was called"],
        lambda row: [_clip(row), isolated(row["previous_clip_id"])],
    ),
    _Kind("changed", "changed", ["clip"], lambda row: [_clip(row)]),
    _Kind(
        "moved",
        "moved to another cluster",
        ["clip", "from cluster", "to cluster"],
        lambda row: [_clip(row), row["previous_cluster_id"], row["cluster_id"]],
    ),
    _Kind(
        "relabelled",
        "with another name",
        ["clip", "was", "is", "by"],
        lambda row: [_clip(row), _name(row["previous_label"]), _name(row["label"]), row["label_source"]],
    ),
    _Kind(
        "references",
        "references replaced",
        ["cluster", "was", "is"],
        lambda row: [row["cluster_id"], isolated(row["previous_clip_id"]), _clip(row)],
    ),
)
