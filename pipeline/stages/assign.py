"""A batch of clips -> the clusters of landmarks that they are nearest to."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pyarrow as pa

from motionary.pipeline.clustering.landmark_steps import nearest_group
from motionary.pipeline.clustering.primary import merge_key
from motionary.pipeline.config import ClusterConfig, DistanceConfig
from motionary.pipeline.stages.clip_frames import Measure, channels_of
from motionary.pipeline.stages.columns import matrices_by_clip, per_clip
from motionary.pipeline.stages.compare import thresholds_of
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("assigned",)


def assign(
    resampled: pa.Table,
    standing: pa.Table,
    own: Mapping[str, int],
    config: ClusterConfig,
    distances: DistanceConfig,
) -> dict[str, pa.Table]:
    """Give every clip of a batch the group of the landmark that is nearest to it.

    Parameters
    ----------
    resampled : pyarrow.Table
        The batch.
    standing : pyarrow.Table
        The landmarks that stand for groups.
    own : mapping of str to int
        Of the landmarks in the batch, their groups.
    config : ClusterConfig
        Linkage and distance.
    distances : DistanceConfig
        The thresholds.

    Returns
    -------
    dict of str to pyarrow.Table
        `assigned`.
    """
    batch, group_of = matrices_by_clip(resampled), dict(own)
    others = [clip_id for clip_id in batch if clip_id not in own]
    stand = matrices_by_clip(standing)
    if others:
        measure = Measure(channels_of(config), thresholds_of(distances))
        found = measure.between([batch[one] for one in others], [*stand.values()])
        groups = np.array([rows["group"][0].as_py() for rows in per_clip(standing).values()])
        nearest = nearest_group(merge_key(found, config), groups)
        group_of |= dict(zip(others, nearest.tolist(), strict=True))
    columns = {
        "clip_id": [*batch],
        "group": [group_of[one] for one in batch],
        "compared": [0 if one in own else len(stand) for one in batch],
    }
    return {"assigned": pa.table(columns, schema=TABLES["assigned"])}
