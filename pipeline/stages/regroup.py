"""Parts of all groups -> the groups that are published, numbered as if all pairs had been compared."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from motionary.pipeline.clustering.cut import numbered
from motionary.pipeline.tables import TABLES

VERSION = 1
MAKES = ("regrouped",)


def regroup(groups: pa.Table, assigned: pa.Table, refined: pa.Table) -> dict[str, pa.Table]:
    """Give the parts that the clips of a library fell into their numbers.

    Parameters
    ----------
    groups : pyarrow.Table
        Of the landmarks.
    assigned, refined : pyarrow.Table
        Of every clip.

    Returns
    -------
    dict of str to pyarrow.Table
        `regrouped`, in clip_id order.
    """
    assigned, refined = assigned.sort_by("clip_id"), refined.sort_by("clip_id")
    first = refined["first"].combine_chunks().dictionary_encode().indices.to_numpy().astype(np.int64)
    columns = {
        "clip_id": refined["clip_id"],
        "group": pa.array(numbered(first), pa.int32()),
        "landmark": pc.is_in(refined["clip_id"], groups["clip_id"].combine_chunks()),
        "compared": pc.add(assigned["compared"], refined["compared"]),
    }
    return {"regrouped": pa.table(columns, schema=TABLES["regrouped"])}
