"""Parts on disk: Parquet files that are written once and never changed.

A part is one table's share of a stage's result, named by the *key* of that result: a digest of everything
that went into it. The same inputs always give the same file, so a part that exists need not be computed
again, and two snapshots that agree share their files.

    CATALOG/tables/<table>/<key>.parquet

Every file appears under its final name whole or not at all.
"""

from __future__ import annotations

import os
import posixpath
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

import fsspec
import pyarrow as pa
import pyarrow.parquet as pq
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.schema import conform


@dataclass(frozen=True)
class Store:
    """The files of one catalog, local or behind any fsspec URL.

    Parameters
    ----------
    url : str
        Folder of the catalog.
    """

    url: str

    @property
    def filesystem(self) -> Any:
        """The fsspec file system that the URL names."""
        return fsspec.core.url_to_fs(self.url)[0]

    def path(self, *names: str) -> str:
        """Join names to the catalog's folder, as a path of the file system."""
        return posixpath.join(fsspec.core.url_to_fs(self.url)[1], *names)

    def full_path(self, name: str) -> str:
        """Name a file of the catalog so that other tools find it: with its protocol where it is not local."""
        return str(self.filesystem.unstrip_protocol(self.path(name))).removeprefix("file://")

    @staticmethod
    def part_name(table: str, key: str) -> str:
        """Return where a part lies inside the catalog."""
        return f"tables/{table}/{key}.parquet"

    def has(self, key: str, tables: Iterable[str]) -> bool:
        """Say whether every one of a result's parts is there."""
        filesystem = self.filesystem
        return all(filesystem.exists(self.path(self.part_name(table, key))) for table in tables)

    def save(self, key: str, tables: Mapping[str, pa.Table]) -> None:
        """Write a result's parts, each with its table's schema.

        Raises
        ------
        ValueError
            A table does not fit its schema.
        """
        for name, table in tables.items():
            sink = pa.BufferOutputStream()
            pq.write_table(conform(name, table), sink, compression="zstd")
            self.write(self.part_name(name, key), sink.getvalue().to_pybytes())

    def load(self, key: str, table: str) -> pa.Table:
        """Read one part."""
        return self.read([self.part_name(table, key)])

    def read(self, files: Iterable[str]) -> pa.Table:
        """Read parts of one table, joined in the order given; a column one part lacks is null there."""
        filesystem = self.filesystem
        tables = [pq.read_table(self.path(file), filesystem=filesystem) for file in files]
        return pa.concat_tables(tables, promote_options="default")

    def rows(self, files: Iterable[str]) -> int:
        """Count the rows of parts without reading them."""
        filesystem = self.filesystem
        return sum(pq.read_metadata(self.path(file), filesystem=filesystem).num_rows for file in files)

    def write(self, name: str, content: bytes) -> None:
        """Put a file in place in one step: never half of it, whatever happens meanwhile."""
        filesystem, path = self.filesystem, self.path(name)
        filesystem.makedirs(posixpath.dirname(path), exist_ok=True)
        if not isinstance(filesystem, LocalFileSystem):
            filesystem.pipe_file(path, content)
            return
        temporary = Path(f"{path}.{uuid4().hex}.tmp")
        try:
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
        _sync_folder(Path(path).parent)

    def names(self, folder: str) -> list[str]:
        """List the files of a folder; none where there is no folder."""
        filesystem, path = self.filesystem, self.path(folder)
        return list(filesystem.ls(path, detail=False)) if filesystem.exists(path) else []

    def read_bytes(self, name: str) -> bytes:
        """Read a small file.

        Raises
        ------
        FileNotFoundError
            There is none.
        """
        return self.filesystem.cat_file(self.path(name))


def _sync_folder(folder: Path) -> None:
    """Make a rename in a folder survive a power cut (POSIX; elsewhere a folder cannot be opened)."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
