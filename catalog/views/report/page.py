"""The report of a run: one page that shows what changed, plays every cluster, and says what to look at.

It needs nothing from outside itself and stays under 10 MB: Plotly's script and the charts lie in it packed,
takes as slim figures, each unpacked when it is looked at. Of a large catalog it shows the largest clusters
and the first rows of long tables, and says at each place what it leaves out.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

from motionary.catalog.own_pairs import all_pairs_are_there
from motionary.catalog.query import Catalog
from motionary.catalog.review import left_open
from motionary.catalog.views.assets import asset
from motionary.catalog.views.cluster_map import cluster_map_figure
from motionary.catalog.views.dendrogram import dendrogram_figure
from motionary.catalog.views.label_confusion import confusion_figure
from motionary.catalog.views.mu_kappa import mu_kappa_figure
from motionary.catalog.views.page import page, section
from motionary.catalog.views.player import json_in_script
from motionary.catalog.views.report.cards import cards_section, cluster_cards, takes_by_importance
from motionary.catalog.views.report.changes import Since, changes_section
from motionary.catalog.views.report.footage import footage_of
from motionary.catalog.views.report.packed import data_element, packed_chart, packed_plotly
from motionary.catalog.views.report.review import review_queue, review_section, reviewed_clips
from motionary.catalog.views.report.run import settings_section, timings_section
from motionary.catalog.views.sections import (
    catalog_name,
    dendrogram_section,
    heading,
    quarantine_section,
    scores_section,
    threshold_section,
    why_no_chart,
)

if TYPE_CHECKING:
    import plotly.graph_objects as go

_MOST_QUARANTINED = 200

_CONTENTS = {
    "changes": "Changes",
    "clusters": "Clusters",
    "review": "Review",
    "quarantine": "Quarantine",
    "map": "Map",
    "labels": "Labels",
    "dendrogram": "Dendrogram",
    "thresholds": "Thresholds",
    "distances": "Distances",
    "timings": "Timings",
    "settings": "Settings",
}


def report_page(catalog: Catalog, since: Since | None = None) -> str:
    """Show a run on one HTML page.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog; it may hold no clip.
    since : Since, optional
        What changed since an earlier snapshot: of `changes_since_last`, or `changes_since`. Without it the
        page says that there is none left, or that this run was the first.

    Returns
    -------
    str
        HTML with everything it needs inside.
    """
    cards, queue = cluster_cards(catalog), review_queue(catalog)
    footage = footage_of(catalog, chain(takes_by_importance(cards), reviewed_clips(queue)))
    charts = {
        "map": cluster_map_figure(catalog)
        if len(catalog.clips) > 1 and all_pairs_are_there(catalog)
        else None,
        "labels": confusion_figure(catalog),
        "dendrogram": dendrogram_figure(catalog),
        "thresholds": mu_kappa_figure(catalog),
    }
    body = [
        changes_section(catalog, since),
        cards_section(cards, footage),
        review_section(queue, footage, left_open(catalog)),
        quarantine_section(catalog, _MOST_QUARANTINED),
        _map_section(catalog, charts["map"]),
        _labels_section(charts["labels"]),
        dendrogram_section(catalog, charts["dendrogram"], packed_chart),
        threshold_section(catalog, charts["thresholds"], packed_chart),
        scores_section(catalog),
        timings_section(catalog),
        settings_section(catalog),
    ]
    data = [*footage.elements, data_element(json_in_script(dict(footage.figures)), "figures")]
    if any(charts.values()):
        data.append(packed_plotly())
    return page(
        f"{catalog_name(catalog.store.url)}, snapshot {catalog.snapshot.snapshot_id}: motionary report",
        body,
        head=f"<style>\n{asset('report/report.css')}</style>",
        before=[_SKIP, f"<header>\n{heading(catalog)}\n</header>", _contents(body)],
        after=[*data, _script()],
    )


_SKIP = '<a class="skip" href="#main">Skip to the content</a>'


def _script() -> str:
    return f'<script type="module">\n{asset("player.js")}\n{{\n{asset("report/report.js")}}}\n</script>'


def _contents(body: Sequence[str]) -> str:
    there = [name for name in _CONTENTS if any(f'<section id="{name}">' in one for one in body)]
    links = "".join(f'<li><a href="#{name}">{_CONTENTS[name]}</a></li>' for name in there)
    return f'<nav aria-label="Contents"><ul>{links}</ul></nav>'


def _map_section(catalog: Catalog, figure: go.Figure | None) -> str:
    title = "Map"
    if figure is None:
        return section(title, why_no_chart(catalog, "A map"), name="map")
    return section(
        title,
        "Every clip is a point, and clips that move alike lie together. Press one to play it, where the page "
        "holds it: the takes of the cards above.",
        packed_chart(figure, "map-chart"),
        '<p class="quiet" id="map-said" role="status"></p>\n<div class="stage" id="map-stage"></div>',
        name="map",
    )


def _labels_section(figure: go.Figure | None) -> str:
    if figure is None:
        return ""
    return section(
        "Labels against clusters",
        "How many of the clips that have each label of their own lie in which cluster.",
        packed_chart(figure, "labels-chart"),
        name="labels",
    )
