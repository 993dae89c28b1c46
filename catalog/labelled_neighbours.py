"""The nearest clips of two labels, where not all pairs are stored: of a clip's own, and of its cluster's."""

from __future__ import annotations

from typing import Any

import numpy as np

from motionary.catalog.example import library_features
from motionary.catalog.neighbours import packed_library
from motionary.catalog.query import Catalog
from motionary.catalog.ranked_distance import ranked_distance
from motionary.pipeline.config import Metric

DOUBTFUL = """
select c.clip_id, c.label, r.label as name from clusters c join "references" r using (cluster_id)
where c.label_source = 'supplied' and c.label <> r.label
"""
"""Clips whose supplied label is not the name of their cluster."""


def labelled_neighbours(catalog: Catalog, metric: Metric) -> list[dict[str, Any]]:
    """Find, exactly, the nearest clip of the own label and the nearest of the cluster's.

    Returns
    -------
    list of dict
        clip_id, other, distance; up to two for every clip whose supplied label is not its cluster's name.
    """
    doubtful = catalog.sql(f"{DOUBTFUL} order by c.clip_id").to_pylist()
    if not doubtful:
        return []
    from motionary.pipeline.distances.nearest import nearest_clips

    features, library = library_features(catalog), packed_library(catalog)
    distance = ranked_distance(catalog.config, metric)
    place_of = {clip_id: place for place, clip_id in enumerate(features.clip_ids)}
    own = catalog.sql("select clip_id, label from clusters where label_source in ('override', 'supplied')")
    labels = np.full(len(place_of), None, dtype=object)
    labels[[place_of[one] for one in own["clip_id"].to_pylist()]] = own["label"].to_pylist()
    found = []
    for row in doubtful:
        place = place_of[row["clip_id"]]
        alike = (labels == row["label"]) | (labels == row["name"])
        alike[place] = False
        if not alike.any():
            continue
        nearest = nearest_clips(
            features.clips[place], library, 2, distance.metric, distance.thresholds, tau=distance.tau,
            groups=(labels == row["name"]).astype(np.int64), among=np.flatnonzero(alike),
        )  # fmt: skip
        found += [
            {"clip_id": row["clip_id"], "other": features.clip_ids[other], "distance": float(far)}
            for other, far in zip(nearest.index.tolist(), nearest.distance.tolist(), strict=True)
        ]
    return found
