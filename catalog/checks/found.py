"""What a check found, and how tables are asked for what is wrong in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from motionary.catalog.query import Catalog
from motionary.catalog.schema import SCHEMAS

MOST_TOLD = 3


@dataclass(frozen=True)
class Found:
    """What a check looked at, and what was wrong there.

    Parameters
    ----------
    seen : str
        What was looked at, with numbers.
    wrong : sequence of str
        A sentence for each thing that is wrong; none where all is well.
    """

    seen: str
    wrong: Sequence[str] = ()


def wrong_rows(catalog: Catalog, *queries: str) -> list[str]:
    """Ask for what is wrong: each query selects one column, a sentence a row.

    Returns
    -------
    list of str
        The first few sentences of each query, and how many more there are.
    """
    kinds = " union all ".join(
        f"select {kind}, said from ({query}) as wrong(said)" for kind, query in enumerate(queries)
    )
    rows = catalog.sql(
        f"""select kind, said, count(*) over (partition by kind) as rows from ({kinds}) as wrong(kind, said)
            qualify row_number() over (partition by kind order by said) <= {MOST_TOLD} order by kind, said"""
    ).to_pylist()
    told = []
    for _, group in groupby(rows, key=itemgetter("kind")):
        some = list(group)
        told += [row["said"] for row in some]
        if some[0]["rows"] > len(some):
            told.append(f"and {some[0]['rows'] - len(some)} more of this kind")
    return told


def has(catalog: Catalog, table: str) -> bool:
    """Say whether the snapshot has a table; those of an older motionary lack the later ones."""
    return table in catalog.snapshot.tables


def parts(catalog: Catalog, table: str, columns: Sequence[str]) -> Iterator[tuple[str, pa.Table]]:
    """Read some columns of a table, file by file, so that no more than one is in memory."""
    filesystem = catalog.store.filesystem
    for file in catalog.files(table):
        yield file, pq.read_table(catalog.store.path(file), filesystem=filesystem, columns=list(columns))


def not_finite(catalog: Catalog, table: str) -> list[str]:
    """Tell which clips hold a value that is infinite or no number, file by file and column by column."""
    schema, wrong = SCHEMAS[table], []
    columns = [field.name for field in schema if _holds_floats(field.type)]
    for file, rows in parts(catalog, table, ["clip_id", *columns]):
        for name in columns:
            values = rows[name].combine_chunks()
            places = None if pa.types.is_floating(values.type) else pc.list_parent_indices(values)
            values = values if places is None else pc.list_flatten(values)
            strange = pc.invert(pc.fill_null(pc.is_finite(values), False))
            if pc.any(strange).as_py():
                row = pc.index(strange, True).as_py()
                row = row if places is None else places[row].as_py()
                wrong.append(
                    f"{name} of clip {rows['clip_id'][row]} in {file} holds what is no finite number"
                )
    return wrong


def _holds_floats(type_: pa.DataType) -> bool:
    inner = type_.value_type if pa.types.is_list(type_) or pa.types.is_fixed_size_list(type_) else type_
    return bool(pa.types.is_floating(inner))
