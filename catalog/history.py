"""The runs of a catalog, and what changed between two: clips, their clusters and names, the references.

A clip is known by its clip_id, or, where its file was renamed, by its bytes.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from motionary.catalog.landmarks import route_in
from motionary.catalog.query import Catalog

_TEXT, _ID = pa.string(), pa.int32()
_SCHEMAS = {
    "added": pa.schema({"clip_id": _TEXT, "digest": _TEXT}),
    "removed": pa.schema({"clip_id": _TEXT, "digest": _TEXT}),
    "renamed": pa.schema({"clip_id": _TEXT, "previous_clip_id": _TEXT, "digest": _TEXT}),
    "changed": pa.schema({"clip_id": _TEXT, "previous_digest": _TEXT, "digest": _TEXT}),
    "moved": pa.schema({"clip_id": _TEXT, "previous_cluster_id": _ID, "cluster_id": _ID}),
    "relabelled": pa.schema(
        {"clip_id": _TEXT, "previous_label": _TEXT, "label": _TEXT, "label_source": _TEXT}
    ),
    "references": pa.schema({"cluster_id": _ID, "previous_clip_id": _TEXT, "clip_id": _TEXT}),
}

_CHANGES = pa.schema({"change": _TEXT, "clip_id": _TEXT, "cluster_id": _ID, "before": _TEXT, "after": _TEXT})
_LINES = [
    ("added", "added", "", ""),
    ("removed", "removed", "", ""),
    ("renamed", "renamed", "previous_clip_id", "clip_id"),
    ("changed", "changed", "previous_digest", "digest"),
    ("moved", "moved", "previous_cluster_id", "cluster_id"),
    ("relabelled", "relabelled", "previous_label", "label"),
    ("reference", "references", "previous_clip_id", "clip_id"),
]
"""What a change is called, and where it and its two states are found."""


@dataclass(frozen=True)
class Difference:
    """What a later snapshot has otherwise than an earlier one; a row each.

    Parameters
    ----------
    added, removed : pyarrow.Table
        clip_id, digest: clips that came and went.
    renamed : pyarrow.Table
        clip_id, previous_clip_id, digest: the same bytes under another name.
    changed : pyarrow.Table
        clip_id, previous_digest, digest: other bytes under the same name.
    moved : pyarrow.Table
        clip_id, previous_cluster_id, cluster_id: clips of both that lie in another cluster.
    relabelled : pyarrow.Table
        clip_id, previous_label, label, label_source: clips of both with another name.
    references : pyarrow.Table
        cluster_id, previous_clip_id, clip_id: clusters of both with another reference.
    """

    added: pa.Table
    removed: pa.Table
    renamed: pa.Table
    changed: pa.Table
    moved: pa.Table
    relabelled: pa.Table
    references: pa.Table

    def to_table(self) -> pa.Table:
        """Put all changes into one table: change, clip_id, cluster_id, before, after, the last two as text.

        A moved clip has the numbers of its clusters there, a relabelled one its names, a renamed one its
        clip_ids, a changed one its digests; a replaced reference is the clip that came.
        """
        rows: list[dict] = []
        for change, name, before, after in _LINES:
            for row in getattr(self, name).to_pylist():
                texts = [None if row.get(one) is None else str(row[one]) for one in (before, after)]
                rows.append({**row, "change": change, "before": texts[0], "after": texts[1]})
        return pa.Table.from_pylist(rows, schema=_CHANGES)


def diff(before: Catalog, after: Catalog) -> Difference:
    """Tell what changed from one snapshot to another.

    Parameters
    ----------
    before, after : Catalog
        Of one catalog, or of two over the same library.

    Returns
    -------
    Difference
        Rows by clip_id, references by cluster_id. A clip that was set aside in one of them was removed, or
        added.
    """
    old, new = _digests(before), _digests(after)
    came = {clip: digest for clip, digest in new.items() if clip not in old}
    went = {clip: digest for clip, digest in old.items() if clip not in new}
    earlier = _renamed(went, came)
    before_of = {clip: clip for clip in new if clip in old} | earlier  # clips of both, by their name now
    was, now = _memberships(before), _memberships(after)
    pairs = [(clip, was[before_of[clip]], now[clip]) for clip in before_of]
    same = set(earlier.values())
    rows: dict[str, list[tuple]] = {
        "added": [(clip, digest) for clip, digest in came.items() if clip not in earlier],
        "removed": [(clip, digest) for clip, digest in went.items() if clip not in same],
        "renamed": [(clip, previous, new[clip]) for clip, previous in earlier.items()],
        "changed": [(clip, old[clip], new[clip]) for clip in new if old.get(clip, new[clip]) != new[clip]],
        "moved": [
            (clip, a["cluster_id"], b["cluster_id"])
            for clip, a, b in pairs
            if a["cluster_id"] != b["cluster_id"]
        ],
        "relabelled": [
            (clip, a["label"], b["label"], b["label_source"])
            for clip, a, b in pairs
            if a["label"] != b["label"]
        ],
        "references": _replaced(_references(before), _references(after), before_of),
    }
    return Difference(**{name: _table(_SCHEMAS[name], sorted(rows[name])) for name in _SCHEMAS})


_LEFT_OUT = ("settings", "stage_seconds", "side")


def run_history(catalog: Catalog) -> pa.Table:
    """List the runs that led to a catalog, oldest first, each with its snapshot and whether that is kept.

    Returns
    -------
    pyarrow.Table
        run_id, snapshot, kept, and the columns of `runs` but for settings, seconds by stage and tiles; and
        pairs, which of them were compared: all, pruned, landmarks.
    """
    runs = catalog.runs.to_arrow().sort_by("started_at")
    table = runs.select([name for name in runs.column_names if name not in _LEFT_OUT])
    for name in ("started_at", "finished_at"):
        seconds = table[name].cast(pa.timestamp("s", tz="UTC"), safe=False)
        table = table.set_column(table.column_names.index(name), name, seconds)
    # A run's id ends with its snapshot's.
    snapshots = [run_id.rpartition("-")[2] for run_id in table["run_id"].to_pylist()]
    there = set(catalog.snapshots())
    kept = [snapshot in there for snapshot in snapshots]
    routes = [route_in(json.loads(settings)) for settings in runs["settings"].to_pylist()]
    table = table.append_column("pairs", pa.array(routes, _TEXT))
    return table.add_column(1, "snapshot", [snapshots]).add_column(2, "kept", [kept])


def _renamed(went: Mapping[str, str], came: Mapping[str, str]) -> dict[str, str]:
    """Pair clips that came with clips of the same bytes that went, in the order of their names."""
    by_digest: dict[str, list[str]] = defaultdict(list)
    for clip in sorted(went, reverse=True):
        by_digest[went[clip]].append(clip)
    return {clip: by_digest[came[clip]].pop() for clip in sorted(came) if by_digest.get(came[clip])}


def _replaced(
    old: Mapping[int, str], new: Mapping[int, str], before_of: Mapping[str, str]
) -> list[tuple[int, str, str]]:
    return [
        (cluster, old[cluster], clip)
        for cluster, clip in sorted(new.items())
        if cluster in old and before_of.get(clip) != old[cluster]
    ]


def _digests(catalog: Catalog) -> dict[str, str]:
    clips = catalog.clips.to_arrow()
    return dict(zip(clips["clip_id"].to_pylist(), clips["digest"].to_pylist(), strict=True))


def _memberships(catalog: Catalog) -> dict[str, dict[str, Any]]:
    rows = catalog.clusters.to_arrow().select(["clip_id", "cluster_id", "label", "label_source"])
    return {row["clip_id"]: row for row in rows.to_pylist()}


def _references(catalog: Catalog) -> dict[int, str]:
    rows = catalog.references.to_arrow()
    return dict(zip(rows["cluster_id"].to_pylist(), rows["clip_id"].to_pylist(), strict=True))


def _table(schema: pa.Schema, rows: list[tuple]) -> pa.Table:
    """Make a table of rows, typed even where there are none."""
    return pa.Table.from_pylist([dict(zip(schema.names, row, strict=True)) for row in rows], schema=schema)
