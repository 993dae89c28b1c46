"""The first look: one page that shows a whole catalog, and that opens anywhere without a network."""

from __future__ import annotations

from motionary.catalog.query import Catalog
from motionary.catalog.views.charts import chart_html, plotly_script
from motionary.catalog.views.cluster_table import cluster_members, cluster_table
from motionary.catalog.views.dendrogram import dendrogram_figure
from motionary.catalog.views.mu_kappa import mu_kappa_figure
from motionary.catalog.views.page import details, page
from motionary.catalog.views.sections import (
    catalog_name,
    clusters_section,
    clusters_table,
    dendrogram_section,
    heading,
    members_table,
    no_clusters_section,
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
    name = catalog_name(catalog.store.url)
    charts = [dendrogram_figure(catalog), mu_kappa_figure(catalog)]
    return page(
        f"motionary: {name}",
        [
            heading(catalog),
            _clusters(catalog),
            dendrogram_section(catalog, charts[0], chart_html),
            threshold_section(catalog, charts[1], chart_html),
            scores_section(catalog),
            quarantine_section(catalog),
        ],
        head=plotly_script() if any(charts) else "",
    )


def _clusters(catalog: Catalog) -> str:
    rows, members = cluster_table(catalog).to_pylist(), cluster_members(catalog)
    if not rows:
        return no_clusters_section()
    lists = [
        details(
            f"{one['cluster_id']} {one['label'] or 'unnamed'}: {one['size']} clips",
            members_table(members[one["cluster_id"]]),
        )
        for one in rows
    ]
    return clusters_section(
        clusters_table(rows),
        '<p class="quiet after">The clips of each cluster, nearest to its reference first:</p>',
        *lists,
    )
