"""Clusters -> the clip that represents each [CoTW 5].

Nothing holds the whole library. The poses of as many clusters as there is room for are held at a time,
length-matched as they are read; of the pairs, which are read once, there remain one distance a clip and how
many pairs it was seen in. Beside the parts that are being read this takes, in bytes:

- of every clip what it is called, its digest and its distance: about 600
- of every clip of a group of clusters 228 m for its poses: m is the median length in its cluster, frames,
  and 57 columns are float32. The similarity index takes 81 m more for a clip of the one cluster that it is at
  work on, and at most 64 MB. A group is as many clusters as stay within the room, and at least one
- of every reference 236 a frame, which are the result

Where no clip of a cluster is similar to all others (one that stands still is similar to none), the medoid by
the weighted distance is taken, and the pairs are read once more.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.alignment import joint_weights, similarity_index
from motionary.pipeline.alignment.reference import first_of_least, length_matched, median_length
from motionary.pipeline.config import AlignmentConfig, ClusterConfig
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.clustered_pairs import ClusteredPairs, Inside
from motionary.pipeline.stages.columns import copied, matrix, per_clip, places_by_clip
from motionary.pipeline.stages.groups import groups_within
from motionary.pipeline.tables import TABLES

VERSION = 4
MAKES = ("represented", "centres", "reference_features")

_POSE_BYTES = POSE_COLUMNS * 4
_WORK_BYTES = POSE_COLUMNS + 3 * 8  # of a frame: whether each value is finite, and a column in float64
_MOST_WORK = 2**26


@dataclass(frozen=True, eq=False)
class _Cluster:
    """A cluster that is to be represented.

    Parameters
    ----------
    cluster_id : int
    clip_ids : sequence of str
        In the order of their contents: of equally good references none is chosen for its name.
    frames : int
        The length that they are brought to.
    """

    cluster_id: int
    clip_ids: Sequence[str]
    frames: int

    @property
    def held(self) -> int:
        """Bytes of its poses."""
        return _POSE_BYTES * self.frames * len(self.clip_ids)

    @property
    def work(self) -> int:
        """Bytes that its similarity index takes beside them, at most."""
        clips = len(self.clip_ids)
        return _WORK_BYTES * self.frames * clips + min(16 * clips * clips, _MOST_WORK)


def represent(
    members: pa.Table,
    ingested: pa.Table,
    centres: pa.Table,
    reference_features: pa.Table,
    pairs: Parts,
    features: Parts,
    kept: Mapping[int, str],
    config: ClusterConfig,
    alignment: AlignmentConfig,
    room: int,
) -> dict[str, pa.Table]:
    """Choose each cluster's reference by the similarity index.

    Parameters
    ----------
    members : pyarrow.Table
        The cluster of every clip, in clip_id order.
    ingested : pyarrow.Table
        clip_id and digest of the clips of clusters that are not `kept`, and maybe of more.
    centres, reference_features : pyarrow.Table
        What this stage made in the earlier run.
    pairs : Parts
        Every pair of two clips of one cluster, and maybe more.
    features : Parts
        The frames, at the common rate, of the clips of clusters that are not `kept`, and maybe of more; all
        those of a clip in one part.
    kept : mapping of int to str
        Clusters whose clips are what they were, and what their reference is called now.
    config : ClusterConfig
        The distance.
    alignment : AlignmentConfig
        The weights, which the similarity index shares with the alignment.
    room : int
        Bytes that a group of clusters may take, see above; no bit of the result depends on it.

    Returns
    -------
    dict of str to pyarrow.Table
        `represented`, `centres` and `reference_features`.

    Raises
    ------
    ValueError
        A pair of two clips of one cluster is missing or stands twice, or a clip has no frames.
    """
    inside = ClusteredPairs(pairs, members["clip_id"], members["cluster_id"].to_numpy())
    return represent_by(
        inside, digests_of(ingested), centres, reference_features, features, kept, config, alignment, room
    )


def represent_by(
    inside: Inside,
    digests: Mapping[str, str],
    centres: pa.Table,
    reference_features: pa.Table,
    features: Parts,
    kept: Mapping[int, str],
    config: ClusterConfig,
    alignment: AlignmentConfig,
    room: int,
) -> dict[str, pa.Table]:
    """Choose references by the similarity index, given the clips with their clusters and distances.

    The parameters are those of `represent`; `digests` are of the clips of `ingested`.
    """
    members = pa.table({"clip_id": inside.clip_ids, "cluster_id": pa.array(inside.clusters, pa.int32())})
    places = places_by_clip(members["clip_id"])
    clusters = _clusters(members, kept, digests, features)
    weights = joint_weights(alignment.weights)
    similarities: dict[int, FloatArray] = {}
    for group in groups_within(clusters, room):
        similarities |= _similarities(group, features, weights)
    chosen = _chosen(clusters, similarities, inside, places)

    reference_of = {**kept, **{one.cluster_id: one.clip_ids[chosen[one.cluster_id]] for one in clusters}}
    reference = np.array([places[reference_of[one]] for one in inside.clusters.tolist()], dtype=np.int64)
    distances = inside.distances_to(reference, config.metric)

    rows = {row["cluster_id"]: row for row in centres.to_pylist()}
    frames = {one: earlier["feature"] for one, earlier in _by_cluster(reference_features).items()}
    new_frames = _frames_of({reference_of[one.cluster_id] for one in clusters}, features)
    for one in clusters:
        cluster_id, clip_id = one.cluster_id, reference_of[one.cluster_id]
        frames[cluster_id] = new_frames[clip_id]
        similarity = float(similarities[cluster_id][chosen[cluster_id]])
        rows[cluster_id] = {
            "cluster_id": cluster_id,
            "digest": digests[clip_id],
            "size": len(one.clip_ids),
            "frames": len(frames[cluster_id]),
            "similarity_index": similarity if np.isfinite(similarity) else None,
        }
    in_order = sorted(reference_of)
    centre_rows = [rows[one] | {"clip_id": reference_of[one]} for one in in_order]
    representing = [_reference_features(one, reference_of[one], frames[one]) for one in in_order]
    return {
        "represented": _represented(members, reference, distances),
        "centres": pa.Table.from_pylist(centre_rows, schema=TABLES["centres"]),
        "reference_features": pa.concat_tables([TABLES["reference_features"].empty_table(), *representing]),
    }


def digests_of(ingested: pa.Table) -> dict[str, str]:
    """Return the digest of every clip's bytes."""
    return dict(zip(ingested["clip_id"].to_pylist(), ingested["digest"].to_pylist(), strict=True))


