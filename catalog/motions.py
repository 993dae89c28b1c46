"""Motions and features of chosen clips, read part by part.

So a catalog of any size passes through the memory of one batch.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from motionary.catalog.damage import named_if_damaged
from motionary.catalog.places import rows_by_clip
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.stages.columns import matrix
from motionary.pipeline.stages.motions import read_motion_rows

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


def stream_motions(catalog: Catalog, clip_ids: Collection[str], aligned: bool = False) -> Iterator[Motion]:
    """Read motions one after another.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : collection of str
    aligned : bool
        In the time of the cluster's reference instead of as captured.

    Yields
    ------
    Motion
        Called by its clip_id, in the order the clips are stored in.
    """
    clips = catalog.clips.to_arrow()
    place = {clip_id: row for row, clip_id in enumerate(clips["clip_id"].to_pylist())}
    rates = _aligned_rates(catalog) if aligned else {}
    for clip_id, rows in rows_by_clip(catalog, "aligned" if aligned else "frames", clip_ids):
        clip = clips.slice(place[clip_id], 1).to_pylist()[0]
        with named_if_damaged(f"clip {clip_id} of {catalog.store.url}"):
            yield read_motion_rows(clip, rows, rates.get(clip_id, clip["fps"]))


def stream_features(
    catalog: Catalog, clip_ids: Collection[str], merged: bool = False
) -> Iterator[tuple[str, FloatArray]]:
    """Read features one clip after another.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : collection of str
    merged : bool
        Those that are compared, low-motion frames merged (table `resampled`), instead of those at the common
        rate (table `features`).

    Yields
    ------
    clip_id : str
    values : array (frames, d) float32
        In the order the clips are stored in.
    """
    for clip_id, rows in rows_by_clip(catalog, "resampled" if merged else "features", clip_ids, ["feature"]):
        with named_if_damaged(f"clip {clip_id} of {catalog.store.url}"):
            yield clip_id, matrix(rows["feature"])


def _aligned_rates(catalog: Catalog) -> dict[str, float]:
    table = catalog.sql("select clip_id, frame_rate from alignments")
    return dict(zip(table["clip_id"].to_pylist(), table["frame_rate"].to_pylist(), strict=True))
