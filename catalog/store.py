"""Parts on disk: Parquet files that are written once and never changed.

A part is one table's share of a stage's result, named by the *key* of that result: a digest of everything
that went into it. The same inputs always give the same file, so a part that exists need not be computed
again, and two snapshots that agree share their files.

    CATALOG/tables/<table>/<key>.parquet

Every file appears under its final name whole or not at all.
"""

from __future__ import annotations

import hashlib
import os
import posixpath
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeAlias
from uuid import uuid4

import fsspec
import pyarrow as pa
import pyarrow.parquet as pq
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.errors import CatalogError
from motionary.catalog.schema import SCHEMAS, conform
from motionary.pipeline.layout import digest_of_settings

Content: TypeAlias = "bytes | pa.Buffer"


@dataclass(frozen=True)
class PartFacts:
    """What a file is known by, so that a damaged or exchanged one is found out.

    Parameters
    ----------
    rows : int
    bytes : int
        Its length.
    blake2b : str
        128-bit digest of its bytes, hexadecimal.
    """

    rows: int
    bytes: int
    blake2b: str


@dataclass(frozen=True)
class Store:
    """The files of one catalog, local or behind any fsspec URL.

    Parameters
    ----------
    url : str
        Folder of the catalog.
    """

    url: str
    _home: str = field(init=False, repr=False, compare=False, default="")

    def __post_init__(self) -> None:
        if not self._is_elsewhere:  # where it lies does not change with the working directory
            object.__setattr__(self, "_home", LocalFileSystem._strip_protocol(self.url))

    @property
    def _is_elsewhere(self) -> bool:
        return "://" in self.url  # fsspec would take `::` in a folder's name for a chain of URLs

    @property
    def filesystem(self) -> Any:
        """The fsspec file system that the URL names.

        Raises
        ------
        CatalogError
            What reaches it is not installed, or there is no such protocol.
        """
        return self._located()[0]

    def path(self, *names: str) -> str:
        """Join names to the catalog's folder, as a path of the file system."""
        return posixpath.join(self._located()[1], *names)

    def _located(self) -> tuple[Any, str]:
        if not self._is_elsewhere:
            return LocalFileSystem(), self._home
        try:
            # Others write there too: a listing that was remembered would hide what they did.
            return fsspec.core.url_to_fs(self.url, use_listings_cache=False)
        except (ImportError, ValueError) as error:
            hint = "; for s3:// install motionary[s3]" if self.url.startswith("s3") else ""
            raise CatalogError(f"{self.url} cannot be reached: {error}{hint}") from None

    def full_path(self, name: str) -> str:
        """Name a file of the catalog so that other tools find it: with its protocol where it is not local."""
        return str(self.filesystem.unstrip_protocol(self.path(name))).removeprefix("file://")

    @staticmethod
    def part_name(table: str, key: str) -> str:
        """Return where a part lies inside the catalog."""
        return f"tables/{table}/{key}.parquet"

    def save(self, key: str, tables: Mapping[str, pa.Table]) -> dict[str, PartFacts]:
        """Write a result's parts, each with its table's schema; a part is on disk when this returns.

        Returns
        -------
        dict of str to PartFacts
            By table.

        Raises
        ------
        ValueError
            A table does not fit its schema.
        """
        facts = {}
        for name, table in tables.items():
            content = _parquet(conform(name, table))
            self.write(self.part_name(name, key), content)
            facts[name] = _facts(content, table.num_rows)
        return facts

    def save_whole(self, name: str, table: pa.Table) -> tuple[str, PartFacts]:
        """Write a table that is no stage's result as one part, named by its content.

        Returns
        -------
        file : str
            Where it lies inside the catalog.
        facts : PartFacts
        """
        key = digest_of_settings([[str(value) for value in row.values()] for row in table.to_pylist()])
        file = self.part_name(name, key)
        # A snapshot may name it: it is not written again, perhaps by another version of Arrow.
        with suppress(FileNotFoundError, CatalogError):
            if self.read([file]).equals(conform(name, table)):
                return file, self.facts(file)
        return file, self.save(key, {name: table})[name]

    def facts(self, file: str) -> PartFacts:
        """Read a part that is there and tell what it is known by.

        Raises
        ------
        FileNotFoundError
            There is none.
        ValueError
            It is not a whole Parquet file.
        """
        content = self.read_bytes(file)
        return _facts(content, pq.read_metadata(pa.BufferReader(content)).num_rows)

    def stored(self, key: str, tables: Iterable[str]) -> dict[str, PartFacts] | None:
        """Return what a result's parts are known by; None where one is missing or no whole Parquet file."""
        try:
            return {table: self.facts(self.part_name(table, key)) for table in tables}
        except (OSError, ValueError):  # pyarrow says so of a damaged file
            return None

    def load(self, key: str, table: str, columns: Sequence[str] | None = None) -> pa.Table:
        """Read one part, or some columns of it with their text as dictionaries, which take less memory.

        On one thread: tasks share the cores among them, and a part is soon read.
        """
        texts = [one for one in columns or () if pa.types.is_string(SCHEMAS[table].field(one).type)]
        with self._opened(self.part_name(table, key), self.filesystem, texts) as part:
            return part.read(columns, use_threads=False)

    def read(self, files: Iterable[str]) -> pa.Table:
        """Read parts of one table, joined in the order given; a column one part lacks is null there.

        Raises
        ------
        CatalogError
            A part is damaged; the message names it and says what to do.
        FileNotFoundError
            A part is gone.
        """
        filesystem = self.filesystem
        return pa.concat_tables(
            [self._read_part(file, filesystem) for file in files], promote_options="default"
        )

    def _read_part(self, file: str, filesystem: Any) -> pa.Table:
        with self._opened(file, filesystem) as part:
            return part.read()

    @contextmanager
    def _opened(
        self, file: str, filesystem: Any, dictionaries: Sequence[str] = ()
    ) -> Iterator[pq.ParquetFile]:
        """Open a part; of one file this takes a third of what `pq.read_table` does, made for many."""
        try:
            path = self.path(file)
            with pq.ParquetFile(path, filesystem=filesystem, read_dictionary=dictionaries) as part:
                yield part
        except FileNotFoundError:
            raise
        except (pa.ArrowException, OSError) as error:
            why = " ".join(str(error).split())[:300]
            raise CatalogError(
                f"{self.full_path(file)} is damaged ({why}); remove that file and run again, which computes "
                "it anew, or open an earlier snapshot; `motionary verify` finds what else is damaged"
            ) from error

    def rows(self, files: Iterable[str]) -> int:
        """Count the rows of parts without reading them."""
        filesystem = self.filesystem
        return sum(pq.read_metadata(self.path(file), filesystem=filesystem).num_rows for file in files)

    def write(self, name: str, content: Content) -> None:
        """Put a file in place in one step: never half of it, whatever happens meanwhile."""
        filesystem, path = self.filesystem, self.path(name)
        if not isinstance(filesystem, LocalFileSystem):
            filesystem.makedirs(posixpath.dirname(path), exist_ok=True)
            filesystem.pipe_file(path, bytes(content))
            return
        temporary = Path(f"{path}.{uuid4().hex}.tmp")
        try:
            _make_folder(Path(path).parent)
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
            _sync_folder(Path(path).parent)
        except OSError as error:
            if error.errno is not None and error.filename is None:  # a full disk names no file
                error.filename = path
            raise
        finally:
            temporary.unlink(missing_ok=True)

    def create(self, name: str, content: bytes) -> None:
        """Write a file that must not be there yet; on disk one writer at a time is presumed.

        Raises
        ------
        FileExistsError
            It is there, with other content.
        """
        filesystem, path = self.filesystem, self.path(name)
        if isinstance(filesystem, LocalFileSystem):
            if filesystem.exists(path):
                raise FileExistsError(path)
            self.write(name, content)
            return
        try:
            filesystem.makedirs(posixpath.dirname(path), exist_ok=True)
            filesystem.pipe_file(path, content, mode="create")
        except FileExistsError:
            # A request that was sent again, its answer being lost, finds what it wrote itself.
            if self.read_bytes(name) != content:
                raise

    def version(self, name: str) -> str | None:
        """Return what a file's state is known by where writes can depend on it (S3); else None."""
        if not _writes_on_condition(self.filesystem):
            return None
        try:
            return self.filesystem.info(self.path(name), refresh=True)["ETag"]
        except FileNotFoundError:
            return None

    def replace(self, name: str, content: bytes, version: str | None) -> None:
        """Replace a file, where writes can depend on it only if it still has that version (None: is absent).

        Raises
        ------
        FileExistsError
            Somebody else has written it meanwhile.
        """
        filesystem = self.filesystem
        if not _writes_on_condition(filesystem):
            self.write(name, content)
            return
        condition = {"IfMatch": version} if version else {"IfNoneMatch": "*"}
        try:
            filesystem.pipe_file(self.path(name), content, **condition)
        except OSError as error:  # s3fs has no error of its own for a condition that does not hold
            found = self.version(name)
            if found == version:
                raise
            if found is None or self.read_bytes(name) != content:
                raise FileExistsError(name) from error

    def rename(self, name: str, other: str) -> None:
        """Give a file on disk another name, in one step."""
        Path(self.path(name)).replace(self.path(other))

    def settle(self, folder: str) -> None:
        """Make what was renamed and removed in a folder survive a power cut."""
        if isinstance(self.filesystem, LocalFileSystem):
            _sync_folder(Path(self.path(folder)))

    def delete(self, name: str) -> None:
        """Remove a file, if it is there."""
        with suppress(FileNotFoundError):
            self.filesystem.rm_file(self.path(name))

    def names(self, folder: str) -> list[str]:
        """List the files of a folder; none where there is no folder."""
        filesystem, path = self.filesystem, self.path(folder)
        return list(filesystem.ls(path, detail=False)) if filesystem.exists(path) else []

    def sizes(self, folder: str) -> dict[str, int]:
        """List all files below a folder, relative to the catalog, with their lengths."""
        home = len(self.path(""))
        found = self.filesystem.find(self.path(folder), detail=True)
        return {path[home:]: info["size"] for path, info in sorted(found.items())}

    def modified(self, name: str) -> datetime:
        """Return when a file was written, UTC."""
        return self.filesystem.modified(self.path(name)).astimezone(UTC)

    def read_bytes(self, name: str) -> bytes:
        """Read a small file.

        Raises
        ------
        FileNotFoundError
            There is none.
        """
        return self.filesystem.cat_file(self.path(name))


def _parquet(table: pa.Table) -> pa.Buffer:
    """Write a table as a Parquet file; numbers that hardly repeat take two thirds without a dictionary."""
    repeating = [
        one.name
        for one in table.schema
        if not pa.types.is_nested(one.type) and not pa.types.is_floating(one.type)
    ]
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd", use_dictionary=repeating)
    return sink.getvalue()


def _writes_on_condition(filesystem: Any) -> bool:
    return "s3" in filesystem.protocol


def _facts(content: Content, rows: int) -> PartFacts:
    return PartFacts(rows, len(content), hashlib.blake2b(content, digest_size=16).hexdigest())


def _make_folder(folder: Path) -> None:
    """Make a folder that survives a power cut as what is written in it does."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for made in reversed(missing):
        _sync_folder(made.parent)


def _sync_folder(folder: Path) -> None:
    """Make a rename in a folder survive a power cut (POSIX; elsewhere a folder cannot be opened)."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
