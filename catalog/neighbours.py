"""The clips of a catalog that are most like one of them, or like a file.

A clip's distances to all others stand in table `pairs`, and are read; a file is compared with all clips,
exactly, most of them ruled out by bounds (`motionary.pipeline.distances.nearest`), and so is a clip where the
run did not compare all pairs. Both give one answer: a
file of the library finds its own clip at distance 0 and the others as that clip does. Over some joints alone
nothing is stored, and clips are compared as files are.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.errors import CatalogError
from motionary.catalog.example import ClipOrFile, Example, clip_seconds, example_of, library_features
from motionary.catalog.joint_columns import JointColumns, joint_columns
from motionary.catalog.mutual import mutual_proximity, usual_distances
from motionary.catalog.own_pairs import all_pairs_are_there, own_pairs
from motionary.catalog.query import Catalog
from motionary.catalog.ranked_distance import RankedDistance, ranked_distance
from motionary.pipeline.config import Metric
from motionary.pipeline.tables import TABLES, table_field

if TYPE_CHECKING:
    import pandas as pd

    from motionary.pipeline.distances.nearest import PackedLibrary

Rank = Literal["distance", "mutual"]

FEW_FRAMES = 10
"""What has fewer, low-motion ones merged, is hard to tell from other short motions."""

_SCHEMA = pa.schema(
    [
        table_field("rank", pa.int32(), "from 1, the most similar first"),
        TABLES["clips"].field("clip_id"),
        table_field("distance", pa.float32(), "by the metric asked for", "feature"),
        table_field("mutual", pa.float64(), "mutual proximity, 0 to 1"),
        TABLES["clusters"].field("cluster_id"),
        TABLES["clusters"].field("label"),
        TABLES["clips"].field("seconds"),
    ]
)


@dataclass(frozen=True, eq=False, repr=False)
class Similar:
    """The clips that are most like an example.

    Parameters
    ----------
    name : str
        The clip or the file.
    metric : str
        The distance.
    table : pyarrow.Table
        A row a clip, the most similar first: rank, clip_id, distance, mutual (where it ranks), cluster_id,
        label, seconds.
    compared : int
        Clips whose distance was computed.
    pruned : int
        Clips that a bound ruled out before; with `compared` and those read from `pairs`, all of the catalog.
    frames : int, optional
        Of what was asked about, low-motion ones merged; None where distances were read and none computed.
    """

    name: str
    metric: Metric
    table: pa.Table
    compared: int
    pruned: int
    frames: int | None = None

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a data frame."""
        return self.table.to_pandas()

    def __len__(self) -> int:
        return len(self.table)

    def __repr__(self) -> str:
        return f"<{len(self)} clips like {self.name}: {self.how}>"

    def _repr_html_(self) -> str:
        from motionary.catalog.views.notebook import table_html

        return table_html(repr(self), self.table)

    @property
    def from_pairs(self) -> bool:
        """Whether distances were read and none computed."""
        return self.frames is None

    @property
    def how(self) -> str:
        """Say where the answer comes from, and of how little it may be."""
        if self.frames is None:
            return f"{self.metric}, read from table pairs"
        clips = self.compared + self.pruned
        told = f"{self.metric}, {self.compared} of {clips} clips compared, {self.pruned} ruled out by bounds"
        if self.frames < FEW_FRAMES:
            told += f"; of {self.frames} frames once those of little motion are merged: few to be known by"
        return told


