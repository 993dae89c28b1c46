"""The page of one cluster, and the map of all clips."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response

from motionary.catalog.own_pairs import all_pairs_are_there
from motionary.catalog.query import Catalog
from motionary.catalog.views.sections import why_no_chart
from motionary.catalog.web.chart_data import MAP, wanted_cluster
from motionary.catalog.web.pages import clusters_of, page_number
from motionary.catalog.web.render import link, render, shown_to
from motionary.catalog.web.search import clip_rows, page_of

_MANY = 3000
"""Clips whose map takes more than a moment."""

_EVENTS = {
    "kept": "kept its number",
    "moved": "clips moved",
    "split": "split off",
    "merged": "merged",
    "new": "new",
    "gone": "gone",
}


def cluster(request: Request) -> Response:
    """Answer /cluster?id=: its reference, its clips nearest first, its styles, what became of it."""
    shown = shown_to(request)
    cluster_id = wanted_cluster(request, "id")
    facts = next(one for one in clusters_of(shown) if one["cluster_id"] == cluster_id)
    members = shown.keep("answer", ("members", cluster_id), lambda: _members(shown.catalog, cluster_id))
    found = page_of([*members], page_number(request))
    rows = clip_rows(shown.catalog, found.rows)
    return render(
        request,
        "cluster.html",
        cluster=facts,
        found=found,
        rows=[row | {"distance": members[row["clip_id"]]} for row in rows],
        names=shown.keep("answer", ("names", cluster_id), lambda: _names(shown.catalog, cluster_id)),
        lineage=_lineage(shown.catalog, cluster_id),
        page_link=lambda number: link("/cluster", id=cluster_id, page=number),
    )


def cluster_map(request: Request) -> Response:
    """Answer /map; its script asks for the chart, whose places are found once a run."""
    shown = shown_to(request)
    clips = len(shown.catalog.clips)
    waits = clips > _MANY and not shown.ready("places", MAP)
    why_none = "There is no clip to draw." if not clips else None
    if clips and not all_pairs_are_there(shown.catalog):
        why_none = why_no_chart(shown.catalog, "A map")
    return render(request, "map.html", clips=clips, waits=waits, why_none=why_none)


def _members(catalog: Catalog, cluster_id: int) -> dict[str, float]:
    """Return the clips of a cluster with their distances to its reference, nearest first."""
    found = catalog.sql(
        "select clip_id, distance_to_reference as distance from clusters where cluster_id = ? "
        "order by not is_reference, distance, clip_id",
        [cluster_id],
    )
    return dict(zip(found["clip_id"].to_pylist(), found["distance"].to_pylist(), strict=True))


def _names(catalog: Catalog, cluster_id: int) -> list[dict]:
    """Count what its clips are called, and from where, the commonest first."""
    return catalog.sql(
        "select label, label_source, count(*)::int as clips from clusters where cluster_id = ? "
        "group by label, label_source order by clips desc, label, label_source limit 30",
        [cluster_id],
    ).to_pylist()


def _lineage(catalog: Catalog, cluster_id: int) -> list[dict]:
    """List what became of it from run to run, the latest first."""
    rows = catalog.sql(
        "select * from lineage where cluster_id = $id or previous_id = $id "
        "order by after desc, event, cluster_id, previous_id limit 50",
        {"id": cluster_id},
    ).to_pylist()
    return [row | {"told": _EVENTS.get(row["event"], row["event"])} for row in rows]
