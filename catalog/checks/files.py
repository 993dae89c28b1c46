"""Files: every one is there, as it was written, readable by anybody, and has its table's schema."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.parquet as pq

from motionary.catalog.checks.found import Found
from motionary.catalog.query import Catalog
from motionary.catalog.schema import PUBLISHED, SCHEMAS, VERSION


def manifest_is_complete(catalog: Catalog) -> Found:
    """Every published table has files, and every file has its facts."""
    snapshot = catalog.snapshot
    files = [file for names in snapshot.tables.values() for file in names]
    wrong = [f"table {name} is not listed" for name in PUBLISHED if not snapshot.tables.get(name)]
    wrong += [f"{name} is no table of this motionary" for name in snapshot.tables if name not in SCHEMAS]
    wrong += [f"no rows, bytes and checksum of {file}" for file in files if file not in snapshot.parts]
    wrong += [f"{file} has facts and is of no table" for file in snapshot.parts if file not in set(files)]
    return Found(f"snapshot {snapshot.snapshot_id}, {len(snapshot.tables)} tables, {len(files)} files", wrong)


def files_are_as_written(catalog: Catalog) -> Found:
    """Every file has the rows, bytes and checksum that the manifest states."""
    wrong = []
    for file, stated in catalog.snapshot.parts.items():
        try:
            there = catalog.store.facts(file)
        except FileNotFoundError:
            wrong.append(f"{file} is not there")
        except (OSError, pa.ArrowException) as error:
            wrong.append(f"{file} is no whole Parquet file: {error}")
        else:
            wrong += [
                f"{file} has {name} {getattr(there, name)}, the manifest states {getattr(stated, name)}"
                for name in ("rows", "bytes", "blake2b")
                if getattr(there, name) != getattr(stated, name)
            ]
    size = sum(facts.bytes for facts in catalog.snapshot.parts.values())
    return Found(f"{len(catalog.snapshot.parts)} files, {size / 2**20:.1f} MiB", wrong)


def parquet_reads(catalog: Catalog) -> Found:
    """Plain pyarrow reads every value of every file; one row group is in memory at a time."""
    filesystem, rows, wrong = catalog.store.filesystem, 0, []
    for files in catalog.snapshot.tables.values():
        for file in files:
            try:
                with filesystem.open(catalog.store.path(file), "rb") as opened:
                    for batch in pq.ParquetFile(opened).iter_batches():
                        batch.validate(full=True)
                        rows += len(batch)
            except (OSError, pa.ArrowException) as error:
                wrong.append(f"{file}: {error}")
    return Found(f"{rows} rows", wrong)


def schemas_are_the_tables(catalog: Catalog) -> Found:
    """Every file has its table's columns, in order, with their types and units.

    `clips` may have further columns, of text: labels that were supplied.
    """
    filesystem, wrong, count = catalog.store.filesystem, [], 0
    for table, files in catalog.snapshot.tables.items():
        for file in files:
            count += 1
            try:
                schema = pq.read_schema(catalog.store.path(file), filesystem=filesystem)
            except (OSError, pa.ArrowException) as error:
                wrong.append(f"{file}: {error}")
            else:
                wrong += [f"{file}: {problem}" for problem in _unlike(table, schema)]
    older = catalog.snapshot.schema_version != VERSION
    if wrong and older:
        wrong.append(
            f"tables have version {catalog.snapshot.schema_version}, here it is {VERSION}: run again"
        )
    return Found(f"{count} files, version {catalog.snapshot.schema_version} of the tables", wrong)


def _unlike(table: str, schema: pa.Schema) -> list[str]:
    if table not in SCHEMAS:
        return []  # which the manifest's check tells
    expected = SCHEMAS[table]
    further = schema.names[len(expected) :] if table == "clips" else []
    if schema.names != expected.names + further:
        return [f"columns {', '.join(schema.names)}; {table} has {', '.join(expected.names)}"]
    wrong = [f"label column {name} is no text" for name in further if schema.field(name).type != pa.string()]
    for field in expected:
        there = schema.field(field.name)
        if there.type != field.type or there.nullable != field.nullable:
            wrong.append(f"column {field.name} is {_described(there)}, not {_described(field)}")
        elif not _said(there, b"meaning") or _said(there, b"unit") != _said(field, b"unit"):
            wrong.append(f"column {field.name} lacks its unit or meaning")
    return wrong


def _said(field: pa.Field, key: bytes) -> bytes | None:
    return (field.metadata or {}).get(key)


def _described(field: pa.Field) -> str:
    return f"{field.type}{', nullable' if field.nullable else ''}"
