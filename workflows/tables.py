"""Tables for people and for programs: the `--format` of every command that answers with one."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Mapping, Sequence
from typing import Literal

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from motionary.workflows.csv_cells import UNSAFE, csv_safe

Format = Literal["table", "json", "csv", "parquet"]

_WIDE = 10_000  # columns of a table that goes to a file or a pipe: no name is folded there
_TEXTS = (pa.types.is_string, pa.types.is_large_string, pa.types.is_binary, pa.types.is_large_binary)


def output_console() -> Console:
    """Return a console on stdout that does not cut lines where nobody looks at them."""
    fits = sys.stdout.isatty() or "COLUMNS" in os.environ
    return Console(width=None if fits else _WIDE, highlight=False, soft_wrap=False)


def write_table(table: pa.Table, format_: Format) -> None:
    """Write an Arrow table to stdout.

    Parameters
    ----------
    table : pyarrow.Table
        The answer.
    format_ : {"table", "json", "csv", "parquet"}
        json is one list of objects; csv writes nested values as JSON text, and text such that no spreadsheet
        takes it for a formula (`csv_plain` undoes that); table shortens nested values.
    """
    sink = sys.stdout.buffer
    if format_ == "json":
        write_json(table.to_pylist())
    elif format_ == "csv":
        pa_csv.write_csv(_csv_cells(table), sink)
    elif format_ == "parquet":
        pq.write_table(table, sink, compression="zstd")
    else:
        columns = [[_shown(value) for value in column.to_pylist()] for column in table.columns]
        output_console().print(text_table(table.column_names, list(zip(*columns, strict=True))))


def write_json(value: object) -> None:
    """Write an answer that is no table to stdout; numbers that are none become null, as JSON has no other."""
    text = json.dumps(_finite(value), default=str, ensure_ascii=False, indent=1, allow_nan=False)
    sys.stdout.buffer.write(text.encode() + b"\n")


def text_table(
    columns: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None
) -> RenderableType:
    """Lay text out in columns; those that hold only numbers stand to the right."""
    made = Table(box=None, pad_edge=False, header_style="bold")
    for index, name in enumerate(columns):
        numeric = bool(rows) and all(_is_number(row[index]) for row in rows)
        made.add_column(Text(name), justify="right" if numeric else "left", overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))  # not markup: a name may hold brackets
    # Above the table and not as its title, which would be folded to the table's width.
    return Group(Text(title), made) if title else made


def _finite(value: object) -> object:
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _csv_cells(table: pa.Table) -> pa.Table:
    """Turn nested values into JSON text, and text, also that of the header, into what is no formula."""
    for index, field in enumerate(table.schema):
        column = table[index]
        if pa.types.is_nested(field.type):
            text = [None if value is None else json.dumps(value, default=str) for value in column.to_pylist()]
            column = pa.chunked_array([pa.array(text, pa.string())])
        elif pa.types.is_dictionary(field.type):
            column = column.cast(field.type.value_type)
        if any(is_text(column.type) for is_text in _TEXTS):
            column = pc.replace_substring_regex(column, UNSAFE, r"'\1")
        table = table.set_column(index, field.name, column)
    return table.rename_columns([csv_safe(name) for name in table.column_names])


def _shown(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return f"{{{', '.join(value)}}}"
    if isinstance(value, list) and len(value) > 8:
        return f"[{', '.join(_shown(one) for one in value[:4])}, … {len(value)} values]"
    return str(value)


def _is_number(text: str) -> bool:
    try:
        float(text or "0")
    except ValueError:
        return False
    return True
