"""A clip's distances to all others, from the tiles that hold them.

The files of table `pairs` stand in the order of the tiles: each batch with itself and all later ones, see
`Earlier.tile` of `motionary.pipeline.layout`. So a clip's pairs lie in as many files as there are batches,
and those of all clips in half that number squared. DuckDB opens hundreds of small files faster than Arrow.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import replace

import duckdb
import pyarrow as pa
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.damage import damaged_file
from motionary.catalog.errors import CatalogError
from motionary.catalog.places import batch_of
from motionary.catalog.query import Catalog
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store
from motionary.pipeline.layout import Earlier

_OWN = """
    select if(clip_a = $clip, clip_b, clip_a) as other, {columns}
    from read_parquet($files) where clip_a = $clip or clip_b = $clip
"""


def own_pairs(catalog: Catalog, clip_id: str, columns: Sequence[str]) -> pa.Table:
    """Read distances of a clip to all others.

    Parameters
    ----------
    catalog : Catalog
    clip_id : str
        One that could be read.
    columns : sequence of str
        Of table `pairs`.

    Returns
    -------
    pyarrow.Table
        `other`, the other clip, and the columns; in the order of the files.

    Raises
    ------
    CatalogError
        A file is damaged or gone.
    """
    files = _files(catalog, batch_of(catalog)[clip_id])
    return _reader(catalog).read(_OWN.format(columns=", ".join(columns)), files, {"clip": clip_id})


def pairs_with_batch(catalog: Catalog, batch: int, columns: Sequence[str]) -> pa.Table:
    """Read the pairs of which a clip of a batch is one: clip_a, clip_b and some columns.

    Raises
    ------
    CatalogError
        A file is damaged or gone.
    """
    query = f"select clip_a, clip_b, {', '.join(columns)} from read_parquet($files)"
    return _reader(catalog).read(query, _files(catalog, batch), {})


def batch_count(catalog: Catalog) -> int:
    """Return how many batches the clips are stored in."""
    return max(batch_of(catalog).values(), default=-1) + 1


class _Reader:
    """A connection that remembers where in each file its columns lie; files never change."""

    def __init__(self, store: Store, snapshot: Snapshot) -> None:
        self._store, self._snapshot = store, snapshot
        self._lock = threading.Lock()
        self._connection = duckdb.connect()
        self._connection.execute("set parquet_metadata_cache = true")
        if not isinstance(store.filesystem, LocalFileSystem):
            self._connection.register_filesystem(store.filesystem)

    def read(self, query: str, files: Sequence[str], parameters: dict[str, object]) -> pa.Table:
        listed = [self._store.full_path(file) for file in files]
        try:
            with self._lock:
                asked = self._connection.sql(query, params={"files": listed, **parameters})
                return asked.to_arrow_table()
        except (duckdb.Error, UnicodeDecodeError, RuntimeError) as error:
            asked_of = replace(self._snapshot, tables={"pairs": files})
            damage = damaged_file(self._store, asked_of, ["pairs"])
            raise CatalogError(damage or f"the pairs cannot be read: {error}") from error


def _reader(catalog: Catalog) -> _Reader:
    return catalog.keep("pairs", lambda: _Reader(catalog.store, catalog.snapshot))


def _files(catalog: Catalog, batch: int) -> list[str]:
    batches = batch_count(catalog)
    layout, files = Earlier(batches=[{}] * batches), catalog.files("pairs")
    return [files[layout.tile(min(batch, other), max(batch, other))] for other in range(batches)]
