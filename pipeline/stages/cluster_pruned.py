"""The pairs at most mu apart -> the clusters of complete linkage cut at mu [DC 5].

They are those that all pairs would give. Other distances and linkages, and what complete linkage merges above
mu, need the other pairs: of the dendrograms there is none, of the partitions this one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pyarrow as pa

from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.clustering.sparse_linkage import KnownPairs, complete_linkage_under
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.cluster import classes_of, groups_table, join_labels, partition_rows, scores
from motionary.pipeline.stages.columns import pair_places, places_by_clip
from motionary.pipeline.tables import TABLES


def cluster_pruned(
    ingested: pa.Table, pairs: Parts, labels: pa.Table, overrides: pa.Table, config: ClusterConfig
) -> dict[str, pa.Table]:
    """Cluster the clips of a library by the pairs that are near enough to be merged.

    Parameters
    ----------
    ingested, labels, overrides : pyarrow.Table
        As for `motionary.pipeline.stages.cluster.cluster`.
    pairs : Parts
        Every pair whose weighted distance is at most the threshold; 16 bytes of each are held, in temporary
        files.
    config : ClusterConfig
        The threshold, and the label column.

    Returns
    -------
    dict of str to pyarrow.Table
        The tables of `cluster`: `linkage` empty, `partitions` and `cuts` of complete linkage by the weighted
        distance.
    """
    clips = join_labels(ingested.sort_by("clip_id"), labels)
    place_of = places_by_clip(clips["clip_id"])
    clusters = complete_linkage_under(len(clips), lambda: _near(pairs, place_of), mapped_array).clusters
    kappa = int(clusters.max(initial=-1)) + 1
    row = {
        "method": "complete",
        "metric": "weighted",
        "primary": True,
        "rule": "threshold",
        "n_clusters": kappa,
        "threshold": config.threshold,
        "published_rule": "threshold",
        "published_clusters": kappa,
        "published_threshold": config.threshold,
    }
    row |= scores(clusters, classes_of(clips, overrides, config.label_column))
    return {
        "clips": clips,
        "linkage": TABLES["linkage"].empty_table(),
        "partitions": partition_rows("complete", "weighted", clips["clip_id"], clusters),
        "cuts": pa.Table.from_pylist([row] if len(clips) else [], schema=TABLES["cuts"]),
        "groups": groups_table(clips["clip_id"], clusters),
    }


def _near(pairs: Parts, place_of: Mapping[str, int]) -> Iterator[KnownPairs]:
    """Return of every part the places of both clips of every pair, and their weighted distance."""
    for part in pairs.read(["clip_a", "clip_b", "weighted"]):
        yield *pair_places(part, place_of), part["weighted"].to_numpy()
