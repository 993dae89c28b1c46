"""Two batches of clips -> a tile of pairs [DC 3-5]."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from motionary.pipeline.config import DistanceConfig
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("pairs",)


def compare(first: pa.Table, second: pa.Table, config: DistanceConfig) -> dict[str, pa.Table]:
    """Compute every distance between the clips of two batches.

    Parameters
    ----------
    first, second : pyarrow.Table
        `resampled` of two batches, the earlier in clip_id order first, or twice of one; a pair of
        clips is compared once.
    config : DistanceConfig
        The thresholds.

    Returns
    -------
    dict of str to pyarrow.Table
        `pairs`.
    """
    from motionary.pipeline.distances import THRESHOLDS, compare_clips, pairwise_distances, random_thresholds

    thresholds = THRESHOLDS if config.thresholds == "midpoints" else random_thresholds(config.seed)
    one, other = per_clip(first), per_clip(second)
    clips, others = ([matrix(clip["feature"]) for clip in batch.values()] for batch in (one, other))
    if one.keys() == other.keys():
        result = pairwise_distances(clips, n_jobs=1, thresholds=thresholds)
        i, j = np.triu_indices(len(clips), 1)
    else:
        result = compare_clips(clips, others, thresholds)
        i, j = np.indices((len(clips), len(others))).reshape(2, -1)
    curve = result.curve.astype(np.float32).reshape(-1)
    columns = {
        "clip_a": pa.array([*one], pa.string()).take(pa.array(i)),
        "clip_b": pa.array([*other], pa.string()).take(pa.array(j)),
        "curve": pa.FixedSizeListArray.from_arrays(curve, len(thresholds)),
    }
    for name in ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high"):
        columns[name] = pa.array(getattr(result, name).astype(np.float32).reshape(-1))
    return {
        "pairs": pa.table({name: columns[name] for name in TABLES["pairs"].names}, schema=TABLES["pairs"])
    }
