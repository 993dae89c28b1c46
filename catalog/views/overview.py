"""The first look: one page that shows a whole catalog, and that opens anywhere without a network."""

from __future__ import annotations

from motionary.catalog.query import Catalog
from motionary.catalog.views.charts import chart_html, plotly_script
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.views.dendrogram import dendrogram_figure
from motionary.catalog.views.mu_kappa import mu_kappa_figure
from motionary.catalog.views.page import Cell, Html, details, isolated, page, section, table
from motionary.catalog.views.sections import (
    catalog_name,
    cluster_mark,
    dendrogram_section,
    heading,
    quarantine_section,
    scores_section,
    threshold_section,
)


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
    name = catalog_name(catalog)
    charts = [dendrogram_figure(catalog), mu_kappa_figure(catalog)]
    return page(
        f"motionary: {name}",
        [
            heading(catalog),
            _clusters(catalog),
            dendrogram_section(catalog, charts[0], chart_html),
            threshold_section(charts[1], chart_html),
            scores_section(catalog),
            quarantine_section(catalog),
        ],
        head=plotly_script() if any(charts) else "",
    )


def _clusters(catalog: Catalog) -> str:
    rows = cluster_table(catalog).to_pylist()
    if not rows:
        return section("Clusters", "No clip could be read, so there is nothing to cluster.")
    cells: list[list[Cell]] = [
        [
            cluster_mark(one["cluster_id"]),
            one["cluster_id"],
            one["label"] or "unnamed",
            one["size"],
            one["labelled"],
            "-" if one["purity"] is None else f"{one['purity']:.2f}",
            isolated(one["reference"]),
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
            Html(isolated(one["clip_id"]).text + (" (reference)" if one["is_reference"] else "")),
            one["label"] or "none",
            one["label_source"],
            f"{one['confidence']:.2f}",
            one["distance_to_reference"],
        ]
        for one in clips
    ]
    return table(["clip", "label", "from", "confidence", "distance to reference"], rows)
