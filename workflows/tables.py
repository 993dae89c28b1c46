r"""Tables for people and for programs: the `--format` of every command that answers with one.

What a format cannot hold becomes text: an interval as `2 days 0.5 seconds`, bytes as `\xAA` where they are no
plain ASCII, both such that DuckDB's casts read them back; the rest as JSON.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import Literal

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from motionary.workflows.csv_cells import UNSAFE, csv_safe
from motionary.workflows.errors import UserError

Format = Literal["table", "json", "csv", "parquet"]

_WIDE = 10_000  # columns of a table that goes to a file or a pipe: no name is folded there
_TEXTS = (pa.types.is_string, pa.types.is_large_string, pa.types.is_string_view)
_AS_TEXT = (
    pa.types.is_nested,
    pa.types.is_interval,
    pa.types.is_binary,
    pa.types.is_large_binary,
    pa.types.is_fixed_size_binary,
    pa.types.is_binary_view,
    lambda type_: isinstance(type_, pa.BaseExtensionType),
)
"""Types that a CSV has no cells for."""


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
        takes it for a formula (`csv_plain` undoes that); parquet writes as JSON text what it has no type for;
        table shortens nested values.

    Raises
    ------
    UserError
        Columns of one name, in json or parquet; dates that Python does not have, where they are to be text.
    """
    sink = sys.stdout.buffer
    if format_ == "json":
        _check_names(table, "JSON")
        rows = zip(*(_values(table, index) for index in range(table.num_columns)), strict=True)
        write_json([dict(zip(table.column_names, row, strict=True)) for row in rows])
    elif format_ == "csv":
        pa_csv.write_csv(_csv_cells(table), sink)
    elif format_ == "parquet":
        _check_names(table, "Parquet")
        pq.write_table(_parquet_columns(table), sink, compression="zstd")
    else:
        columns = [[_shown(value) for value in _values(table, index)] for index in range(table.num_columns)]
        output_console().print(text_table(table.column_names, list(zip(*columns, strict=True))))


def write_json(value: object) -> None:
    """Write an answer that is no table to stdout; numbers that are none become null, as JSON has no other."""
    text = json.dumps(_plain(value), default=str, ensure_ascii=False, indent=1, allow_nan=False)
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


def _check_names(table: pa.Table, format_: str) -> None:
    name, count = next(iter(Counter(table.column_names).most_common(1)), ("", 0))
    if count > 1:
        raise UserError(
            f"{count} columns are called {name!r}, and {format_} holds one of a name: rename with AS"
        )


def _values(table: pa.Table, index: int) -> list:
    """Return a column's values as Python has them."""
    try:
        return table[index].to_pylist()
    except (OverflowError, ValueError) as error:
        name = table.column_names[index]
        what = f"column {name!r} holds a value that cannot be written ({error})"
        raise UserError(f'{what}: ask for it as text, "{name}"::varchar') from error


def _plain(value: object) -> object:
    """Return a value as JSON has it: no NaN or infinity, no bytes, no intervals."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, pa.MonthDayNano | bytes):
        return _as_duckdb(value)
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _as_duckdb(value: pa.MonthDayNano | bytes) -> str:
    """Write an interval or bytes such that DuckDB's casts give them back."""
    if isinstance(value, bytes):
        plain = (
            chr(byte) if 32 <= byte < 127 and byte not in b"\\'\"" else f"\\x{byte:02X}" for byte in value
        )
        return "".join(plain)
    seconds = Decimal(value.nanoseconds).scaleb(-9).normalize()
    parts = {"months": value.months, "days": value.days, "seconds": f"{seconds:f}" if seconds else 0}
    return " ".join(f"{number} {unit}" for unit, number in parts.items() if number) or "0 seconds"


def _text(table: pa.Table, index: int) -> pa.ChunkedArray:
    """Write a column's values as text, nested ones as JSON."""
    nested = pa.types.is_nested(table.schema.field(index).type)
    plain = [None if value is None else _plain(value) for value in _values(table, index)]
    if nested:
        plain = [None if value is None else json.dumps(value, default=str) for value in plain]
    return pa.chunked_array([pa.array(plain, pa.string())])


def _parquet_columns(table: pa.Table) -> pa.Table:
    """Turn what Parquet has no type for into text."""
    for index, field in enumerate(table.schema):
        try:
            pq.write_table(pa.schema([field]).empty_table(), pa.BufferOutputStream())
        except pa.ArrowException:
            table = table.set_column(index, field.with_type(pa.string()), _text(table, index))
    return table


def _csv_cells(table: pa.Table) -> pa.Table:
    """Turn what a CSV has no cells for into text, and text, also the header's, into what is no formula."""
    for index, field in enumerate(table.schema):
        column = table[index]
        if pa.types.is_dictionary(field.type):
            column = column.cast(field.type.value_type)
        elif any(needs_text(field.type) for needs_text in _AS_TEXT):
            column = _text(table, index)
        if any(is_text(column.type) for is_text in _TEXTS):
            column = pc.replace_substring_regex(column, UNSAFE, r"'\1")
        table = table.set_column(index, field.name, column)
    return table.rename_columns([csv_safe(name) for name in table.column_names])


def _shown(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, pa.MonthDayNano | bytes):
        return _as_duckdb(value)
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