def similar(
    catalog: Catalog,
    clip_or_file: ClipOrFile,
    k: int = 10,
    *,
    metric: Metric | None = None,
    joints: str | Sequence[str] | None = None,
    rank: Rank = "distance",
) -> Similar:
    """Find the clips most like one of the catalog, or like a file.

    Parameters
    ----------
    catalog : Catalog
    clip_or_file : str, path or Example
        A clip_id, which is not among the answers, or else a file, or what `example_of` made of one.
    k : int
        How many clips.
    metric : {"dtw", "b_dtw", "weighted", "fuzzy"}, optional
        By default that of the published clusters.
    joints : str or sequence of str, optional
        Compare these joints alone, and no travel: a preset of `motionary.pipeline.joint_weights`, or
        canonical joints; without its side ("knee") a name means both.
    rank : {"distance", "mutual"}
        By distance, or by mutual proximity: see `motionary.catalog.mutual`.

    Raises
    ------
    CatalogError
        There is no such clip or file, or a file of the catalog is damaged.
    ReadError, SkeletonError
        The file cannot be read, or its skeleton cannot be compared.
    ValueError
        An argument is out of its range.
    """
    if k < 1:
        raise ValueError(f"k is {k}; ask for at least one clip")
    if rank not in get_args(Rank):
        raise ValueError(f"rank is {rank!r}; it must be one of {', '.join(map(repr, get_args(Rank)))}")
    if joints is not None and rank == "mutual":
        raise ValueError("mutual proximity is of the stored distances, over all joints; leave joints out")
    distance = ranked_distance(catalog.config, metric)
    takes = _takes(catalog)
    found = _distances(catalog, clip_or_file, len(takes) if rank == "mutual" else k, distance, joints)
    near = None
    if rank == "mutual":
        usual = usual_distances(catalog, takes["clip_id"].combine_chunks(), distance)
        near = mutual_proximity(found.places, found.distances, usual)
    by_distance = (found.places, found.distances)
    order = np.lexsort(by_distance if near is None else (*by_distance, -near))[:k]
    rows = takes.take(pa.array(found.places[order]))
    columns = {
        "rank": np.arange(1, len(order) + 1, dtype=np.int32),
        "clip_id": rows["clip_id"],
        "distance": found.distances[order],
        **({} if near is None else {"mutual": near[order]}),
        **{name: rows[name] for name in ("cluster_id", "label", "seconds")},
    }
    table = pa.table(columns, schema=pa.schema([_SCHEMA.field(name) for name in columns]))
    return Similar(found.name, distance.metric, table, found.compared, found.pruned, found.frames)


def packed_library(catalog: Catalog, joints: JointColumns | None = None) -> PackedLibrary:
    """Lay all clips out to be compared with a file, once while the catalog is open; in clip_id order.

    Parameters
    ----------
    catalog : Catalog
    joints : JointColumns, optional
        By default the features that the run compared.
    """
    from motionary.pipeline.distances.nearest import pack_library

    def pack() -> PackedLibrary:
        clips = library_features(catalog).clips
        return pack_library(clips if joints is None else [joints.of(clip) for clip in clips])

    return catalog.keep(f"packed library {joints.key if joints else ''}", pack)


@dataclass(frozen=True, eq=False)
class _Found:
    """Clips like `name`, by their place in clip_id order, their distances, and how those came about."""

    name: str
    places: NDArray[np.int64]
    distances: NDArray[np.float32]
    compared: int = 0
    pruned: int = 0
    frames: int | None = None


def _distances(
    catalog: Catalog,
    clip_or_file: ClipOrFile,
    k: int,
    distance: RankedDistance,
    joints: str | Sequence[str] | None,
) -> _Found:
    """Find at least the k nearest clips."""
    clip_ids = _takes(catalog)["clip_id"].combine_chunks()
    name = None if isinstance(clip_or_file, Example) else os.fspath(clip_or_file)
    if joints is None and name in clip_seconds(catalog) and all_pairs_are_there(catalog):
        return _stored(catalog, name, clip_ids, distance)
    from motionary.pipeline.distances.nearest import nearest_clips

    example = example_of(catalog, clip_or_file)
    chosen = None if joints is None else joint_columns(joints, catalog.config.features.kind)
    among = np.arange(len(clip_ids))
    if example.clip_id is not None:
        among = np.delete(among, pc.index(clip_ids, example.clip_id).as_py())
    found = nearest_clips(
        example.features if chosen is None else chosen.of(example.features),
        packed_library(catalog, chosen),
        k,
        distance.metric,
        distance.thresholds,
        tau=distance.tau,
        among=among,
    )
    frames = len(example.features)
    return _Found(example.name, found.index, found.distance, found.compared, found.pruned, frames)


def _stored(catalog: Catalog, clip_id: str, clip_ids: pa.Array, distance: RankedDistance) -> _Found:
    """Read a clip's distances to all others."""
    pairs = own_pairs(catalog, clip_id, distance.columns)
    if len(pairs) != len(clip_ids) - 1:
        raise CatalogError(
            f"{catalog.store.url} holds {len(pairs)} of the {len(clip_ids) - 1} pairs of {clip_id!r}; "
            "`motionary verify` finds what is wrong with it"
        )
    places = pc.index_in(pairs["other"].combine_chunks(), clip_ids).to_numpy().astype(np.int64)
    return _Found(clip_id, places, distance.of(pairs))


def _takes(catalog: Catalog) -> pa.Table:
    """Return what an answer says of every clip, in clip_id order."""
    query = "select clip_id, cluster_id, label, seconds from takes order by clip_id"
    return catalog.keep("takes of answers", lambda: catalog.sql(query))
