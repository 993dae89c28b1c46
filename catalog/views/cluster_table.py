"""The published clusters, a row each, and the clips in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.query import Catalog
from motionary.pipeline.clustering import OWN_LABEL_SOURCES
from motionary.pipeline.evaluation import purity


def cluster_table(catalog: Catalog) -> pa.Table:
    """List the published clusters, the largest first.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.

    Returns
    -------
    pyarrow.Table
        cluster_id, label (null: unnamed), size, labelled (how many of its clips have a label of their
        own, from a person or supplied), purity (the commonest own label's share of the clips
        that have one, from a person or supplied; null where none has) and reference (a clip_id).
    """
    references = catalog.references.to_arrow().sort_by([("size", "descending"), ("cluster_id", "ascending")])
    clusters = catalog.clusters.to_arrow()
    own = _own_labels(clusters)
    pure = _purity_by_cluster(clusters, own)
    labelled = Counter(clusters["cluster_id"].filter(own.is_valid()).to_pylist())
    return pa.table(
        {
            "cluster_id": references["cluster_id"],
            "label": references["label"],
            "size": references["size"],
            "labelled": pa.array([labelled[one] for one in references["cluster_id"].to_pylist()], pa.int32()),
            "purity": pa.array([pure.get(one) for one in references["cluster_id"].to_pylist()], pa.float64()),
            "reference": references["clip_id"],
        }
    )


def cluster_members(catalog: Catalog) -> dict[int, list[dict[str, Any]]]:
    """List the clips of every cluster: rows of `clusters`, the reference first, then the nearest to it."""
    order = [("is_reference", "descending"), ("distance_to_reference", "ascending"), ("clip_id", "ascending")]
    members: dict[int, list[dict[str, Any]]] = {}
    for clip in catalog.clusters.to_arrow().sort_by(order).to_pylist():
        members.setdefault(clip["cluster_id"], []).append(clip)
    return members


def _own_labels(clusters: pa.Table) -> pa.ChunkedArray:
    own = pc.is_in(clusters["label_source"], pa.array(OWN_LABEL_SOURCES))
    return pc.if_else(own, clusters["label"], None)


def _purity_by_cluster(clusters: pa.Table, labels: pa.ChunkedArray) -> dict[Hashable, float]:
    if labels.null_count == len(clusters):
        return {}
    return purity(clusters["cluster_id"].to_pylist(), labels.to_pylist()).by_cluster
