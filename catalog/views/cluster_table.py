"""The published clusters, a row each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.query import Catalog
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


def _own_labels(clusters: pa.Table) -> pa.ChunkedArray:
    own = pc.is_in(clusters["label_source"], pa.array(["override", "supplied"]))
    return pc.if_else(own, clusters["label"], None)


def _purity_by_cluster(clusters: pa.Table, labels: pa.ChunkedArray) -> dict[Hashable, float]:
    if labels.null_count == len(clusters):
        return {}
    return purity(clusters["cluster_id"].to_pylist(), labels.to_pylist()).by_cluster
