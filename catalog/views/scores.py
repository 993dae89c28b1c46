"""Every dendrogram's cut with its scores, as text that the terminal and the page both show.

*r.-p.* is the reward-punish value, *ARI* the adjusted Rand index: once for the cut found, once for as
many clusters as there are labels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Cut = dict[str, Any]


def score_columns(cuts: Sequence[Cut]) -> list[str]:
    """Name the columns of `score_row`; without labels there is nothing to score by."""
    at = f"at {cuts[0]['classes']}"
    scores = ["reward-punish", "ARI", f"r.-p. {at}", f"ARI {at}"] if cuts[0]["classes"] else []
    return ["distance", "linkage", "clusters", *scores, "widest strip"]


def score_row(cut: Cut) -> list[str]:
    """Show a row of `cuts`."""
    scores = []
    if cut["classes"]:
        best = cut["reward_punish_best"]
        for at in ("", "_true"):
            known = cut[f"ari{at}"] is not None
            scores += (
                [f"{cut[f'reward_punish{at}']} / {best}", f"{cut[f'ari{at}']:.3f}"] if known else ["-"] * 2
            )
    name = f"{cut['metric']}{' *' if cut['primary'] else ''}"
    return [name, cut["method"], f"{cut['n_clusters']} ({cut['rule']})", *scores, _strip(cut)]


def score_note(cuts: Sequence[Cut]) -> str:
    """Say what the cuts are, and how the published clusters were cut."""
    published = next(cut for cut in cuts if cut["primary"])
    found = "cuts found with the labels hidden, then scored against them; " if published["classes"] else ""
    how = f"cut by {published['published_rule']} into {published['published_clusters']}"
    return f"{found}* the published dendrogram, {how}"


def _strip(cut: Cut) -> str:
    if cut["strip_clusters"] is None:
        return "-"
    return f"{cut['strip_clusters']}: {cut['strip_low']:.4g} to {cut['strip_high']:.4g}"
