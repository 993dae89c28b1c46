"""Sections that the overview and the report share; each says how a chart is put into its page."""

from __future__ import annotations

import posixpath
from collections.abc import Callable, Collection, Sequence
from datetime import UTC, datetime
from html import escape
from typing import TYPE_CHECKING, Any

from motionary.catalog.landmarks import approximation, route_of
from motionary.catalog.own_pairs import all_pairs_are_there
from motionary.catalog.query import Catalog
from motionary.catalog.views.colours import cluster_character, cluster_colour
from motionary.catalog.views.dendrogram import MOST_LEAF_NAMES
from motionary.catalog.views.page import Cell, Html, facts, isolated, section, table
from motionary.catalog.views.scores import score_columns, score_note, score_row
from motionary.pipeline.clustering import OWN_LABEL_SOURCES

if TYPE_CHECKING:
    import plotly.graph_objects as go

Show = Callable[["go.Figure", str], str]
"""Puts a chart into a page: `chart_html`, or what packs it first."""


def catalog_name(url: str) -> str:
    """Return what a catalog is called: the last part of its URL."""
    return posixpath.basename(url.rstrip("/")) or url


def heading(catalog: Catalog) -> str:
    """Write the catalog's name, what made it, and its figures."""
    run = catalog.last_run
    sources = catalog.clusters.to_arrow()["label_source"].to_pylist()
    figures = facts(
        [
            ("clips", run["clips"]),
            ("clusters", run["clusters"]),
            ("with a label of their own", sum(one in OWN_LABEL_SOURCES for one in sources)),
            ("named by their cluster", sources.count("propagated")),
            ("unassigned", sources.count("unassigned")),
            ("quarantined", run["quarantined"]),
        ]
    )
    created = datetime.fromisoformat(catalog.snapshot.created_at).astimezone(UTC)
    made = f"Snapshot {catalog.snapshot.snapshot_id} of {created:%Y-%m-%d %H:%M} UTC"
    name = escape(catalog_name(catalog.store.url))
    library = ", ".join(f"<code>{escape(one)}</code>" for one in run["library"])
    found = approximation(catalog)
    nearly = "" if found is None else f'\n<p class="after">{escape(str(found))} {_MEASURED}</p>'
    return (
        f'<h1><bdi>{name}</bdi></h1>\n<p class="quiet">{made}, by motionary '
        f"{escape(run['version'])}, from {library}</p>\n{figures}{nearly}"
    )


_MEASURED = (
    "How far such clusters are from those of all pairs is measured by "
    "<code>motionary reproduce landmarks</code>, on a library small enough to have both."
)


def clusters_section(*body: str, further: str = "") -> str:
    """Say what clusters are, before what shows them; `further` ends the sentence or two in plain text."""
    return section(
        "Clusters",
        "Clips that move alike. Labelled are those with a label of their own, and purity is the share of "
        f"the commonest of these; the reference is the clip that the others are aligned to.{further}",
        *body,
        name="clusters",
    )


def no_clusters_section() -> str:
    """Say that there is no cluster."""
    return section("Clusters", "No clip could be read, so there is nothing to cluster.", name="clusters")


def clusters_table(clusters: Sequence[dict[str, Any]], linked: Collection[int] = ()) -> str:
    """List clusters, rows of `cluster_table`; the names of those `linked` lead to their cards."""
    rows: list[list[Cell]] = []
    for one in clusters:
        number, name = one["cluster_id"], isolated(one["label"] or "unnamed")
        rows.append(
            [
                cluster_mark(number),
                number,
                Html(f'<a href="#cluster-{number}">{name.text}</a>') if number in linked else name,
                one["size"],
                one["labelled"],
                purity_text(one),
                isolated(one["reference"]),
            ]
        )
    return table(["", "cluster", "name", "clips", "labelled", "purity", "reference"], rows)


