"""Clusters and their references -> every clip aligned in time to its cluster's reference [CoTW 3]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pyarrow as pa

from motionary.pipeline.alignment import CotwWarp, cotw, cotw_search, joint_weights
from motionary.pipeline.alignment.nodes import LEAST_LENGTH
from motionary.pipeline.alignment.search import MOST_GRID_FRAMES
from motionary.pipeline.config import AlignmentConfig
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.stages.columns import carried_rows, matrix, per_clip
from motionary.pipeline.stages.motions import motion_rows, read_motions
from motionary.pipeline.tables import TABLES

VERSION = 2
MAKES = ("alignments", "aligned")


def align(
    ingested: pa.Table,
    frames: pa.Table,
    features: pa.Table,
    represented: pa.Table,
    reference_features: pa.Table,
    config: AlignmentConfig,
    frame_rate: float,
    carried: Sequence[tuple[Mapping[str, pa.Table], Mapping[str, str]]] = (),
) -> dict[str, pa.Table]:
    """Align the clips of a batch, each to the reference of its cluster.

    Parameters
    ----------
    ingested, frames, features : pyarrow.Table
        The batch.
    represented, reference_features : pyarrow.Table
        Of the whole library: the cluster of every clip, and the frames of every cluster's reference.
    config : AlignmentConfig
        The search, or the segments and slack, and the weights.
    frame_rate : float
        Frames a second of the features.
    carried : sequence of (tables, names)
        Earlier results that hold some of the clips aligned to the same references, and what those are called
        there.

    Returns
    -------
    dict of str to pyarrow.Table
        `alignments` and `aligned`.
    """
    cluster_of = dict(
        zip(represented["clip_id"].to_pylist(), represented["cluster_id"].to_pylist(), strict=True)
    )
    references = {
        rows["cluster_id"][0].as_py(): (clip_id, _pose(rows))
        for clip_id, rows in per_clip(reference_features).items()
    }
    sequences = per_clip(features)
    known, known_aligned = (carried_rows(carried, table) for table in MAKES)
    alignments, aligned = [TABLES["alignments"].empty_table()], [TABLES["aligned"].empty_table()]
    for clip_id, motion in read_motions(ingested, frames):
        cluster_id = cluster_of[clip_id]
        reference_id, reference = references[cluster_id]
        if clip_id in known:
            alignments.append(_in_cluster(known[clip_id], cluster_id, reference_id))
            aligned.append(known_aligned[clip_id])
            continue
        moving = _pose(sequences[clip_id])
        warp = _warp(moving, reference, config)
        alignments.append(
            _alignment_row(clip_id, cluster_id, reference_id, moving, reference, warp, config, frame_rate)
        )
        aligned.append(_aligned_rows(clip_id, motion, warp, frame_rate))
    return {"alignments": pa.concat_tables(alignments), "aligned": pa.concat_tables(aligned)}


def _in_cluster(row: pa.Table, cluster_id: int, reference_id: str) -> pa.Table:
    values = row.to_pylist()[0] | {"cluster_id": cluster_id, "reference_id": reference_id}
    return pa.Table.from_pylist([values], schema=TABLES["alignments"])


def _pose(rows: pa.Table) -> FloatArray:
    return matrix(rows["feature"])[:, :POSE_COLUMNS]


def _warp(moving: FloatArray, reference: FloatArray, config: AlignmentConfig) -> CotwWarp:
    weights, frames = joint_weights(config.weights), len(reference)
    if config.segment_length is None and config.segments is None:
        effort = "fast" if frames > MOST_GRID_FRAMES else config.search
        return cotw_search(
            moving, reference, weights, config.alpha,
            effort=effort, spacing=config.spacing, open_ends=config.open_ends,
        )  # fmt: skip
    # Of a reference that is too short for the setting, what it has.
    length, segments = config.segment_length, config.segments
    if segments is None:
        length = min(length or frames, frames)
        longest = length
    else:
        segments = min(segments, max(1, frames // LEAST_LENGTH))
        longest = frames // segments
    most = max(longest - LEAST_LENGTH, 0)
    return cotw(
        moving, reference, length, most if config.slack is None else min(config.slack, most), weights,
        segments=segments, spacing=config.spacing, open_ends=config.open_ends,
    )  # fmt: skip


def _alignment_row(
    clip_id: str,
    cluster_id: int,
    reference_id: str,
    moving: FloatArray,
    reference: FloatArray,
    warp: CotwWarp,
    config: AlignmentConfig,
    frame_rate: float,
) -> pa.Table:
    unwarped = cotw(moving, reference, segments=1, weights=joint_weights(config.weights))
    row = {
        "clip_id": clip_id,
        "cluster_id": cluster_id,
        "reference_id": reference_id,
        "frame_rate": frame_rate,
        "segment_length": warp.segment_length,
        "slack": warp.slack,
        "objective": warp.objective,
        "correlation_before": unwarped.correlation,
        "correlation": warp.correlation,
        "distortion": warp.distortion,
        "nodes": warp.nodes.tolist(),
        "first_frame": warp.first_frame,
        "eta": warp.eta.tolist(),
        "source_time": warp.source_time.tolist(),
    }
    return pa.Table.from_pylist([row], schema=TABLES["alignments"])


def _aligned_rows(clip_id: str, motion: Motion, warp: CotwWarp, frame_rate: float) -> pa.Table:
    rows = motion_rows(clip_id, warp.apply_motion(motion, rate=frame_rate))
    return rows.cast(TABLES["aligned"])
