"""How far clusters by landmarks are from those of all pairs, on a catalog small enough to have both.

The landmarks are drawn anew for every draw, from the clips' contents and the seed; the distances are the
catalog's, and what the route asks for is counted. Held against each other, by the run's linkage:

    as published   the catalog's clusters; the landmarks' labels, where they have enough, choose the cut
    automatic      its partition with the labels hidden; the landmarks are cut by modularity

and of every number of landmarks

    landmarks alone      their own clusters, against the exact ones of the same clips: what a sample costs
    1 representative     every other clip assigned to the nearest of them, one a cluster
    4 representatives    or four
    1, 4, refined        what that becomes when clusters are parted at the threshold of all clips

What all pairs of nine tenths of the clips give is the yardstick: so far are exact clusters from themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog import Catalog
from motionary.pipeline.clustering.landmark_steps import (
    REPRESENTATIVES,
    cut_landmarks,
    landmark_count,
    sample_clips,
)
from motionary.pipeline.clustering.landmarks import cluster_by_landmarks
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.evaluation import adjusted_rand_index
from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.combinations import pairs_among
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.landmarks_exact import (
    AUTOMATIC,
    CountedDistances,
    ExactClusters,
    read_exact_clusters,
)

SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Of the clips, that are landmarks."""

YARDSTICK = 9 / 10
"""Of the clips, that are clustered exactly to see how much hangs on the others."""

ALONE = "landmarks alone"

_ROWS = pa.schema(
    [
        table_field("cut", pa.string(), "as published or automatic, the labels hidden"),
        table_field("landmarks", pa.int32(), "clips whose pairs are all compared"),
        table_field("route", pa.string(), "how the other clips got their clusters"),
        table_field("draws", pa.int32(), "sets of landmarks; the figures are means over them"),
        table_field("pairs", pa.float64(), "share of all pairs that were compared"),
        table_field("clusters_exact", pa.int32(), "clusters by all pairs"),
        table_field("clusters", pa.float64(), "clusters by landmarks"),
        table_field("ari", pa.float64(), "adjusted Rand index of the two"),
        table_field("ari_least", pa.float64(), "the same, of the worst draw"),
        table_field("disagreement", pa.float64(), "share of pairs that are together in one of the two alone"),
        table_field(
            "ari_classes_exact", pa.float64(), "ARI of the exact clusters and the labels", nullable=True
        ),
        table_field(
            "ari_classes", pa.float64(), "ARI of the clusters by landmarks and the labels", nullable=True
        ),
    ]
)


@dataclass(frozen=True, eq=False)
class LandmarkStudy:
    """How far every way by landmarks is from the exact clusters."""

    rows: pa.Table

    def to_arrow(self) -> pa.Table:
        """Return a row for every cut, number of landmarks and route."""
        return self.rows


def study_landmarks(
    catalog: Catalog, label_column: str, draws: int, seed: int, show: Show
) -> Conducted[LandmarkStudy]:
    """Cluster a catalog's clips by landmarks, and hold that against the clusters of all pairs.

    Parameters
    ----------
    catalog : Catalog
        Its distances are read, and none computed.
    label_column : str
        The column that clusters are scored by; of a catalog without it they are not.
    draws : int
        Sets of landmarks of every size.
    seed : int
        Of the draws. The same seed gives the same result.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    UserError
        The catalog has fewer than 32 clips.
    CatalogError
        Its run did not compare all pairs.
    """
    exact = read_exact_clusters(catalog, label_column)
    most = round(len(exact.digests) * YARDSTICK)
    sizes = [*landmark_numbers(len(exact.digests)), most]
    rows: list[dict] = []
    with show({"cluster": len(exact.clusters) * len(sizes) * draws}) as advance:
        for cut in exact.clusters:
            for size in sizes:
                made: dict[str, list[dict]] = {}
                for draw in range(draws):
                    routes = _alone if size == most else _routes
                    for route, figures in routes(exact, cut, size, f"{seed} {draw}"):
                        made.setdefault(route, []).append(figures)
                    advance("cluster")
                rows += [_row(cut, size, route, figures) for route, figures in made.items()]
    clips, linkage = len(exact.digests), exact.config.primary
    notes = [
        f"{clips} clips, {clips * (clips - 1) // 2} pairs; {linkage} linkage; seed {seed}. Usual are "
        f"{landmark_count(clips)} landmarks of so many clips."
    ]
    return Conducted(LandmarkStudy(pa.Table.from_pylist(rows, schema=_ROWS)), notes)


