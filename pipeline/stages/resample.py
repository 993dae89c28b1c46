"""Features -> features with low-motion frames merged [DC 4.2]."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import merged
from motionary.pipeline.resample import Resampled
from motionary.pipeline.stages.columns import matrix, per_clip, vectors
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("resampled",)


def resample(features: pa.Table, config: FeatureConfig) -> dict[str, pa.Table]:
    """Merge the low-motion frames of a batch of clips.

    Parameters
    ----------
    features : pyarrow.Table
        The batch, at the common rate.
    config : FeatureConfig
        The kind of feature that is compared, and the bound of merging.

    Returns
    -------
    dict of str to pyarrow.Table
        `resampled`.
    """
    rows = [TABLES["resampled"].empty_table()]
    for clip_id, frames in per_clip(features).items():
        rows.append(_rows(clip_id, merged(matrix(frames["feature"]), config)))
    return {"resampled": pa.concat_tables(rows)}


def _rows(clip_id: str, resampled: Resampled) -> pa.Table:
    groups = len(resampled.values)
    return pa.table(
        {
            "clip_id": pa.repeat(clip_id, groups),
            "frame": np.arange(groups, dtype=np.int32),
            "first_frame": resampled.first.astype(np.int32),
            "last_frame": resampled.last.astype(np.int32),
            "feature": vectors(resampled.values),
        },
        schema=TABLES["resampled"],
    )
