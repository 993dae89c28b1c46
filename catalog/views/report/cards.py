"""The clusters as cards: how many, how pure, and three takes to look at - reference, tightest, loosest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from statistics import median
from typing import Any

from motionary.catalog.query import Catalog
from motionary.catalog.views.cluster_table import cluster_table
from motionary.catalog.views.page import Cell, Html, details, isolated, section, table
from motionary.catalog.views.report.footage import Footage
from motionary.catalog.views.sections import cluster_mark, left_out

MOST_CARDS = 60
_MOST_CLUSTERS = 500
_MOST_MEMBERS = 40


@dataclass(frozen=True)
class ClusterCard:
    """A cluster to be shown.

    Parameters
    ----------
    row : dict
        Of `cluster_table`.
    members : sequence of dict
        Rows of `clusters` with their `seconds`, nearest to the reference first, and it before all.
    """

    row: dict[str, Any]
    members: Sequence[dict[str, Any]]

    @property
    def number(self) -> int:
        """The cluster's number."""
        return self.row["cluster_id"]

    @property
    def takes(self) -> dict[str, dict[str, Any]]:
        """The members to look at, by what they are."""
        reference, *others = self.members
        if not others:
            return {"reference": reference}
        if len(others) == 1:
            return {"reference": reference, "other": others[0]}
        return {"reference": reference, "tightest": others[0], "loosest": others[-1]}


def cluster_cards(catalog: Catalog) -> list[ClusterCard]:
    """Gather the clusters, the largest first."""
    clips = catalog.clips.to_arrow().select(["clip_id", "seconds"])
    seconds = dict(zip(clips["clip_id"].to_pylist(), clips["seconds"].to_pylist(), strict=True))
    members: dict[int, list[dict]] = {}
    order = [("is_reference", "descending"), ("distance_to_reference", "ascending"), ("clip_id", "ascending")]
    for clip in catalog.clusters.to_arrow().sort_by(order).to_pylist():
        found = members.setdefault(clip["cluster_id"], [])
        found.append(clip | {"seconds": seconds[clip["clip_id"]]})
    return [ClusterCard(row, members[row["cluster_id"]]) for row in cluster_table(catalog).to_pylist()]


def takes_by_importance(cards: Sequence[ClusterCard]) -> Iterator[str]:
    """List the clips that the cards show: every reference, then what lies far from it, then near."""
    for role in ("reference", "loosest", "other", "tightest"):
        yield from (card.takes[role]["clip_id"] for card in cards if role in card.takes)


def cards_section(cards: Sequence[ClusterCard], footage: Footage) -> str:
    """Show the clusters: a table of all, and the largest as cards.

    Parameters
    ----------
    cards : sequence of ClusterCard
        All clusters, the largest first.
    footage : Footage
        Of the takes of the first `MOST_CARDS`.
    """
    if not cards:
        return section("Clusters", "No clip could be read, so there is nothing to cluster.", name="clusters")
    notes = []
    if len(cards) > MOST_CARDS:
        notes.append(f"Only the {MOST_CARDS} largest of the {len(cards):,} clusters are shown below.")
    if footage.without_figure:
        notes.append(
            f"{footage.without_figure} takes are too long for this page to hold: they are pictures only."
        )
    if notes:
        notes.append("motionary browse CATALOG plays every clip.")
    return section(
        "Clusters",
        "Clips that move alike. Labelled are those with a label of their own, and purity is the share of "
        "the commonest of these; the reference is the clip that the others are aligned to. Press a picture "
        "to play it beside the reference; Aligned shows both in the reference's time.",
        f'<p class="quiet">{escape(" ".join(notes))}</p>' if notes else "",
        details(f"All {len(cards):,} in a table" if len(cards) > 1 else "In a table", _all_clusters(cards)),
        *(_card(card, footage) for card in cards[:MOST_CARDS]),
        name="clusters",
    )


