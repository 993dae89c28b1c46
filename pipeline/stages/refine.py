"""Groups of clips -> the parts that their own dendrograms fall into."""

from __future__ import annotations

from collections.abc import Sequence
from math import isinf

import numpy as np
import pyarrow as pa

from motionary.pipeline.clustering import landmarks
from motionary.pipeline.config import ClusterConfig, DistanceConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.clip_frames import ClipFrames, Measure, channels_of, frames_of
from motionary.pipeline.stages.compare import thresholds_of
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("refined",)

Members = Sequence[tuple[str, str]]
"""The clips of a group in clip_id order, each with what it is drawn by, where landmarks are."""


def refine(
    resampled: Parts,
    groups: Sequence[Members],
    config: ClusterConfig,
    distances: DistanceConfig,
    threshold: float,
    most: int,
) -> dict[str, pa.Table]:
    """Part groups of clips by all their pairs, or the large ones by landmarks of their own.

    Parameters
    ----------
    resampled : Parts
        The clips of the groups, and maybe more; read twice. None where nothing is to be parted.
    groups : sequence of Members
        Whose clips are parted; their frames lie in a temporary file.
    config : ClusterConfig
        Linkage and distance.
    distances : DistanceConfig
        The thresholds of the curve.
    threshold : float
        mu on all clips; of an infinite one the groups stay as they are.
    most : int
        Clips whose pairs are all compared: a few times the square of it in bytes are held.

    Returns
    -------
    dict of str to pyarrow.Table
        `refined`, group by group.
    """
    clip_ids = [clip_id for group in groups if to_part(group, threshold) for clip_id, _ in group]
    frames = frames_of(resampled, clip_ids)
    measure = Measure(channels_of(config), thresholds_of(distances))
    columns: dict[str, list] = {name: [] for name in TABLES["refined"].names}
    for group in groups:
        parts = compared = np.zeros(len(group), np.int64)
        if to_part(group, threshold):
            asked = ClipFrames([frames[clip_id] for clip_id, _ in group], measure)
            contents = [content for _, content in group]
            parts, compared = landmarks.refine(contents, asked, config, threshold, most), asked.compared
        _, first = np.unique(parts, return_index=True)
        columns["clip_id"] += [clip_id for clip_id, _ in group]
        columns["first"] += [group[place][0] for place in first[parts].tolist()]
        columns["compared"] += compared.tolist()
    return {"refined": pa.table(columns, schema=TABLES["refined"])}


def to_part(group: Members, threshold: float) -> bool:
    """Say whether a group can fall into parts."""
    return len(group) > 1 and not isinf(threshold)
