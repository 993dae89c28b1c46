"""All pairs of the landmarks -> their dendrograms, cuts, and the clusters that the others are assigned to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pyarrow as pa
import pyarrow.compute as pc

from motionary.pipeline.clustering.primary import threshold_on_part
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.cluster import cluster, join_labels


def cluster_landmarks(
    ingested: pa.Table,
    pairs: Parts,
    landmarks: Sequence[str],
    labels: pa.Table,
    overrides: pa.Table,
    config: ClusterConfig,
) -> dict[str, pa.Table]:
    """Cluster the landmarks of a library exactly.

    Parameters
    ----------
    ingested : pyarrow.Table
        Every clip of the library.
    pairs : Parts
        Every pair of landmarks.
    landmarks : sequence of str
        Those that could not be read among them.
    labels, overrides : pyarrow.Table
        As for `motionary.pipeline.stages.cluster.cluster`.
    config : ClusterConfig
        A threshold in it is one on all clips.

    Returns
    -------
    dict of str to pyarrow.Table
        `clips`: those of the library. `linkage`, `partitions`, `cuts` and `groups`: of the landmarks, in
        clip_id order.
    """
    chosen = ingested.filter(pc.is_in(ingested["clip_id"], pa.array(landmarks, pa.string())))
    if config.threshold is not None and len(chosen):
        mu = threshold_on_part(config, config.threshold, len(chosen) / len(ingested))
        config = replace(config, threshold=mu)
    made = cluster(chosen, pairs, labels, overrides, config)
    return made | {"clips": join_labels(ingested.sort_by("clip_id"), labels)}
