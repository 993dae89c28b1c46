"""Clips found by words and by a condition in SQL, a page at a time.

A word is found in the clip_id, the name, and the supplied labels, in capitals or not; all words must be. What
is kept of an answer is its clip_ids; a page reads its own fifty rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from motionary.catalog.errors import CatalogError
from motionary.catalog.neighbours import Similar
from motionary.catalog.query import Catalog
from motionary.catalog.schema import SCHEMAS
from motionary.catalog.sql import quoted
from motionary.catalog.web.condition import refuse_more_than_a_comparison
from motionary.catalog.web.opened import Shown
from motionary.pipeline.tables import LABEL_COLUMNS

PAGE = 50
_MOST_WORDS = 20

_LONG = ("description", "licence")
"""Labels that are sentences, which a list has no room for."""
_ROW = (
    "clip_id",
    "cluster_id",
    "label",
    "label_source",
    "confidence",
    "distance_to_reference",
    "is_reference",
)


class TooManyWords(CatalogError):
    """More than anybody means, and each takes time."""


@dataclass(frozen=True)
class Page:
    """Some of many rows.

    Parameters
    ----------
    rows : sequence
        Of this page.
    number, pages, total : int
        Which page it is, from 1, of how many, and the rows of all of them.
    """

    rows: Sequence[Any]
    number: int
    pages: int
    total: int

    @property
    def first(self) -> int:
        """Which of all rows is the first of the page, from 1."""
        return (self.number - 1) * PAGE + 1


def page_of(rows: Sequence[Any], number: int) -> Page:
    """Cut a page out; one beyond the last is the last."""
    pages = max(1, -(-len(rows) // PAGE))
    number = min(max(1, number), pages)
    return Page(rows[(number - 1) * PAGE : number * PAGE], number, pages, len(rows))


def find(shown: Shown, words: str, condition: str = "") -> Sequence[str]:
    """Find the clips that have all words and fulfil the condition, in clip_id order.

    Raises
    ------
    CatalogError
        `TooManyWords`, or it is no condition; see `motionary.catalog.web.condition`.
    """
    asked = tuple(dict.fromkeys(words.lower().split()))
    if len(asked) > _MOST_WORDS:
        raise TooManyWords(f"{len(asked):,} words are asked for at once; ask for {_MOST_WORDS} at most")
    return shown.keep("search", ("find", asked, condition), lambda: _find(shown, asked, condition))


def clip_rows(catalog: Catalog, clip_ids: Sequence[str]) -> list[dict]:
    """Read what lists tell of clips, in the order given: name, cluster, length, and their other labels."""
    columns = ", ".join(map(quoted, (*_ROW, "seconds", *label_columns(catalog))))
    found = catalog.sql(
        f"select {columns} from takes where clip_id in (select unnest($chosen))", {"chosen": list(clip_ids)}
    ).to_pylist()
    rows = {row["clip_id"]: row for row in found}
    names = [name for name in label_columns(catalog) if name not in _LONG]
    for row in rows.values():
        row["labels"] = {name: row[name] for name in names if row[name] not in (None, row["label"])}
    return [rows[one] for one in clip_ids]


def near_rows(catalog: Catalog, near: Similar) -> list[dict]:
    """Read what lists tell of the clips most like something, with their distances, the nearest first."""
    distances = dict(zip(near.table["clip_id"].to_pylist(), near.table["distance"].to_pylist(), strict=True))
    return [row | {"distance": distances[row["clip_id"]]} for row in clip_rows(catalog, [*distances])]


def label_columns(catalog: Catalog) -> list[str]:
    """List the columns of supplied labels, the usual ones first."""

    def read() -> list[str]:
        known = {*SCHEMAS["clips"].names, *SCHEMAS["clusters"].names} - {*LABEL_COLUMNS}
        return [one for one in catalog.sql("from takes limit 0").column_names if one not in known]

    return catalog.keep("label columns", read)


def _find(shown: Shown, words: Sequence[str], condition: str) -> Sequence[str]:
    catalog = shown.catalog
    texts = ", ".join(map(quoted, ("clip_id", "label", *label_columns(catalog))))
    has = [f"contains(lower(concat_ws(chr(10), {texts})), $w{number})" for number in range(len(words))]
    query = f"select clip_id from takes where {' and '.join(has) or 'true'} order by clip_id"
    found = catalog.sql(query, {f"w{number}": word for number, word in enumerate(words)} or None)
    clip_ids = found["clip_id"].to_pylist()
    if not condition.strip():
        return clip_ids
    refuse_more_than_a_comparison(condition)
    fulfil = shown.keep("search", ("where", condition), lambda: set(catalog.where(condition).clip_ids))
    return [one for one in clip_ids if one in fulfil]
