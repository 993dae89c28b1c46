"""What a condition in SQL may say here: compare a clip's columns, and nothing that takes long.

A condition comes from whoever can open the page. DuckDB neither stops a running function nor holds every one
of them to its limit of memory, so what is allowed is named: columns, constants, comparisons, and functions
whose work is as long as their text. Everything else can be asked with `motionary query`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from motionary.catalog.errors import CatalogError

_LONGEST = 1000
_DEEPEST = 30  # DuckDB's parser takes minutes over thousands of parentheses

_KINDS = {
    *("COMPARISON", "CONJUNCTION", "CONSTANT", "COLUMN_REF", "OPERATOR", "FUNCTION", "BETWEEN", "CASE"),
    *("CAST", "TYPE"),
}
_FUNCTIONS = {
    *("+", "-", "*", "/", "%", "abs", "ceil", "floor", "round"),
    *("~~", "!~~", "~~*", "!~~*", "contains", "starts_with", "ends_with", "prefix", "suffix"),
    *("length", "lower", "upper", "trim", "regexp_matches", "regexp_full_match"),
    *("len", "list_contains"),
}
_FROM = "select 1 from takes where "


def refuse_more_than_a_comparison(condition: str) -> None:
    """Refuse a condition that is longer, deeper or other than a comparison of columns.

    Parameters
    ----------
    condition : str
        What would stand after `where`.

    Raises
    ------
    CatalogError
        It is; or it is no condition, with DuckDB's message.
    """
    if len(condition) > _LONGEST:
        raise CatalogError(
            f"the condition has {len(condition):,} characters; here it may have {_LONGEST:,}; "
            "`motionary query` takes longer ones"
        )
    if max(condition.count("("), condition.count("[")) > _DEEPEST:
        raise CatalogError(
            f"the condition has more than {_DEEPEST} parentheses; ask it with `motionary query`"
        )
    asked, plain = _parsed(f"{_FROM}{condition}"), _parsed(f"{_FROM}true")
    where, _ = asked.pop("where_clause", None), plain.pop("where_clause")
    if where is None or asked != plain:
        raise CatalogError("give a condition alone, as it stands after `where` in SQL")
    for node in _expressions(where):
        name = node.get("function_name", "")
        if node["class"] not in _KINDS:
            what = node["class"].replace("_", " ").lower()
        elif name and name not in _FUNCTIONS:
            what = f"function {name}"
        else:
            continue
        raise CatalogError(f"a condition here compares columns; it may hold no {what}; `motionary query` may")


def _parsed(query: str) -> dict[str, Any]:
    """Return the tree of a selection, without the places in its text."""
    import duckdb

    with duckdb.connect() as connection:
        (text,) = connection.execute("select json_serialize_sql(?::varchar)", [query]).fetchall()[0]
    made = json.loads(text)
    if made["error"]:
        raise CatalogError(f"it is no condition: {' '.join(made['error_message'].split())}")
    if len(made["statements"]) != 1:
        raise CatalogError("give one condition, without a semicolon")
    return _without_places(made["statements"][0]["node"])


def _without_places(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {name: _without_places(one) for name, one in tree.items() if name != "query_location"}
    return [_without_places(one) for one in tree] if isinstance(tree, list) else tree


def _expressions(tree: Any) -> Iterator[dict[str, Any]]:
    if isinstance(tree, dict):
        if "class" in tree:
            yield tree
        for one in tree.values():
            yield from _expressions(one)
    elif isinstance(tree, list):
        for one in tree:
            yield from _expressions(one)
