"""Clusters with their references -> what the clusters and their clips are called [DC 5]."""

from __future__ import annotations

import pyarrow as pa

from motionary.pipeline.clustering import name_clusters
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.stages.cluster import own_labels, own_overrides
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("clusters", "references")


def name(
    clips: pa.Table, represented: pa.Table, centres: pa.Table, overrides: pa.Table, config: ClusterConfig
) -> dict[str, pa.Table]:
    """Name clusters by their members, and the other members by their cluster.

    Parameters
    ----------
    clips : pyarrow.Table
        Every clip with its supplied labels, in clip_id order.
    represented : pyarrow.Table
        The cluster of every clip, in the same order.
    centres : pyarrow.Table
        The reference of every cluster.
    overrides : pyarrow.Table
        clip_id and label of the clips that a person named.
    config : ClusterConfig
        The label column and the reach of a name.

    Returns
    -------
    dict of str to pyarrow.Table
        `clusters` and `references`.
    """
    names = name_clusters(
        represented["cluster_id"].to_numpy(),
        own_labels(clips, config.label_column),
        own_overrides(clips, overrides),
        represented["distance_to_reference"].to_numpy(),
        config.reach,
    )
    clusters = represented.append_column("label", pa.array(names.label, pa.string()))
    clusters = clusters.append_column("label_source", pa.array(names.label_source, pa.string()))
    clusters = clusters.append_column("confidence", pa.array(names.confidence))
    called = [names.cluster_name[one] for one in centres["cluster_id"].to_pylist()]
    references = centres.append_column("label", pa.array(called, pa.string()))
    return {
        made: table.select(TABLES[made].names).cast(TABLES[made])
        for made, table in (("clusters", clusters), ("references", references))
    }
