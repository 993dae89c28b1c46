"""The dendrograms that a catalog keeps, as SciPy linkage matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.query import Catalog


@dataclass(frozen=True, eq=False)
class KeptLinkage:
    """A dendrogram with the row of `cuts` that tells of it.

    Parameters
    ----------
    Z : array (N - 1, 4)
        SciPy linkage matrix; clips are numbered in clip_id order.
    cut : dict
        The row of `cuts`.
    """

    Z: NDArray[np.float64]
    cut: dict[str, Any]


def primary_linkage(catalog: Catalog) -> KeptLinkage | None:
    """Return the dendrogram whose clusters are published, None in a catalog without clips."""
    return next((one for one in kept_linkages(catalog) if one.cut["primary"]), None)


def linkages_by_distance(catalog: Catalog) -> list[KeptLinkage]:
    """Return one dendrogram for each distance, made by the primary linkage where that can read the distance.

    Fuzzy linkage reads the fuzzy distance alone: where it is the primary one, complete linkage stands in.
    """
    kept = kept_linkages(catalog)
    primary = next((one.cut["method"] for one in kept if one.cut["primary"]), None)
    method = "complete" if primary == "fuzzy" else primary
    return [one for one in kept if one.cut["method"] in (method, "fuzzy")]


def kept_linkages(catalog: Catalog) -> list[KeptLinkage]:
    """Return every dendrogram of a catalog, in the order of `cuts`."""
    rows = catalog.linkage.to_arrow()
    return [KeptLinkage(_matrix(rows, cut), cut) for cut in catalog.cuts.to_arrow().to_pylist()]


def _matrix(rows: pa.Table, cut: dict[str, Any]) -> NDArray[np.float64]:
    own = pc.and_(pc.equal(rows["method"], cut["method"]), pc.equal(rows["metric"], cut["metric"]))
    merges = rows.filter(own).sort_by("step")
    columns = [merges[name].to_numpy().astype(np.float64) for name in ("left", "right", "height", "size")]
    return np.stack(columns, axis=1)