def _all_clusters(cards: Sequence[ClusterCard]) -> str:
    rows: list[list[Cell]] = [
        [
            cluster_mark(card.number),
            card.number,
            _link(card) if place < MOST_CARDS else isolated(card.row["label"] or "unnamed"),
            card.row["size"],
            card.row["labelled"],
            _purity(card),
            isolated(card.row["reference"]),
        ]
        for place, card in enumerate(cards[:_MOST_CLUSTERS])
    ]
    columns = ["", "cluster", "name", "clips", "labelled", "purity", "reference"]
    more = left_out(len(cards) - len(rows), "clusters", 'from \\"references\\" order by size desc')
    return table(columns, rows) + more


def _card(card: ClusterCard, footage: Footage) -> str:
    at = f"cluster-{card.number}"
    name = isolated(card.row["label"] or "unnamed").text
    takes = "".join(_take(card, role, clip, footage) for role, clip in card.takes.items())
    return (
        f'<article class="card" id="{at}" aria-labelledby="{at}-name">\n'
        f'<h3 id="{at}-name">{cluster_mark(card.number).text} {card.number} {name}</h3>\n'
        f'<p class="quiet">{_summary(card)}</p>\n<div class="takes">{takes}</div>\n'
        f'<div class="stage" id="{at}-stage"></div>\n{_members(card)}\n</article>'
    )


def _take(card: ClusterCard, role: str, clip: dict, footage: Footage) -> str:
    reference, clip_id = card.row["reference"], clip["clip_id"]
    if role == "reference":
        said, played = f"Play the reference, {clip_id}", [clip_id]
    else:
        said, played = f"Play the {role} clip beside the reference: {clip_id}", [reference, clip_id]
    known = [f"{clip['seconds']:.1f} s"]
    if role != "reference":
        known.append(f"at {clip['distance_to_reference']:.3f}")
    if clip["label"] != card.row["label"]:
        known.append(f"called <bdi>{escape(clip['label'])}</bdi>" if clip["label"] else "without a name")
    caption = f'<strong>{role}</strong> <span class="quiet">{", ".join(known)}</span>'
    button = footage.button(f"cluster-{card.number}-stage", said, caption, *played)
    return f'<div class="seen">{button}{isolated(clip_id).text}</div>'


def _summary(card: ClusterCard) -> str:
    """Sum a cluster up in a line."""
    size = len(card.members)
    seconds = median(one["seconds"] for one in card.members)
    told = [f"{size:,} clips, {seconds:.1f} s on median" if size > 1 else f"1 clip of {seconds:.1f} s"]
    own = [one["label"] for one in card.members if one["label_source"] in ("override", "supplied")]
    if own:
        told.append(f"{len(own):,} labelled, purity {_purity(card)}")
    if len(set(own)) > 1:
        counted = Counter(own).most_common(6)
        told.append(", ".join(f"<bdi>{escape(label)}</bdi> {count:,}" for label, count in counted))
    if size > 1:
        far = [one["distance_to_reference"] for one in card.members[1:]]
        told.append(f"{min(far):.3f} to {max(far):.3f} from the reference")
    return " · ".join(told)


def _members(card: ClusterCard) -> str:
    """List a cluster's clips; nothing where the card shows its only one."""
    size = len(card.members)
    if size == 1:
        return ""
    rows: list[list[Cell]] = [
        [
            Html(isolated(one["clip_id"]).text + (" (reference)" if one["is_reference"] else "")),
            isolated(one["label"] or "none"),
            one["label_source"],
            f"{one['confidence']:.2f}",
            one["distance_to_reference"],
        ]
        for one in card.members[:_MOST_MEMBERS]
    ]
    query = f"select * from clusters where cluster_id = {card.number} order by distance_to_reference"
    more = left_out(size - len(rows), "clips", query)
    title = f"The {len(rows)} nearest of {size:,} clips" if more else f"All {size:,} clips"
    return details(
        title, table(["clip", "label", "from", "confidence", "distance to reference"], rows) + more
    )


def _link(card: ClusterCard) -> Html:
    return Html(f'<a href="#cluster-{card.number}">{isolated(card.row["label"] or "unnamed").text}</a>')


def _purity(card: ClusterCard) -> str:
    return "-" if card.row["purity"] is None else f"{card.row['purity']:.2f}"
