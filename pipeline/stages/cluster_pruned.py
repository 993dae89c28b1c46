"""The pairs at most mu apart -> the clusters of complete linkage cut at mu [DC 5].

They are those that all pairs would give. Other distances and linkages, and what complete linkage merges above
mu, need the other pairs: of the dendrograms there is none, of the partitions this one.
"""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.clustering.sparse_linkage import complete_linkage_under
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
        Every pair whose weighted distance is at most the threshold; 20 bytes of each are held.
    config : ClusterConfig
        The threshold, and the label column.

    Returns
    -------
    dict of str to pyarrow.Table
        The tables of `cluster`: `linkage` empty, `partitions` and `cuts` of complete linkage by the weighted
        distance.
    """
    clips = join_labels(ingested.sort_by("clip_id"), labels)
    first, second, distances = _near(pairs, clips["clip_id"])
    clusters = complete_linkage_under(len(clips), first, second, distances).clusters
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


def _near(
    pairs: Parts, clip_ids: pa.ChunkedArray
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return the places of both clips of every pair, and their weighted distance."""
    place_of = places_by_clip(clip_ids)
    found = [(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.float32))]
    for part in pairs.read(["clip_a", "clip_b", "weighted"]):
        found.append((*pair_places(part, place_of), part["weighted"].to_numpy()))
    first, second, distances = (np.concatenate(column) for column in zip(*found, strict=True))
    return first, second, distances
