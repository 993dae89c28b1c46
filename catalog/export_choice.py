"""Which clips an export is of, and what is known of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.errors import CatalogError, nearest
from motionary.catalog.query import Catalog
from motionary.pipeline.tables import table_field


def chosen_clips(
    catalog: Catalog,
    clips: Sequence[str] | None = None,
    cluster: int | str | None = None,
    where: str | None = None,
) -> list[str]:
    """Find the clips that are meant, in clip_id order.

    Parameters
    ----------
    catalog : Catalog
    clips : sequence of str, optional
        These.
    cluster : int or str, optional
        Those of the cluster of this number, or else of all clusters of this name.
    where : str, optional
        Of them those that fulfil this condition; see `Catalog.where`.

    Raises
    ------
    CatalogError
        There is no such clip or cluster, the condition is none, or no clip is left.
    """
    members = catalog.clusters.to_arrow()
    known = members["clip_id"].to_pylist()
    if not known:
        raise CatalogError(f"{catalog.store.url} holds no clips: there is nothing to export")
    if clips is not None:
        catalog.require(*sorted(set(clips)))
    if cluster is not None:
        wanted = pa.array(_cluster_ids(catalog, str(cluster)), pa.int32())
        members = members.filter(pc.is_in(members["cluster_id"], wanted))
    chosen = set(members["clip_id"].to_pylist() if clips is None else clips)
    if where is not None:
        chosen &= set(catalog.where(where).clip_ids)
    if not chosen:
        raise CatalogError(
            f"{catalog.store.url} holds clips, and none of them is chosen: there is nothing to export"
        )
    return sorted(chosen)


def described(
    catalog: Catalog, clip_ids: Sequence[str], aligned: bool, part_of: Mapping[str, str] | None
) -> pa.Table:
    """Join what is known of clips: cluster, part of a split, rate of the poses, skeleton, supplied labels."""
    joined = rows_of(catalog.clusters.to_arrow(), clip_ids)
    clips = rows_of(catalog.clips.to_arrow(), clip_ids)
    rates = clips["fps"]
    if aligned:
        alignments = rows_of(catalog.alignments.to_arrow(), clip_ids)
        joined = with_column(joined, alignments, "reference_id")
        rates = alignments["frame_rate"]
    if part_of is not None:
        parts = pa.array([part_of[clip_id] for clip_id in clip_ids], pa.string())
        joined = joined.append_column(table_field("split", pa.string(), "part of the export"), parts)
    joined = joined.append_column(table_field("frame_rate", pa.float64(), "of the poses", "1/s"), rates)
    for name in clips.column_names:
        if name not in joined.column_names:  # a supplied label may be called as a column above is
            joined = with_column(joined, clips, name)
    return joined


def rows_of(table: pa.Table, clip_ids: Sequence[str] | pa.ChunkedArray) -> pa.Table:
    """Take the row of each clip, in the order given, from a table that has one row a clip."""
    wanted = clip_ids if isinstance(clip_ids, pa.ChunkedArray) else pa.array(clip_ids, pa.string())
    return table.take(pc.index_in(wanted, table["clip_id"].combine_chunks()))


def with_column(table: pa.Table, other: pa.Table, column: str) -> pa.Table:
    """Append a column of another table that has the same rows."""
    return table.append_column(other.schema.field(column), other[column])


def _cluster_ids(catalog: Catalog, cluster: str) -> list[int]:
    """Find clusters by number, else all that have a name."""
    names = {row["cluster_id"]: row["label"] for row in catalog.references.to_arrow().to_pylist()}
    by_number = [number for number in names if str(number) == cluster]
    found = by_number or [number for number, name in names.items() if name == cluster]
    if not found:
        close = nearest(cluster, sorted({name for name in names.values() if name}))
        raise CatalogError(
            f"no cluster {cluster!r} in {catalog.store.url}{close or f'; it has 1 to {max(names)}'}"
        )
    return found
