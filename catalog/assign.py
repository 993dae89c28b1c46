"""New motions -> the clusters they belong to, thousands in a call; nothing is written.

`membership.py` tells by which rule.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog.given_files import Asked, Given, Unreadable, given_features, given_motions
from motionary.catalog.membership import Clusters, place, read_clusters
from motionary.pipeline.tables import table_field

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog

ASSIGNMENTS = pa.schema(
    [
        table_field("file", pa.string(), "as it was given"),
        table_field("cluster_id", pa.int32(), "null unless assigned", nullable=True),
        table_field("label", pa.string(), "the cluster's name; null where it does not reach", nullable=True),
        table_field("status", pa.string(), "assigned, unassigned or unreadable"),
        table_field(
            "confidence", pa.float64(), "in the label, as in table clusters; 0 without", nullable=True
        ),
        table_field("nearest_clip", pa.string(), "whose cluster it is", nullable=True),
        table_field("distance", pa.float64(), "to that clip, the primary distance", "feature", nullable=True),
        table_field(
            "distance_to_reference",
            pa.float64(),
            "of that clip's cluster, as in table clusters",
            "feature",
            nullable=True,
        ),
        table_field("second_cluster", pa.int32(), "of the nearest clip of another cluster", nullable=True),
        table_field("second_distance", pa.float64(), "to that clip", "feature", nullable=True),
        table_field(
            "fuzzy_low", pa.float64(), "to the reference, least of the curve", "feature", nullable=True
        ),
        table_field("fuzzy_high", pa.float64(), "to the reference, greatest", "feature", nullable=True),
        table_field("degree", pa.float64(), "membership, 0 to 1: see the module", nullable=True),
        table_field("reason", pa.string(), "why it is not assigned", nullable=True),
        table_field("line", pa.int64(), "line of the file, from 1", nullable=True),
        table_field("mend", pa.string(), "what to do about it", nullable=True),
    ]
)

Row = dict[str, Any]


def assign(
    catalog: Catalog, files: Asked | Sequence[Asked], *, advance: Callable[[], None] = lambda: None
) -> pa.Table:
    """Tell which clusters motions belong to; nothing is written.

    Parameters
    ----------
    catalog : Catalog
    files : path, Motion, or sequence of these
        Files, folders, patterns (see `given_motions`), or motions that were read already.
    advance : callable
        Called after every motion.

    Returns
    -------
    pyarrow.Table
        `ASSIGNMENTS`, a row a motion, in the order given.

    Raises
    ------
    CatalogError
        The catalog has no clips, or a file of it is damaged.
    """
    rows = []
    for row in _rows(catalog, given_motions(files)):
        rows.append(row)
        advance()
    return pa.Table.from_pylist(rows, schema=ASSIGNMENTS)


def _rows(catalog: Catalog, given: Iterable[Given]) -> Iterator[Row]:
    """Tell of one motion after another, in their order; few are in memory at a time.

    They are read one by one, which holds the interpreter, and compared meanwhile on a thread a processor,
    which does not.
    """
    from motionary.pipeline.distances.tiles import usable_processors

    clusters = catalog.keep("clusters to assign to", partial(read_clusters, catalog))
    jobs = usable_processors()
    waiting: deque[Future[Row]] = deque()
    with ThreadPoolExecutor(jobs) as threads:
        for one in given:
            waiting.append(threads.submit(_row, clusters, one.name, given_features(one, catalog.config)))
            if len(waiting) > 2 * jobs:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _row(clusters: Clusters, name: str, features: NDArray[np.float32] | Unreadable) -> Row:
    if isinstance(features, Unreadable):
        return {"file": name, "status": "unreadable", **asdict(features)}
    try:
        return {"file": name, **asdict(place(clusters, features))}
    except ValueError as error:  # of more frames than can be compared
        reason, _, mend = str(error).rpartition("; ")
        return {"file": name, "status": "unreadable", "reason": reason, "mend": mend}
