"""Which part file holds a clip, so that a question about one clip does not open those of all others.

The files of a table made batch by batch stand in the order of the batches; table `inputs` tells the batch of
every clip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.damage import named_if_damaged

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


def batch_of(catalog: Catalog) -> dict[str, int]:
    """Return the batch of every clip that the run found, readable or not."""

    def read() -> dict[str, int]:
        inputs = catalog.inputs.to_arrow()
        return dict(zip(inputs["clip_id"].to_pylist(), inputs["batch"].to_pylist(), strict=True))

    return catalog.keep("batch of every clip", read)
