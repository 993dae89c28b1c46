"""Clusters of landmarks -> the landmarks that stand for them."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
from scipy.spatial.distance import squareform

from motionary.pipeline.clustering.landmark_steps import standing_for
from motionary.pipeline.clustering.primary import merge_key
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.clip_frames import channels_of
from motionary.pipeline.stages.columns import copied, mapped_distances, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("standing",)


def stand(groups: pa.Table, pairs: Parts, sampled: Parts, config: ClusterConfig) -> dict[str, pa.Table]:
    """Choose the landmarks that every other clip is compared with.

    Parameters
    ----------
    groups : pyarrow.Table
        The cluster of every landmark.
    pairs : Parts
        Every pair of them; held are n^2 distances.
    sampled : Parts
        Their merged frames.
    config : ClusterConfig
        Linkage and distance.

    Returns
    -------
    dict of str to pyarrow.Table
        `standing`, group by group.
    """
    if not len(groups):
        return {"standing": TABLES["standing"].empty_table()}
    clip_ids = groups["clip_id"].to_pylist()
    channels = np.stack(mapped_distances(pairs, channels_of(config), groups["clip_id"]))
    square = squareform(merge_key(channels, config), checks=False)
    standing = standing_for(square, groups["group"].to_numpy().astype(np.int64))
    group_of = {
        clip_ids[place]: group
        for place, group in zip(standing.places.tolist(), standing.group_of.tolist(), strict=True)
    }
    frames: dict[str, pa.ChunkedArray] = {}
    for part in sampled.read(["clip_id", "feature"]):
        for clip_id, rows in per_clip(part).items():
            if clip_id in group_of:
                frames[clip_id] = copied(rows)["feature"]
    rows = [_rows(group, clip_id, frames[clip_id]) for clip_id, group in group_of.items()]
    return {"standing": pa.concat_tables(rows)}


def _rows(group: int, clip_id: str, frames: pa.ChunkedArray) -> pa.Table:
    columns = {
        "group": pa.repeat(pa.scalar(group, pa.int32()), len(frames)),
        "clip_id": pa.repeat(clip_id, len(frames)),
        "feature": frames,
    }
    return pa.table(columns, schema=TABLES["standing"])
