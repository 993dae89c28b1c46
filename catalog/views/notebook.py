"""Tables as a notebook shows them: the first rows, without lists that nobody reads."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import pyarrow as pa

_ROWS = 12


def table_html(title: str, table: pa.Table) -> str:
    """Show the first rows of a table; nested columns are named and left out."""
    plain = [one.name for one in table.schema if not pa.types.is_nested(one.type)]
    nested = [one.name for one in table.schema if pa.types.is_nested(one.type)]
    body = table.select(plain).slice(0, _ROWS).to_pandas().to_html(index=False, border=0, na_rep="")
    notes = [f"{len(table) - _ROWS} rows more"] if len(table) > _ROWS else []
    if nested:
        notes.append(f"not shown: {', '.join(nested)}")
    return f"<p>{escape(title)}</p>{body}<p>{escape('; '.join(notes))}</p>"


def facts_html(lines: Sequence[tuple[str, str]]) -> str:
    """Show pairs of what and how many."""
    rows = "".join(f"<tr><th>{escape(what)}</th><td>{escape(value)}</td></tr>" for what, value in lines)
    return f"<table>{rows}</table>"
