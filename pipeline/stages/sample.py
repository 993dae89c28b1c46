"""Resampled clips of many batches -> those of a side of landmarks, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import pyarrow as pa

from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import copied, per_clip
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("sampled",)


def sample(resampled: Parts, clip_ids: Sequence[str]) -> dict[str, pa.Table]:
    """Gather landmarks, so that a tile of them reads two parts and not those of all their batches.

    Parameters
    ----------
    resampled : Parts
        The batches that they are of.
    clip_ids : sequence of str
        The landmarks; those that could not be read are left out.

    Returns
    -------
    dict of str to pyarrow.Table
        `sampled`, in the order of `clip_ids`.
    """
    found: dict[str, pa.Table] = {}
    for part in resampled.read():
        clips = per_clip(part)
        for clip_id in clips.keys() & set(clip_ids):
            found[clip_id] = copied(clips[clip_id])
    rows = [found[clip_id] for clip_id in clip_ids if clip_id in found]
    return {"sampled": pa.concat_tables([TABLES["sampled"].empty_table(), *rows])}