def _clusters(
    members: pa.Table, kept: Mapping[int, str], digests: Mapping[str, str], features: Parts
) -> list[_Cluster]:
    """List the clusters that are not kept, by number."""
    clips: dict[int, list[str]] = {}
    rows = zip(members["clip_id"].to_pylist(), members["cluster_id"].to_pylist(), strict=True)
    for clip_id, cluster_id in rows:
        if cluster_id not in kept:
            clips.setdefault(cluster_id, []).append(clip_id)
    lengths: dict[str, int] = {}
    for part in features.read(["clip_id"]):
        lengths |= {clip_id: len(frames) for clip_id, frames in per_clip(part).items()}
    for clip_id in (clip_id for ids in clips.values() for clip_id in ids if clip_id not in lengths):
        raise ValueError(f"{clip_id} has no frames among the features that it is to be represented by")
    return [
        _Cluster(one, sorted(ids, key=lambda i: digests[i]), median_length([lengths[i] for i in ids]))
        for one, ids in sorted(clips.items())
    ]


def _similarities(group: Sequence[_Cluster], features: Parts, weights: FloatArray) -> dict[int, FloatArray]:
    """Compute the similarity index of the clips of some clusters, reading the features once."""
    poses = {one.cluster_id: np.empty((len(one.clip_ids), one.frames, POSE_COLUMNS), np.float32)
             for one in group}  # fmt: skip
    row_of = {clip_id: poses[one.cluster_id][i] for one in group for i, clip_id in enumerate(one.clip_ids)}
    for part in features.read(["clip_id", "feature"]):
        for clip_id, rows in per_clip(part).items():
            if clip_id in row_of:
                row = row_of[clip_id]
                row[:] = length_matched(matrix(rows["feature"])[:, :POSE_COLUMNS], len(row))
    return {cluster_id: similarity_index(poses[cluster_id], weights) for cluster_id in poses}


def _chosen(
    clusters: Sequence[_Cluster],
    similarities: Mapping[int, FloatArray],
    inside: Inside,
    places: Mapping[str, int],
) -> dict[int, int]:
    """Choose of every cluster the most similar clip, or the medoid; by its place in the cluster."""
    chosen = {
        one: first_of_least(-similarity)
        for one, similarity in similarities.items()
        if np.isfinite(similarity).any()
    }
    if len(chosen) < len(clusters):
        sums = inside.sums("weighted", {one.cluster_id for one in clusters} - chosen.keys())
        for one in clusters:
            if one.cluster_id not in chosen:
                chosen[one.cluster_id] = first_of_least(sums[[places[clip_id] for clip_id in one.clip_ids]])
    return chosen


def _frames_of(clip_ids: Collection[str], features: Parts) -> dict[str, pa.ChunkedArray]:
    """Read the features of a few clips."""
    found: dict[str, pa.ChunkedArray] = {}
    if clip_ids:
        for part in features.read(["clip_id", "feature"]):
            for clip_id, rows in per_clip(part).items():
                if clip_id in clip_ids:
                    found[clip_id] = copied(rows)["feature"]
    return found


def _by_cluster(reference_features: pa.Table) -> dict[int, pa.Table]:
    return {rows["cluster_id"][0].as_py(): rows for rows in per_clip(reference_features).values()}


def _represented(members: pa.Table, reference: NDArray[np.int64], distances: FloatArray) -> pa.Table:
    columns = {
        "clip_id": members["clip_id"],
        "cluster_id": members["cluster_id"],
        "is_reference": np.arange(len(members)) == reference,
        "distance_to_reference": distances,
    }
    return pa.table(columns, schema=TABLES["represented"])


def _reference_features(cluster_id: int, clip_id: str, frames: pa.ChunkedArray) -> pa.Table:
    columns = {
        "cluster_id": pa.repeat(pa.scalar(cluster_id, pa.int32()), len(frames)),
        "clip_id": pa.repeat(clip_id, len(frames)),
        "feature": frames,
    }
    return pa.table(columns, schema=TABLES["reference_features"])
