"""Which part file holds a clip, so that a question about some clips does not open those of all others.

The files of a table made batch by batch (frames, aligned, features, resampled) stand in the order of the
batches; table `inputs` tells the batch of every clip.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from motionary.catalog.damage import named_if_damaged
from motionary.pipeline.stages.columns import per_clip

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


def batch_of(catalog: Catalog) -> dict[str, int]:
    """Return the batch of every clip that the run found, readable or not."""

    def read() -> dict[str, int]:
        inputs = catalog.inputs.to_arrow()
        return dict(zip(inputs["clip_id"].to_pylist(), inputs["batch"].to_pylist(), strict=True))

    return catalog.keep("batch of every clip", read)


def rows_by_part(
    catalog: Catalog, table: str, clip_ids: Collection[str], columns: list[str] | None = None
) -> Iterator[pa.Table]:
    """Read the rows of chosen clips of a table made batch by batch, a part of the catalog at a time.

    Parameters
    ----------
    catalog : Catalog
    table : str
    clip_ids : collection of str
        Clips that the run found.
    columns : list of str, optional
        Beside `clip_id`; all by default.

    Raises
    ------
    CatalogError
        A file that holds some of them is damaged.
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
        yield part


def rows_by_clip(
    catalog: Catalog, table: str, clip_ids: Collection[str], columns: list[str] | None = None
) -> Iterator[tuple[str, pa.Table]]:
    """Read the rows of chosen clips one clip after another, in the order that they are stored in."""
    for part in rows_by_part(catalog, table, clip_ids, columns):
        yield from per_clip(part).items()
