"""Two batches of clips -> a tile of pairs [DC 3-5]."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from motionary.pipeline.config import DistanceConfig
from motionary.pipeline.distances import THRESHOLDS, compare_clips, random_thresholds
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("pairs",)


def compare(first: pa.Table, second: pa.Table, config: DistanceConfig) -> dict[str, pa.Table]:
    """Compute every distance between the clips of two batches.

    Parameters
    ----------
    first, second : pyarrow.Table
        `resampled` of two batches, or of one and the same; a pair of clips is compared once.
    config : DistanceConfig
        The thresholds.

    Returns
    -------
    dict of str to pyarrow.Table
        `pairs`.
    """
    thresholds = THRESHOLDS if config.thresholds == "midpoints" else random_thresholds(config.seed)
    one, other = per_clip(first), per_clip(second)
    result = compare_clips(
        [matrix(clip["feature"]) for clip in one.values()],
        [matrix(clip["feature"]) for clip in other.values()],
        thresholds,
    )
    names_a, names_b = np.array([*one], dtype=object), np.array([*other], dtype=object)
    i, j = np.nonzero(names_a[:, None] < names_b[None, :])
    columns = {
        "clip_a": pa.array(names_a[i], pa.string()),
        "clip_b": pa.array(names_b[j], pa.string()),
        "curve": pa.FixedSizeListArray.from_arrays(result.curve[i, j].astype(np.float32).ravel(), 8),
    }
    for name in ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high"):
        columns[name] = pa.array(getattr(result, name)[i, j].astype(np.float32))
    return {"pairs": pa.table(columns).select(TABLES["pairs"].names).cast(TABLES["pairs"])}
