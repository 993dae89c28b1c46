"""The tables of a catalog: those that the pipeline's stages make, and the runs that made them.

`VERSION` rises when a table changes in a way that an older reader would misread.
"""

from __future__ import annotations

import pyarrow as pa

from motionary.pipeline.tables import TABLES, table_field

VERSION = 1

SCHEMAS: dict[str, pa.Schema] = {
    **TABLES,
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
            table_field(
                "stage_seconds", pa.map_(pa.string(), pa.float64()), "work, summed over workers", "s"
            ),
        ]
    ),
}

PUBLISHED = tuple(name for name in SCHEMAS if name not in ("ingested", "members", "reference_features"))
"""The tables that a snapshot lists; the others pass from stage to stage."""


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
