"""Clusters -> the clip that represents each, and what the clusters and their clips are called."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.pipeline.alignment import joint_weights, score_references
from motionary.pipeline.clustering import Names, name_clusters
from motionary.pipeline.config import AlignmentConfig, ClusterConfig
from motionary.pipeline.stages.columns import POSE_COLUMNS, condensed, condensed_places, matrix, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 2
MAKES = ("clusters", "references", "reference_features")


def represent(
    clips: pa.Table,
    members: pa.Table,
    pairs: pa.Table,
    features: pa.Table,
    config: ClusterConfig,
    alignment: AlignmentConfig,
) -> dict[str, pa.Table]:
    """Choose each cluster's reference by the similarity index [CoTW 5] and name clusters and clips [DC 5].

    Parameters
    ----------
    clips : pyarrow.Table
        Every clip with its supplied labels, in clip_id order.
    members : pyarrow.Table
        The cluster of every clip, in the same order.
    pairs : pyarrow.Table
        Every pair of clips.
    features : pyarrow.Table
        Every clip's frames at the common rate.
    config : ClusterConfig
        The distance, the label column and the reach of a name.
    alignment : AlignmentConfig
        The weights, which the similarity index shares with the alignment.

    Returns
    -------
    dict of str to pyarrow.Table
        `clusters`, `references` and `reference_features`.
    """
    if len(clips) == 0:
        return {name: TABLES[name].empty_table() for name in MAKES}
    clip_ids = clips["clip_id"].to_pylist()
    cluster_of = members["cluster_id"].to_numpy()
    places = condensed_places(pairs, clips["clip_id"])
    square, weighted = (squareform(condensed(pairs, name, places)) for name in (config.metric, "weighted"))
    sequences = per_clip(features)
    weights = joint_weights(alignment.weights)

    reference_of: dict[int, int] = {}
    similarity: dict[int, float] = {}
    for one in np.unique(cluster_of).tolist():
        inside = np.flatnonzero(cluster_of == one)
        poses = [matrix(sequences[clip_ids[i]]["feature"])[:, :POSE_COLUMNS] for i in inside]
        scores = score_references(poses, weights, distances=weighted[np.ix_(inside, inside)])
        reference_of[one] = int(inside[scores.index])
        similarity[one] = float(scores.similarity[scores.index])

    to_reference = square[np.arange(len(clip_ids)), [reference_of[one] for one in cluster_of.tolist()]]
    labels = _own_labels(clips, config.label_column)
    names = name_clusters(cluster_of, labels, [None] * len(labels), to_reference, config.reach)
    reference_ids = {one: clip_ids[index] for one, index in reference_of.items()}
    return {
        "clusters": _cluster_rows(clip_ids, cluster_of, names, to_reference, set(reference_of.values())),
        "references": _reference_rows(reference_ids, cluster_of, names, sequences, similarity),
        "reference_features": pa.concat_tables(
            _reference_features(one, sequences[clip_id]) for one, clip_id in reference_ids.items()
        ),
    }


def _own_labels(clips: pa.Table, column: str) -> list[str | None]:
    if column not in clips.column_names:
        return [None] * len(clips)
    return [label or None for label in clips[column].to_pylist()]


def _cluster_rows(
    clip_ids: list[str], cluster_of: NDArray, names: Names, to_reference: NDArray, references: set[int]
) -> pa.Table:
    columns = {
        "clip_id": clip_ids,
        "cluster_id": pa.array(cluster_of, pa.int32()),
        "label": pa.array(names.label, pa.string()),
        "label_source": names.label_source,
        "confidence": names.confidence,
        "is_reference": [index in references for index in range(len(clip_ids))],
        "distance_to_reference": to_reference,
    }
    return pa.table(columns, schema=TABLES["clusters"])


def _reference_rows(
    reference_ids: dict[int, str],
    cluster_of: NDArray,
    names: Names,
    sequences: dict[str, pa.Table],
    similarity: dict[int, float],
) -> pa.Table:
    rows = [
        {
            "cluster_id": one,
            "clip_id": clip_id,
            "label": names.cluster_name[one],
            "size": int((cluster_of == one).sum()),
            "frames": len(sequences[clip_id]),
            "similarity_index": similarity[one] if np.isfinite(similarity[one]) else None,
        }
        for one, clip_id in reference_ids.items()
    ]
    return pa.Table.from_pylist(rows, schema=TABLES["references"])


def _reference_features(cluster_id: int, sequence: pa.Table) -> pa.Table:
    columns = {
        "cluster_id": pa.repeat(pa.scalar(cluster_id, pa.int32()), len(sequence)),
        "clip_id": sequence["clip_id"],
        "feature": sequence["feature"],
    }
    return pa.table(columns, schema=TABLES["reference_features"])
