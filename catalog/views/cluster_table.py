"""The published clusters, a row each."""

from __future__ import annotations

from collections.abc import Hashable

import pyarrow as pa

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
        cluster_id, label (null: unnamed), size, purity (the commonest supplied label's share of the clips
        that have one; null where none has) and reference (a clip_id).
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
    settings = catalog.settings
    column = settings["clusters"]["label_column"]
    clips = catalog.clips.to_arrow().sort_by("clip_id")
    if column not in clips.column_names or clips[column].null_count == len(clips):
        return {}
    clusters = catalog.clusters.to_arrow().sort_by("clip_id")["cluster_id"].to_pylist()
    return purity(clusters, clips[column].to_pylist()).by_cluster
