"""A clip's distances to all others, from the tiles that hold them.

The files of table `pairs` stand in the order of the tiles: each side with itself and all later ones, see
`Earlier.tile` of `motionary.pipeline.layout`. So a clip's pairs lie in as many files as there are sides,
and those of all clips in half that number squared. DuckDB opens hundreds of small files faster than Arrow.
"""

from __future__ import annotations

from collections.abc import Sequence

import pyarrow as pa

from motionary.catalog.earlier import side_column
from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.sql import session_of
from motionary.pipeline.layout import Earlier

_OWN = """
    select if(clip_a = $clip, clip_b, clip_a) as other, {columns}
    from {files} where clip_a = $clip or clip_b = $clip
"""


def all_pairs_are_there(catalog: Catalog) -> bool:
    """Say whether the run compared every clip with every other."""
    return catalog.config.distances.pairs == "all"


def refuse_without_all_pairs(catalog: Catalog, what: str) -> None:
    """Refuse what needs the distances of all clips to all others.

    Raises
    ------
    CatalogError
        The run compared some pairs alone.
    """
    if not all_pairs_are_there(catalog):
        raise CatalogError(
            f"{what} needs all pairs, and the run of {catalog.store.url} compared some alone "
            f"(pairs = {catalog.config.distances.pairs!r}); run again with all pairs"
        )


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
    files = _files(catalog, side_of(catalog)[clip_id])
    query = _OWN.replace("{columns}", ", ".join(columns))
    return session_of(catalog).over("pairs", files, query, {"clip": clip_id})


def pairs_with_side(catalog: Catalog, side: int, columns: Sequence[str]) -> pa.Table:
    """Read the pairs of which a clip of a side is one: clip_a, clip_b and some columns.

    Raises
    ------
    CatalogError
        A file is damaged or gone.
    """
    query = f"select clip_a, clip_b, {', '.join(columns)} from {{files}}"
    return session_of(catalog).over("pairs", _files(catalog, side), query, {})


def side_of(catalog: Catalog) -> dict[str, int]:
    """Return the side of every clip that the run found, readable or not."""

    def read() -> dict[str, int]:
        inputs = catalog.inputs.to_arrow()
        sides = inputs[side_column(inputs)].to_pylist()
        return dict(zip(inputs["clip_id"].to_pylist(), sides, strict=True))

    return catalog.keep("side of every clip", read)


def side_count(catalog: Catalog) -> int:
    """Return on how many sides the clips are."""
    return max(side_of(catalog).values(), default=-1) + 1


def sides_to_read(catalog: Catalog, pairs: int) -> int:
    """Return how many sides can be asked for their distances to all clips, to read about so many pairs."""
    clips = len(side_of(catalog))
    of_one = max(clips // max(side_count(catalog), 1), 1) * max(clips, 1)
    return max(pairs // of_one, 2)


def _files(catalog: Catalog, side: int) -> list[str]:
    sides = side_count(catalog)
    layout, files = Earlier(sides=[{}] * sides), catalog.files("pairs")
    return [files[layout.tile(min(side, other), max(side, other))] for other in range(sides)]
