"""The first look: one page that shows a whole catalog, and that opens anywhere without a network."""

from __future__ import annotations

import posixpath
from html import escape
from typing import TYPE_CHECKING

from motionary.catalog.query import Catalog
from motionary.catalog.views.charts import chart_html, plotly_script
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.views.colours import cluster_character, cluster_colour
from motionary.catalog.views.dendrogram import MOST_LEAF_NAMES, dendrogram_figure
from motionary.catalog.views.mu_kappa import mu_kappa_figure
from motionary.catalog.views.page import Cell, Html, details, facts, page, section, table
from motionary.catalog.views.scores import score_columns, score_note, score_row

if TYPE_CHECKING:
    import plotly.graph_objects as go


def overview_page(catalog: Catalog) -> str:
    """Show a catalog's clusters, dendrogram, mu-kappa curves, scores and quarantine on one HTML page.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog; it may hold no clip.

    Returns
    -------
    str
        HTML with everything it needs inside, Plotly's script included where there is a chart.
    """
    name = posixpath.basename(catalog.store.url.rstrip("/"))
    charts = [dendrogram_figure(catalog), mu_kappa_figure(catalog)]
    return page(
        f"motionary: {name}",
        [
            _top(catalog, name),
            _clusters(catalog),
            _dendrogram(catalog, charts[0]),
            _mu_kappa(charts[1]),
            _scores(catalog),
            _quarantine(catalog),
        ],
        head=plotly_script() if any(charts) else "",
    )


def _top(catalog: Catalog, name: str) -> str:
    run = catalog.last_run
    sources = catalog.clusters.to_arrow()["label_source"].to_pylist()
    figures = facts(
        [
            ("clips", run["clips"]),
            ("clusters", run["clusters"]),
            ("with a label of their own", sum(one in ("supplied", "override") for one in sources)),
            ("named by their cluster", sources.count("propagated")),
            ("unassigned", sources.count("unassigned")),
            ("quarantined", run["quarantined"]),
        ]
    )
    made = f"Snapshot {catalog.snapshot.snapshot_id} of {run['finished_at']:%Y-%m-%d %H:%M} UTC"
    library = ", ".join(f"<code>{escape(one)}</code>" for one in run["library"])
    return (
        f'<h1>{escape(name)}</h1>\n<p class="quiet">{made}, by motionary {escape(run["version"])}, '
        f"from {library}</p>\n{figures}"
    )


def _clusters(catalog: Catalog) -> str:
    rows = cluster_table(catalog).to_pylist()
    if not rows:
        return section("Clusters", "No clip could be read, so there is nothing to cluster.")
    cells: list[list[Cell]] = [
        [
            _mark(one["cluster_id"]),
            one["cluster_id"],
            one["label"] or "unnamed",
            one["size"],
            one["labelled"],
            "-" if one["purity"] is None else f"{one['purity']:.2f}",
            one["reference"],
        ]
        for one in rows
    ]
    members: dict[int, list[dict]] = {}
    for clip in catalog.clusters.to_arrow().sort_by("distance_to_reference").to_pylist():
        members.setdefault(clip["cluster_id"], []).append(clip)
    lists = [
        details(
            f"{one['cluster_id']} {one['label'] or 'unnamed'}: {one['size']} clips",
            _members(members[one["cluster_id"]]),
        )
        for one in rows
    ]
    return section(
        "Clusters",
        "Clips that move alike. Labelled are those with a label of their own, and purity is the share of "
        "the commonest of these; the reference is the clip that the others are aligned to.",
        table(["", "cluster", "name", "clips", "labelled", "purity", "reference"], cells),
        '<p class="quiet after">The clips of each cluster, nearest to its reference first:</p>',
        *lists,
    )


def _members(clips: list[dict]) -> str:
    rows: list[list[Cell]] = [
        [
            one["clip_id"] + (" (reference)" if one["is_reference"] else ""),
            one["label"] or "none",
            one["label_source"],
            f"{one['confidence']:.2f}",
            one["distance_to_reference"],
        ]
        for one in clips
    ]
    return table(["clip", "label", "from", "confidence", "distance to reference"], rows)


def _dendrogram(catalog: Catalog, figure: go.Figure | None) -> str:
    if figure is None:
        return section("Dendrogram", "A dendrogram needs two clips.")
    hidden = "" if len(catalog.clips) <= MOST_LEAF_NAMES else " Point at a leaf to read its clip."
    return section(
        "Dendrogram",
        "Which clips and clusters merge at which height; what lies left of the dashed line is published."
        + hidden,
        chart_html(figure, "dendrogram"),
    )


def _mu_kappa(figure: go.Figure | None) -> str:
    if figure is None:
        return section("Clusters by threshold", "The curve needs two clips.")
    return section(
        "Clusters by threshold",
        "How many clusters κ the threshold μ leaves, for each distance. A long level stretch is a number of "
        "clusters that many thresholds agree on; the longest between one cluster and single clips is marked.",
        chart_html(figure, "mu-kappa"),
    )


def _scores(catalog: Catalog) -> str:
    cuts = catalog.cuts.to_arrow().to_pylist()
    if not cuts:
        return ""
    note = score_note(cuts)
    return section(
        "Distances and linkages",
        f"{note[0].upper()}{note[1:]}.",
        table(score_columns(cuts), [score_row(cut) for cut in cuts]),
    )


def _quarantine(catalog: Catalog) -> str:
    rows = catalog.quarantine.to_arrow().to_pylist()
    if not rows:
        return section("Quarantine", "Every file could be read.")
    return section(
        "Quarantine",
        "Files that could not be read; the rest of the library is here without them.",
        table(
            ["file", "line", "what is wrong", "how to mend it"],
            [[one["path"], one["line"], one["reason"], one["mend"]] for one in rows],
        ),
    )


def _mark(cluster_id: int) -> Html:
    colour = cluster_colour(cluster_id)
    return Html(f'<span style="color:{colour}" aria-hidden="true">{cluster_character(cluster_id)}</span>')
