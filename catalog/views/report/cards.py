"""The clusters as cards: how many, how pure, and three takes to look at - reference, tightest, loosest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from statistics import median
from typing import Any

from motionary.catalog.query import Catalog
from motionary.catalog.views.cluster_table import cluster_members, cluster_table
from motionary.catalog.views.page import details, isolated
from motionary.catalog.views.report.footage import Footage
from motionary.catalog.views.sections import (
    cluster_mark,
    clusters_section,
    clusters_table,
    left_out,
    members_table,
    no_clusters_section,
    purity_text,
)
from motionary.pipeline.clustering import OWN_LABEL_SOURCES

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

    def played(self, role: str) -> list[str]:
        """List the clips that a take's picture plays: itself, beside the reference."""
        return list(dict.fromkeys([self.row["reference"], self.takes[role]["clip_id"]]))


def cluster_cards(catalog: Catalog) -> list[ClusterCard]:
    """Gather the clusters, the largest first."""
    clips = catalog.clips.to_arrow().select(["clip_id", "seconds"])
    seconds = dict(zip(clips["clip_id"].to_pylist(), clips["seconds"].to_pylist(), strict=True))
    members = {
        cluster_id: [clip | {"seconds": seconds[clip["clip_id"]]} for clip in inside]
        for cluster_id, inside in cluster_members(catalog).items()
    }
    return [ClusterCard(row, members[row["cluster_id"]]) for row in cluster_table(catalog).to_pylist()]


def takes_by_importance(cards: Sequence[ClusterCard]) -> Iterator[str]:
    """List the clips that are shown on cards: every reference, then what lies far from it, then near."""
    for role in ("reference", "loosest", "other", "tightest"):
        yield from (card.takes[role]["clip_id"] for card in cards[:MOST_CARDS] if role in card.takes)


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
        return no_clusters_section()
    shown, notes = cards[:MOST_CARDS], []
    if len(cards) > len(shown):
        notes.append(f"Only the {len(shown)} largest of the {len(cards):,} clusters are shown below.")
    no_room = footage.no_room(card.played(role) for card in shown for role in card.takes)
    if no_room:
        notes.append(no_room)
    if notes:
        notes.append("motionary browse CATALOG plays every clip.")
    rows = [card.row for card in cards[:_MOST_CLUSTERS]]
    more = left_out(len(cards) - len(rows), "clusters", 'from \\"references\\" order by size desc')
    listed = clusters_table(rows, {card.number for card in shown}) + more
    return clusters_section(
        f'<p class="quiet">{escape(" ".join(notes))}</p>' if notes else "",
        details(f"All {len(cards):,} in a table" if len(cards) > 1 else "In a table", listed),
        *(_card(card, footage) for card in shown),
        further=" Press a picture to play it beside the reference; Aligned shows both in the reference's "
        "time.",
    )


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
    clip_id = clip["clip_id"]
    said = f"Play the {role} clip beside the reference: {clip_id}"
    if role == "reference":
        said = f"Play the reference, {clip_id}"
    known = [f"{clip['seconds']:.1f} s"]
    if role != "reference":
        known.append(f"at {clip['distance_to_reference']:.3f}")
    if clip["label"] != card.row["label"]:
        known.append(f"called <bdi>{escape(clip['label'])}</bdi>" if clip["label"] else "without a name")
    caption = f'<strong>{role}</strong> <span class="quiet">{", ".join(known)}</span>'
    button = footage.button(f"cluster-{card.number}-stage", said, caption, *card.played(role))
    return f'<div class="seen">{button}{isolated(clip_id).text}</div>'


def _summary(card: ClusterCard) -> str:
    """Sum a cluster up in a line."""
    size = len(card.members)
    seconds = median(one["seconds"] for one in card.members)
    told = [f"{size:,} clips, {seconds:.1f} s on median" if size > 1 else f"1 clip of {seconds:.1f} s"]
    own = [one["label"] for one in card.members if one["label_source"] in OWN_LABEL_SOURCES]
    if own:
        told.append(f"{len(own):,} labelled, purity {purity_text(card.row)}")
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
    shown = card.members[:_MOST_MEMBERS]
    query = f"select * from clusters where cluster_id = {card.number} order by distance_to_reference"
    more = left_out(size - len(shown), "clips", query)
    title = f"The {len(shown)} nearest of {size:,} clips" if more else f"All {size:,} clips"
    return details(title, members_table(shown) + more)
