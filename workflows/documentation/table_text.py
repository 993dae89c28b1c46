"""The tables of a catalog, from their schemas: columns, types, units, meaning."""

from __future__ import annotations

import pyarrow as pa

from motionary.catalog.schema import PUBLISHED, SCHEMAS, VERSION
from motionary.workflows.documentation.markdown import code, plain, table


def tables_text() -> str:
    """Write a section a table."""
    head = f"Version {VERSION} of the schemas. Where a column says *may be null*, a row may do without it."
    return "\n\n".join([head, *(_section(name) for name in PUBLISHED)])


def _section(name: str) -> str:
    rows = [_row(field) for field in SCHEMAS[name]]
    return f"(table-{name})=\n\n## {name}\n\n{table(['column', 'type', 'unit', 'meaning'], rows)}"


def _row(field: pa.Field) -> list[str]:
    told = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
    meaning = plain(told["meaning"]) + ("; *may be null*" if field.nullable else "")
    return [code(field.name), _type(field.type), plain(told.get("unit", "")), meaning]


def _type(type_: pa.DataType) -> str:
    """Name a type as Arrow does, and the fields of a struct without what is said of their nulls."""
    if pa.types.is_struct(type_):
        return "struct of " + ", ".join(f"{code(field.name)} {_type(field.type)}" for field in type_)
    if pa.types.is_fixed_size_list(type_):
        return f"list of {type_.list_size} {_type(type_.value_type)}"
    if pa.types.is_map(type_):
        return f"map of {_type(type_.key_type)} to {_type(type_.item_type)}"
    if pa.types.is_list(type_):
        return f"list of {_type(type_.value_type)}"
    return plain(str(type_))
