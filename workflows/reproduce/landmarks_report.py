"""How far clusters by landmarks are from the exact ones, in a terminal."""

from __future__ import annotations

from rich.console import Group, RenderableType
from rich.text import Text

from motionary.pipeline.clustering.landmark_steps import REPRESENTATIVES
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.landmarks import ALONE, LandmarkStudy
from motionary.workflows.tables import text_table

_HEADER = ["landmarks", "route", "pairs", "clusters", "ARI", "worst", "disagree", "ARI, labels"]


def landmarks_report(conducted: Conducted[LandmarkStudy]) -> RenderableType:
    """Lay a study out for reading: a table a cut, and what it says."""
    rows = conducted.study.rows.to_pylist()
    parts: list[RenderableType] = []
    for cut in dict.fromkeys(row["cut"] for row in rows):
        some = [row for row in rows if row["cut"] == cut]
        exact = next(row for row in some if row["route"] == _final())
        title = f"Against the exact clusters, {cut}: {exact['clusters_exact']}"
        if exact["ari_classes_exact"] is not None:
            title += f" (ARI with the labels {exact['ari_classes_exact']:.3f})"
        parts += [
            text_table(_HEADER, [_cells(row) for row in some], title),
            Text(_verdict(cut, some)),
            Text(),
        ]
    return Group(*parts, *(Text(note) for note in conducted.notes))


def _cells(row: dict) -> list[str]:
    return [
        str(row["landmarks"]),
        row["route"],
        f"{row['pairs']:.1%}",
        f"{row['clusters']:.1f}",
        f"{row['ari']:.3f}",
        f"{row['ari_least']:.3f}",
        f"{row['disagreement']:.2%}",
        "" if row["ari_classes"] is None else f"{row['ari_classes']:.3f}",
    ]


def _verdict(cut: str, rows: list[dict]) -> str:
    """Say what the route comes to with the fewest and the most landmarks, and what each step is worth."""
    by_route: dict[str, list[dict]] = {}
    for row in rows:
        by_route.setdefault(row["route"], []).append(row)
    final = by_route[_final()]
    means = {name: sum(row["ari"] for row in some) / len(some) for name, some in by_route.items()}
    one, several = "1 representative", f"{REPRESENTATIVES} representatives"
    most = by_route[ALONE][-1]
    ends = "; ".join(
        f"{row['landmarks']} landmarks ({row['pairs']:.0%} of the pairs) ARI {row['ari']:.3f}, "
        f"{row['disagreement']:.1%} of pairs parted otherwise"
        for row in (final[0], final[-1])
    )
    return (
        f"{cut.capitalize()}: {ends}.\n"
        f"All pairs of {most['landmarks']} clips alone: ARI {most['ari']:.3f} with what those of all clips "
        f"give, {most['disagreement']:.1%} of pairs parted otherwise.\n"
        f"Mean ARI over all numbers of landmarks: {means[one]:.3f} with one representative a cluster, "
        f"{means[several]:.3f} with up to {REPRESENTATIVES}, {means[_final()]:.3f} refined: "
        f"more representatives are worth {means[several] - means[one]:+.3f}, "
        f"refining {means[_final()] - means[several]:+.3f}."
    )


def _final() -> str:
    return f"{REPRESENTATIVES}, refined"
