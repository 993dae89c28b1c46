"""SQL over a catalog's tables: one DuckDB connection for as long as the catalog is open.

A view is made when a query first names its table: the files of a table of many parts take longer to look at
than most questions take to answer.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import pyarrow as pa
from fsspec.implementations.local import LocalFileSystem

from motionary.catalog.damage import damaged_file
from motionary.catalog.errors import CatalogError
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store

if TYPE_CHECKING:
    import duckdb

    from motionary.catalog.query import Catalog

TAKES = "takes"
"""The view of every clip with its cluster: `clips`, but for their skeletons, joined with `clusters`."""

Parameters = Sequence[object] | Mapping[str, object]

_ONLY_READ = "a catalog is only read: give one statement that selects"

_JOINED = {TAKES: ("clips", "clusters")}


class SqlSession:
    """The tables of one snapshot as views that DuckDB can be asked about, and nothing else.

    Parameters
    ----------
    store : Store
    snapshot : Snapshot
    """

    def __init__(self, store: Store, snapshot: Snapshot) -> None:
        import duckdb  # a part of a second, which only those who ask in SQL should wait for

        self._store, self._snapshot = store, snapshot
        self._made: set[str] = set()
        self._lock = threading.Lock()
        self._connection = duckdb.connect()
        if not isinstance(store.filesystem, LocalFileSystem):
            self._connection.register_filesystem(store.filesystem)
        self._connection.execute("set parquet_metadata_cache = true")  # files never change
        self._connection.execute("set temp_directory = ''")  # which a query may read and write as well
        # A query reads this catalog's files and nothing else, writes nowhere and loads nothing.
        home = _text(store.full_path("").rstrip("/") + "/")
        self._connection.execute(f"set allowed_directories = [{home}]")
        self._connection.execute("set enable_external_access = false")
        self._connection.execute("set lock_configuration = true")

    def answer(self, query: str, parameters: Parameters | None = None) -> pa.Table:
        """Answer one statement that selects; safe from any thread.

        Raises
        ------
        CatalogError
            The query is not valid, with DuckDB's message; or a file of the catalog is damaged.
        """
        import duckdb

        named = _named_in(query)
        asked = {one: files for one, files in self._snapshot.tables.items() if one in _tables_of(named)}
        with self._asking(asked) as cursor:
            statements = cursor.extract_statements(query)
            if [one.type for one in statements] != [duckdb.StatementType.SELECT]:
                raise CatalogError(_ONLY_READ)
            self._make_views(named)
            query = statements[0].query.rstrip().removesuffix(";")
            try:  # DuckDB takes `with x as (copy ... to ...)` for a selection, but not within another
                cursor.execute(f"explain from (\n{query}\n)", parameters)
            except duckdb.Error:
                cursor.execute(f"explain {query}", parameters)  # what is wrong with it, if anything is
                raise CatalogError(_ONLY_READ) from None
            return cursor.sql(query, params=parameters).to_arrow_table()

    def over(
        self, table: str, files: Sequence[str], query: str, parameters: Mapping[str, object]
    ) -> pa.Table:
        """Ask about some part files of a table alone; in the query `{files}` stands for them.

        Raises
        ------
        CatalogError
            One of them is damaged or gone.
        """
        listed = [self._store.full_path(file) for file in files]
        with self._asking({table: files}) as cursor:
            reading = "read_parquet($files, hive_partitioning = false)"
            return cursor.sql(
                query.format(files=reading), params={"files": listed, **parameters}
            ).to_arrow_table()

    @contextmanager
    def _asking(self, tables: Mapping[str, Sequence[str]]) -> Iterator[duckdb.DuckDBPyConnection]:
        """Give a cursor, and turn what is raised into an error that names these tables' damaged file."""
        import duckdb

        try:
            with self._connection.cursor() as cursor:
                yield cursor
        # RuntimeError: what DuckDB says of a damaged file can be no text.
        except (duckdb.Error, UnicodeDecodeError, RuntimeError) as error:
            wrong = (duckdb.ParserException, duckdb.CatalogException)  # the query is, and no file
            asked = replace(self._snapshot, tables=dict(tables))
            damage = None if isinstance(error, wrong) else damaged_file(self._store, asked, PUBLISHED)
            why = " ".join(str(error).partition("\n\nLINE ")[0].split())
            raise CatalogError(damage or f"the query cannot be answered: {why}") from error

    def _make_views(self, names: set[str]) -> None:
        tables = _tables_of(names)
        with self._lock:
            for name in PUBLISHED:
                # An older motionary may have published the catalog without some.
                if name in tables - self._made and name in self._snapshot.tables:
                    self._connection.execute(f'create view "{name}" as {self._reading(name)}')
                    self._made.add(name)
            if TAKES in names - self._made:
                self._connection.execute(f"create view {TAKES} as {self._joining()}")
                self._made.add(TAKES)

    def _reading(self, table: str) -> str:
        listed = ", ".join(_text(self._store.full_path(file)) for file in self._snapshot.tables[table])
        # Parts of `clips` alone may differ in columns, those of labels.
        by_name = "true" if table == "clips" else "false"
        return f"from read_parquet([{listed}], union_by_name = {by_name}, hive_partitioning = false)"

    def _joining(self) -> str:
        """Select clips with their clusters; skeletons, and labels called as a column there, are left out."""
        taken = {"skeleton", *SCHEMAS["clusters"].names} - {"clip_id"}
        columns = self._connection.table("clips").columns
        own = ", ".join(quoted(one) for one in columns if one.lower() not in taken)  # SQL knows no capitals
        return f"select * from (select {own} from clips) join clusters using (clip_id)"


def session_of(catalog: Catalog) -> SqlSession:
    """Return the session of an opened catalog, which lasts until it is closed and the last answer given."""
    return catalog.keep("sql", lambda: SqlSession(catalog.store, catalog.snapshot))


def _named_in(query: str) -> set[str]:
    """Find the views whose names a query holds, as tables or not; all of them where it holds none."""
    known = {*PUBLISHED, *_JOINED}
    return known & set(re.findall(r"\w+", query.lower())) or known


def _tables_of(names: set[str]) -> set[str]:
    return {table for name in names for table in _JOINED.get(name, (name,))}


def _text(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def quoted(name: str) -> str:
    """Write a name as SQL reads it, whatever it holds."""
    return '"' + name.replace('"', '""') + '"'
