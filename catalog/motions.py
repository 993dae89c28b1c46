"""Motions and features of chosen clips, read part by part.

So a catalog of any size passes through the memory of one batch.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from motionary.catalog.damage import named_if_damaged
from motionary.catalog.places import batch_of
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.stages.motions import read_motion_rows

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


def rows_by_clip(
    catalog: Catalog, table: str, clip_ids: Collection[str], columns: list[str] | None = None
) -> Iterator[tuple[str, pa.Table]]:
    """Read the rows of chosen clips, a part of the catalog at a time, in the order they are stored in.

    Parameters
    ----------
    catalog : Catalog
    table : str
        One that has a part a batch: frames, aligned, features or resampled.
    clip_ids : collection of str
    columns : list of str, optional
        Beside `clip_id`; all by default.
    """
    batch, files, store = batch_of(catalog), catalog.files(table), catalog.store
    wanted: dict[str, list[str]] = {}
    for clip_id in sorted(clip_ids, key=lambda one: (batch[one], one)):
        wanted.setdefault(files[batch[clip_id]], []).append(clip_id)
    read = None if columns is None else ["clip_id", *columns]
    for file, clips in wanted.items():
        with named_if_damaged(store.full_path(file)):
            part = pq.read_table(
                store.path(file),
                filesystem=store.filesystem,
                columns=read,
                filters=pc.field("clip_id").isin(clips),
            )
        yield from per_clip(part).items()


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
    table = catalog.alignments.to_arrow()
    return dict(zip(table["clip_id"].to_pylist(), table["frame_rate"].to_pylist(), strict=True))
