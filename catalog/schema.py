"""The tables of a catalog: those that the pipeline's stages make, and the runs that made them.

`VERSION` rises when a table changes in a way that an older reader would misread.
"""

from __future__ import annotations

import pyarrow as pa

from motionary.pipeline.tables import TABLES, table_field

VERSION = 1

_FILE = pa.struct(
    [
        pa.field("path", pa.string()),
        pa.field("size", pa.int64()),
        pa.field("mtime_ns", pa.int64()),
        pa.field("ctime_ns", pa.int64()),
        pa.field("inode", pa.int64()),
    ]
)

SCHEMAS: dict[str, pa.Schema] = {
    **TABLES,
    "inputs": pa.schema(
        [
            table_field("clip_id", pa.string(), "path of the clip in the library, with /"),
            table_field("root", pa.string(), "folder of the library"),
            table_field("path", pa.string(), "path in that folder"),
            table_field("files", pa.list_(_FILE), "every file it is read from, as it was when it was read"),
            table_field("digest", pa.string(), "BLAKE2b of their bytes; empty where they cannot be read"),
            table_field("key", pa.string(), "digest of the bytes and of all that reading them depends on"),
            table_field("batch", pa.int32(), "clips that are stored together, from 0"),
            table_field("side", pa.int32(), "clips that are compared together, the side of a tile, from 0"),
        ]
    ),
    "runs": pa.schema(
        [
            table_field("run_id", pa.string(), "start time and snapshot"),
            table_field("started_at", pa.timestamp("us", tz="UTC"), "when"),
            table_field("finished_at", pa.timestamp("us", tz="UTC"), "when"),
            table_field("version", pa.string(), "of motionary"),
            table_field("library", pa.list_(pa.string()), "folders read"),
            table_field("settings", pa.string(), "every stage's settings, JSON"),
            table_field("clips", pa.int32(), "clips in the catalog"),
            table_field("quarantined", pa.int32(), "files that could not be read"),
            table_field("clusters", pa.int32(), "clusters published"),
            table_field("clips_read", pa.int32(), "clips that were read"),
            table_field("pairs_computed", pa.int64(), "pairs that were compared"),
            table_field(
                "stage_seconds", pa.map_(pa.string(), pa.float64()), "work, summed over workers", "s"
            ),
            table_field("side", pa.int32(), "clips a side of a tile, about", nullable=True),
        ]
    ),
}

_INTERNAL = (
    "ingested", "groups", "members", "represented", "centres", "reference_features",
    "sampled", "standing", "assigned", "refined", "regrouped",
)  # fmt: skip

PUBLISHED = tuple(name for name in SCHEMAS if name not in _INTERNAL)
"""The tables that a catalog shows; the others pass from stage to stage."""


def conform(name: str, table: pa.Table) -> pa.Table:
    """Give a table its schema: column order, types and units.

    Parameters
    ----------
    name : str
        One of `SCHEMAS`.
    table : pyarrow.Table
        With the schema's columns; `clips` may carry further label columns, as text.

    Raises
    ------
    ValueError
        A column is missing or one too many.
    """
    schema = SCHEMAS[name]
    extra = [column for column in table.column_names if column not in schema.names]
    missing = [column for column in schema.names if column not in table.column_names]
    if missing or (extra and name != "clips"):
        raise ValueError(f"table {name!r}: missing columns {missing}, columns it does not have {extra}")
    for column in extra:
        schema = schema.append(table_field(column, pa.string(), "supplied label", nullable=True))
    schema = schema.with_metadata({"motionary.table": name, "motionary.schema_version": str(VERSION)})
    return table.select(schema.names).cast(schema)
