"""Clusters -> the clip that represents each [CoTW 5]."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.pipeline.alignment import joint_weights, score_references
from motionary.pipeline.alignment.reference import ReferenceScores
from motionary.pipeline.config import AlignmentConfig, ClusterConfig
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.stages.columns import condensed, condensed_places, matrix, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 4
MAKES = ("represented", "centres", "reference_features")


def represent(
    members: pa.Table,
    pairs: pa.Table,
    ingested: pa.Table,
    features: pa.Table,
    centres: pa.Table,
    reference_features: pa.Table,
    kept: Mapping[int, str],
    config: ClusterConfig,
    alignment: AlignmentConfig,
) -> dict[str, pa.Table]:
    """Choose each cluster's reference by the similarity index.

    Parameters
    ----------
    members : pyarrow.Table
        The cluster of every clip, in clip_id order.
    pairs : pyarrow.Table
        Every pair of clips.
    ingested, features : pyarrow.Table
        The clips of clusters that are not `kept`, and maybe more, and their frames at the common rate.
    centres, reference_features : pyarrow.Table
        What this stage made in the earlier run.
    kept : mapping of int to str
        Clusters whose clips are what they were, and what their reference is called now.
    config : ClusterConfig
        The distance.
    alignment : AlignmentConfig
        The weights, which the similarity index shares with the alignment.

    Returns
    -------
    dict of str to pyarrow.Table
        `represented`, `centres` and `reference_features`.
    """
    clip_ids = members["clip_id"].to_pylist()
    cluster_of = members["cluster_id"].to_numpy()
    places = condensed_places(pairs, members["clip_id"])
    square, weighted = (squareform(condensed(pairs, name, places)) for name in (config.metric, "weighted"))
    digests = dict(zip(ingested["clip_id"].to_pylist(), ingested["digest"].to_pylist(), strict=True))
    sequences = per_clip(features)
    weights = joint_weights(alignment.weights)
    earlier = {row["cluster_id"]: row for row in centres.to_pylist()}
    earlier_features = _by_cluster(reference_features)

    reference = np.zeros(len(clip_ids), dtype=np.intp)
    rows, representing = [], [TABLES["reference_features"].empty_table()]
    for one in np.unique(cluster_of).tolist():
        inside = np.flatnonzero(cluster_of == one)
        if one in kept:
            index = clip_ids.index(kept[one])
            row, frames = earlier[one] | {"clip_id": kept[one]}, earlier_features[one]["feature"]
        else:
            # In the order of their contents: of equally good references none is chosen for its name.
            inside = np.array(sorted(inside, key=lambda i: digests[clip_ids[i]]))
            poses = [matrix(sequences[clip_ids[i]]["feature"])[:, :POSE_COLUMNS] for i in inside]
            scores = score_references(poses, weights, distances=weighted[np.ix_(inside, inside)])
            index = int(inside[scores.index])
            frames = sequences[clip_ids[index]]["feature"]
            row = _centre(one, clip_ids[index], digests, len(inside), len(frames), scores)
        reference[inside] = index
        rows.append(row)
        representing.append(_reference_features(one, row["clip_id"], frames))
    return {
        "represented": _represented(members, reference, square),
        "centres": pa.Table.from_pylist(rows, schema=TABLES["centres"]),
        "reference_features": pa.concat_tables(representing),
    }


def _by_cluster(reference_features: pa.Table) -> dict[int, pa.Table]:
    return {rows["cluster_id"][0].as_py(): rows for rows in per_clip(reference_features).values()}


def _centre(
    cluster_id: int, clip_id: str, digests: Mapping[str, str], size: int, frames: int, scores: ReferenceScores
) -> dict:
    similarity = float(scores.similarity[scores.index])
    return {
        "cluster_id": cluster_id,
        "clip_id": clip_id,
        "digest": digests[clip_id],
        "size": size,
        "frames": frames,
        "similarity_index": similarity if np.isfinite(similarity) else None,
    }


def _represented(members: pa.Table, reference: NDArray[np.intp], square: NDArray) -> pa.Table:
    clips = np.arange(len(members))
    columns = {
        "clip_id": members["clip_id"],
        "cluster_id": members["cluster_id"],
        "is_reference": clips == reference,
        "distance_to_reference": square[clips, reference],
    }
    return pa.table(columns, schema=TABLES["represented"])


def _reference_features(cluster_id: int, clip_id: str, frames: pa.ChunkedArray) -> pa.Table:
    columns = {
        "cluster_id": pa.repeat(pa.scalar(cluster_id, pa.int32()), len(frames)),
        "clip_id": pa.repeat(clip_id, len(frames)),
        "feature": frames,
    }
    return pa.table(columns, schema=TABLES["reference_features"])
