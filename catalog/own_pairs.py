"""A clip's distances to all others, from the tiles that hold them.

The files of table `pairs` stand in the order of the tiles: each batch with itself and all later ones, see
`Earlier.tile` of `motionary.pipeline.layout`. So a clip's pairs lie in as many files as there are batches,
and those of all clips in half that number squared. DuckDB opens hundreds of small files faster than Arrow.
"""

from __future__ import annotations

from collections.abc import Sequence

import pyarrow as pa

from motionary.catalog.places import batch_of
from motionary.catalog.query import Catalog
from motionary.catalog.sql import session_of
from motionary.pipeline.layout import Earlier

_OWN = """
    select if(clip_a = $clip, clip_b, clip_a) as other, {columns}
    from {files} where clip_a = $clip or clip_b = $clip
"""


def own_pairs(catalog: Catalog, clip_id: str, columns: Sequence[str]) -> pa.Table:
    """Read distances of a clip to all others.

    Parameters
    ----------
    catalog : Catalog
    clip_id : str
        One that could be read.
    columns : sequence of str
        Of table `pairs`.

    Returns
    -------
    pyarrow.Table
        `other`, the other clip, and the columns; in the order of the files.

    Raises
    ------
    CatalogError
        A file is damaged or gone.
    """
    files = _files(catalog, batch_of(catalog)[clip_id])
    query = _OWN.replace("{columns}", ", ".join(columns))
    return session_of(catalog).over("pairs", files, query, {"clip": clip_id})


def pairs_with_batch(catalog: Catalog, batch: int, columns: Sequence[str]) -> pa.Table:
    """Read the pairs of which a clip of a batch is one: clip_a, clip_b and some columns.

    Raises
    ------
    CatalogError
        A file is damaged or gone.
    """
    query = f"select clip_a, clip_b, {', '.join(columns)} from {{files}}"
    return session_of(catalog).over("pairs", _files(catalog, batch), query, {})


def batch_count(catalog: Catalog) -> int:
    """Return how many batches the clips are stored in."""
    return max(batch_of(catalog).values(), default=-1) + 1


def _files(catalog: Catalog, batch: int) -> list[str]:
    batches = batch_count(catalog)
    layout, files = Earlier(batches=[{}] * batches), catalog.files("pairs")
    return [files[layout.tile(min(batch, other), max(batch, other))] for other in range(batches)]