def members_table(members: Sequence[dict[str, Any]]) -> str:
    """List clips of a cluster, rows of `cluster_members`."""
    rows: list[list[Cell]] = [
        [
            Html(isolated(one["clip_id"]).text + (" (reference)" if one["is_reference"] else "")),
            isolated(one["label"] or "none"),
            one["label_source"],
            f"{one['confidence']:.2f}",
            one["distance_to_reference"],
        ]
        for one in members
    ]
    return table(["clip", "label", "from", "confidence", "distance to reference"], rows)


def purity_text(cluster: dict[str, Any]) -> str:
    """Write the purity of a cluster, a row of `cluster_table`."""
    return "-" if cluster["purity"] is None else f"{cluster['purity']:.2f}"


def dendrogram_section(catalog: Catalog, figure: go.Figure | None, show: Show) -> str:
    """Show the dendrogram and its cut."""
    if figure is None:
        return section("Dendrogram", why_no_chart(catalog, "A dendrogram"), name="dendrogram")
    hidden = "" if len(catalog.clips) <= MOST_LEAF_NAMES else " Point at a leaf to read its clip."
    return section(
        "Dendrogram",
        "Which clips and clusters merge at which height; what lies left of the dashed line is published."
        + hidden,
        show(figure, "dendrogram-chart"),
        name="dendrogram",
    )


def threshold_section(catalog: Catalog, figure: go.Figure | None, show: Show) -> str:
    """Show how many clusters each threshold leaves."""
    title, name = "Clusters by threshold", "thresholds"
    if figure is None:
        return section(title, why_no_chart(catalog, "The curve"), name=name)
    return section(
        title,
        "How many clusters κ the threshold μ leaves, for each distance. A long level stretch is a number of "
        "clusters that many thresholds agree on; the longest between one cluster and single clips is marked.",
        show(figure, "thresholds-chart"),
        name=name,
    )


def why_no_chart(catalog: Catalog, what: str) -> str:
    """Say why a chart of all clips' distances is missing."""
    if all_pairs_are_there(catalog):
        return f"{what} needs two clips."
    return f"{what} needs all pairs: {SOME_PAIRS[route_of(catalog)]}"


SOME_PAIRS = {
    "pruned": "this run compared those alone whose weighted distance may be at most the threshold. Its "
    "clusters are exactly those of complete linkage; those of other distances and linkages are not known.",
    "landmarks": "this run compared those of its landmarks, and the other clips with clips like them.",
}
"""What a run that did not compare all pairs leaves open."""


def scores_section(catalog: Catalog) -> str:
    """List every dendrogram's cut with its scores; empty without clips."""
    cuts = catalog.cuts.to_arrow().to_pylist()
    if not cuts:
        return ""
    note = score_note(cuts)
    return section(
        "Distances and linkages",
        f"{note[0].upper()}{note[1:]}.",
        table(score_columns(cuts), [score_row(cut) for cut in cuts]),
        name="distances",
    )


def quarantine_section(catalog: Catalog, most: int | None = None) -> str:
    """List the files that could not be read, `most` of them at most."""
    rows = catalog.quarantine.to_arrow().to_pylist()
    if not rows:
        return section("Quarantine", "Every file could be read.", name="quarantine")
    cells: list[list[Cell]] = [
        [isolated(one["path"]), one["line"], one["reason"], one["mend"]] for one in rows[:most]
    ]
    return section(
        "Quarantine",
        "Files that could not be read; the rest of the library is here without them.",
        table(["file", "line", "what is wrong", "how to mend it"], cells),
        left_out(len(rows) - len(cells), "files", "select * from quarantine"),
        name="quarantine",
    )


def left_out(count: int, what: str, query: str) -> str:
    """Say how many rows are not shown, and how they are asked for."""
    if count <= 0:
        return ""
    asked = f'motionary query CATALOG "{query}"'
    return f'<p class="quiet after">{count:,} {what} more: <code>{escape(asked)}</code></p>'


def cluster_mark(cluster_id: int) -> Html:
    """Write a cluster's mark in its colour; it says nothing that is not said in text beside it."""
    colour = cluster_colour(cluster_id)
    return Html(f'<span style="color:{colour}" aria-hidden="true">{cluster_character(cluster_id)}</span>')
