"""The published clusters, a row each."""

from __future__ import annotations

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
        cluster_id, label (null: unnamed), size, purity (the commonest own label's share of the clips
        that have one, from a person or supplied; null where none has) and reference (a clip_id).
    """
    references = catalog.references.to_arrow().sort_by([("size", "descending"), ("cluster_id", "ascending")])
    pure = _purity_by_cluster(catalog)
    return pa.table(
        {
            "cluster_id": references["cluster_id"],
            "label": references["label"],
            "size": references["size"],
            "purity": pa.array([pure.get(one) for one in references["cluster_id"].to_pylist()], pa.float64()),
            "reference": references["clip_id"],
        }
    )


def _purity_by_cluster(catalog: Catalog) -> dict[Hashable, float]:
    clusters = catalog.clusters.to_arrow()
    own = pc.is_in(clusters["label_source"], pa.array(["override", "supplied"]))
    labels = pc.if_else(own, clusters["label"], None)
    if labels.null_count == len(clusters):
        return {}
    return purity(clusters["cluster_id"].to_pylist(), labels.to_pylist()).by_cluster