def landmark_numbers(clips: int) -> list[int]:
    """List how many landmarks are tried: shares of the clips, and what a run takes if that is a part."""
    tried = {round(clips * share) for share in SHARES}
    return sorted(tried | {one for one in [landmark_count(clips)] if one < max(tried)})


def _routes(exact: ExactClusters, cut: str, size: int, draw: str) -> Iterator[tuple[str, dict]]:
    """Cluster by one set of landmarks, every way there is, and score each."""
    yield from _alone(exact, cut, size, draw)
    keys, (config, labels) = _keys(exact, draw), _settings(exact, cut)
    every, clips = np.arange(len(keys)), len(keys)
    for count in (1, REPRESENTATIVES):
        distances = CountedDistances(exact.channels, clips)
        made = cluster_by_landmarks(keys, distances, config, labels, size, count)
        assigned = size * (size - 1) / 2 + (clips - size) * len(made.representatives)
        name = f"{count} representative{'s' if count > 1 else ''}"
        yield name, _figures(exact, cut, made.assigned, every, assigned)
        compared = distances.share * exact.channels.shape[1]
        yield f"{count}, refined", _figures(exact, cut, made.labels, every, compared)


def _alone(exact: ExactClusters, cut: str, size: int, draw: str) -> Iterator[tuple[str, dict]]:
    """Cluster one set of landmarks, and score them without the other clips."""
    keys, (config, labels) = _keys(exact, draw), _settings(exact, cut)
    sample = sample_clips(keys, size)
    own = None if labels is None else [labels[place] for place in sample]
    pairs = exact.channels[:, pairs_among(sample, len(keys))]
    found = cut_landmarks(pairs, config, size / len(keys), own).labels
    yield ALONE, _figures(exact, cut, found, sample, pairs.shape[1])


def _keys(exact: ExactClusters, draw: str) -> list[str]:
    return [f"{digest} {draw}" for digest in exact.digests]


def _settings(exact: ExactClusters, cut: str) -> tuple[ClusterConfig, list[str | None] | None]:
    if cut == AUTOMATIC:
        return replace(exact.config, threshold=None, n_clusters=None), None
    return exact.config, exact.labels if any(exact.labels) else None


def _figures(
    exact: ExactClusters, cut: str, found: NDArray[np.int64], places: NDArray[np.intp], compared: float
) -> dict:
    """Hold the clusters of some clips against the exact ones of the same clips."""
    true = exact.clusters[cut][places]
    figures = {
        "pairs": compared / exact.channels.shape[1],
        "clusters_exact": len(set(true.tolist())),
        "clusters": len(set(found.tolist())),
        "ari": adjusted_rand_index(found, true),
        "disagreement": disagreement(found, true),
    }
    classes = None if exact.classes is None else [exact.classes[place] for place in places]
    if classes is not None and any(classes):
        figures["ari_classes_exact"] = adjusted_rand_index(true, classes)
        figures["ari_classes"] = adjusted_rand_index(found, classes)
    return figures


def disagreement(one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """Return the share of pairs that are together in one of two partitions alone: 1 less the Rand index."""
    _, sizes = np.unique(np.stack([one, other]), axis=1, return_counts=True)
    together = [np.unique(partition, return_counts=True)[1] for partition in (one, other)]
    first, second, both = ((sizes * (sizes - 1) / 2).sum() for sizes in (*together, sizes))
    return float((first + second - 2 * both) / (len(one) * (len(one) - 1) / 2))


def _row(cut: str, size: int, route: str, figures: list[dict]) -> dict:
    means = {name: float(np.mean([one[name] for one in figures])) for name in figures[0]}
    counted = {"draws": len(figures), "clusters_exact": round(means["clusters_exact"])}
    least = min(one["ari"] for one in figures)
    return {"cut": cut, "landmarks": size, "route": route, **means, **counted, "ari_least": least}
