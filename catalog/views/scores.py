"""Every dendrogram's cut with its scores, as text that the terminal and the page both show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Cut = dict[str, Any]


def score_columns(cuts: Sequence[Cut]) -> list[str]:
    """Name the columns of `score_row`; the scores at the labels' own number of classes say that number."""
    classes = cuts[0]["classes"]
    at = f"at {classes}" if classes else "at true"
    names = ["distance", "linkage", "clusters", "reward-punish", "ARI"]
    return [*names, f"r.-p. {at}", f"ARI {at}", "widest strip"]


def score_row(cut: Cut) -> list[str]:
    """Show a row of `cuts`; a dash stands where there are no labels to score it by."""
    best = cut["reward_punish_best"]
    return [
        f"{cut['metric']}{' *' if cut['primary'] else ''}",
        cut["method"],
        f"{cut['n_clusters']} ({cut['rule']})",
        _ratio(cut["reward_punish"], best),
        _number(cut["ari"]),
        _ratio(cut["reward_punish_true"], best),
        _number(cut["ari_true"]),
        _strip(cut),
    ]


def score_note(cuts: Sequence[Cut]) -> str:
    """Say what the cuts are, and how the published clusters were cut."""
    published = next(cut for cut in cuts if cut["primary"])
    return (
        "cuts found with the labels hidden, then scored against them; * the published dendrogram, "
        f"cut by {published['published_rule']} into {published['published_clusters']}"
    )


def _ratio(value: int | None, best: int | None) -> str:
    return "-" if value is None or not best else f"{value} / {best}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _strip(cut: Cut) -> str:
    if cut["strip_clusters"] is None:
        return "-"
    return f"{cut['strip_clusters']}: {cut['strip_low']:.4g} to {cut['strip_high']:.4g}"
