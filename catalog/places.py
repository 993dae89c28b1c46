"""Which part files hold a clip, so that a question about one clip does not open those of all others.

The files of a table made batch by batch stand in the order of the batches; those of `pairs` in the order of
the tiles, every batch with itself and all later ones: see `Earlier.tile` of `motionary.pipeline.layout`.
Table `inputs` tells the batch of every clip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.damage import named_if_damaged
from motionary.pipeline.layout import Earlier

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog


def clip_rows(catalog: Catalog, table: str, clip_id: str) -> pa.Table:
    """Read a clip's rows of a table made batch by batch: `frames`, `features`, `resampled`.

    Raises
    ------
    KeyError
        The run found no such clip.
    CatalogError
        The file that holds them is damaged.
    """
    file = catalog.files(table)[batch_of(catalog)[clip_id]]
    with named_if_damaged(f"a file of table {table} of {catalog.store.url}"):
        rows = catalog.store.read([file])
        return rows.filter(pc.equal(rows["clip_id"], clip_id))


def pair_rows(catalog: Catalog, clip_id: str, columns: list[str]) -> pa.Table:
    """Read some columns of a clip's pairs with all other clips.

    Raises
    ------
    KeyError
        The run found no such clip.
    CatalogError
        A file that holds some of them is damaged.
    """
    import pyarrow.parquet as pq

    files = pair_files(catalog, batch_of(catalog)[clip_id])
    store, filesystem = catalog.store, catalog.store.filesystem
    with named_if_damaged(f"a file of table pairs of {store.url}"):
        found = []
        for file in files:
            rows = pq.read_table(
                store.path(file), columns=["clip_a", "clip_b", *columns], filesystem=filesystem
            )
            asked = pc.or_(pc.equal(rows["clip_a"], clip_id), pc.equal(rows["clip_b"], clip_id))
            found.append(rows.filter(asked))
        return pa.concat_tables(found)


def pair_files(catalog: Catalog, batch: int) -> list[str]:
    """List the files of the tiles that compare a batch with itself and with every other."""
    batches = catalog.keep("batches", lambda: max(batch_of(catalog).values()) + 1)
    layout = Earlier(batches=[{}] * batches)
    files = catalog.files("pairs")
    return [files[layout.tile(min(batch, other), max(batch, other))] for other in range(batches)]


def batch_of(catalog: Catalog) -> dict[str, int]:
    """Return the batch of every clip that the run found, readable or not."""

    def read() -> dict[str, int]:
        inputs = catalog.inputs.to_arrow()
        return dict(zip(inputs["clip_id"].to_pylist(), inputs["batch"].to_pylist(), strict=True))

    return catalog.keep("batch of every clip", read)
