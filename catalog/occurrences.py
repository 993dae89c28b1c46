"""Where in the takes of a catalog a short motion occurs, with times.

Occurrences are found on merged frames (`motionary.pipeline.distances.subsequence`) and told in the take's own
time. The frame that one begins with may stand for a long rest, of which the motion needs only the end: of its
first and last frames no more is counted than the query's first and last ones last. Two strides of a walk meet
in a merged frame; it goes to the one that is nearer to the query, and the other is shorter by it.

The steps of a path decide what is found. Every clip of HDM05 was looked for in long takes, each of all clips
of another actor, one after another. Of the true spans were `found`, among as many occurrences as there are
true ones, those that share with an occurrence half or more of what the two cover
(`pytest -s tests/test_occurrences.py -k itakura`):

============================  ========  =====  ==============  =============================================
steps                         searches  found  first is right  shortest tenth, as a part of the query's time
============================  ========  =====  ==============  =============================================
Itakura's                          408    .94             .97                                            .60
DTW with open ends, averaged       408    .77             .83                                            .12
============================  ========  =====  ==============  =============================================
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from motionary.catalog.example import Example, LibraryFeatures, example_of, library_features
from motionary.catalog.joint_columns import JointColumns, joint_columns
from motionary.catalog.places import rows_by_clip
from motionary.pipeline.features import sample_times
from motionary.pipeline.tables import table_field

if TYPE_CHECKING:
    import pandas as pd

    from motionary.catalog.query import Catalog
    from motionary.pipeline.distances.subsequence import Found, PackedTakes

_SCHEMA = pa.schema(
    [
        table_field("rank", pa.int32(), "from 1, the nearest first"),
        table_field("clip_id", pa.string(), "the take"),
        table_field("start_seconds", pa.float64(), "where the occurrence begins in the take", "s"),
        table_field("end_seconds", pa.float64(), "where it ends", "s"),
        table_field("start_frame", pa.int32(), "frame of the take there, as captured, from 0"),
        table_field("end_frame", pa.int32(), "frame of the take at its end, included"),
        table_field("distance", pa.float64(), "average cost over the query's merged frames", "feature"),
    ]
)


@dataclass(frozen=True, eq=False, repr=False)
class Occurrences:
    """Where a motion occurs, and how much of the catalog had to be looked at.

    Parameters
    ----------
    query : str
        The clip or the file that was asked about.
    table : pa.Table
        An occurrence a row: rank, clip_id, start_seconds, end_seconds, start_frame, end_frame, distance.
    searched, pruned, too_short : int
        Takes that were searched; that a bound ruled out; that have less than half the query's merged frames.
    """

    query: str
    table: pa.Table
    searched: int
    pruned: int
    too_short: int

    def to_arrow(self) -> pa.Table:
        """Return the table."""
        return self.table

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a data frame."""
        return self.table.to_pandas()

    def __len__(self) -> int:
        return len(self.table)

    def __repr__(self) -> str:
        searched = "1 take" if self.searched == 1 else f"{self.searched} takes"
        return (
            f"<{len(self)} occurrences of {self.query}: {searched} searched, {self.pruned} ruled out, "
            f"{self.too_short} too short>"
        )

    def _repr_html_(self) -> str:
        from motionary.catalog.views.notebook import table_html

        return table_html(repr(self), self.table)


def occurrences(
    catalog: Catalog,
    clip_or_file: str | os.PathLike[str],
    k: int = 10,
    *,
    takes: str | Sequence[str] | None = None,
    joints: str | Sequence[str] | None = None,
) -> Occurrences:
    """Find where a short motion occurs in the takes of a catalog.

    Parameters
    ----------
    catalog : Catalog
    clip_or_file : str or path
        A clip_id of the catalog, or else a file, read as the run's settings say.
    k : int
        How many occurrences, of all takes together; a take may hold several, which share no frame. There are
        k wherever there is room for them: their distances tell which of them are like the motion.
    takes : str or sequence of str, optional
        The clips to look in, the asked one too if it is named; by default all others.
    joints : str or sequence of str, optional
        Compare these joints alone, and no travel, as `motionary.catalog.neighbours.similar` does.

    Raises
    ------
    CatalogError
        There is no such clip or file, or no such take.
    ReadError, SkeletonError
        As `example_of`.
    ValueError
        `k` is below 1, or there is no such joint.
    """
    from motionary.pipeline.distances.subsequence import find_occurrences

    example, library = example_of(catalog, clip_or_file), library_features(catalog)
    places = _places(catalog, library, example, [takes] if isinstance(takes, str) else takes)
    chosen = None if joints is None else joint_columns(joints, catalog.config.features.kind)
    query = example.features if chosen is None else chosen.of(example.features)
    found = find_occurrences(query, _packed_takes(catalog, library, chosen), k, places)
    table = pa.table(_columns(catalog, library, example, found), schema=_SCHEMA)
    return Occurrences(example.name, table, found.searched, found.pruned, found.too_short)


def _places(
    catalog: Catalog, library: LibraryFeatures, example: Example, takes: Sequence[str] | None
) -> list[int]:
    """Find the takes to look in."""
    if takes is None:
        return [place for place, clip_id in enumerate(library.clip_ids) if clip_id != example.clip_id]
    catalog.require(*takes)
    place_of = {clip_id: place for place, clip_id in enumerate(library.clip_ids)}
    return [place_of[clip_id] for clip_id in takes]


def _packed_takes(catalog: Catalog, library: LibraryFeatures, joints: JointColumns | None) -> PackedTakes:
    """Lay all clips out to be searched, once while the catalog is open."""
    from motionary.pipeline.distances.subsequence import pack_takes

    def pack() -> PackedTakes:
        return pack_takes(library.clips if joints is None else [joints.of(clip) for clip in library.clips])

    return catalog.keep(f"takes to search {joints.key if joints else ''}", pack)


def _columns(catalog: Catalog, library: LibraryFeatures, example: Example, found: Found) -> dict[str, Any]:
    """Tell the occurrences in the time of their takes."""
    clip_ids = [library.clip_ids[take] for take in found.take]
    frame_rate = catalog.config.features.frame_rate
    clips = catalog.clips.to_arrow()
    captured = {
        clip["clip_id"]: sample_times(clip["frames"], clip["fps"], frame_rate)
        for clip in clips.filter(pc.is_in(clips["clip_id"], pa.array(clip_ids, pa.string()))).to_pylist()
    }
    spans = dict(rows_by_clip(catalog, "resampled", set(clip_ids), ["first_frame", "last_frame"]))
    times = [
        _span(spans[clip_id], int(first), int(last), example)
        for clip_id, first, last in zip(clip_ids, found.first, found.last, strict=True)
    ]
    frames = [
        [round(captured[clip_id][frame]) for frame in span]
        for clip_id, span in zip(clip_ids, times, strict=True)
    ]
    return {
        "rank": np.arange(1, len(clip_ids) + 1, dtype=np.int32),
        "clip_id": clip_ids,
        "start_seconds": [start / frame_rate for start, _ in times],
        "end_seconds": [end / frame_rate for _, end in times],
        "start_frame": [start for start, _ in frames],
        "end_frame": [end for _, end in frames],
        "distance": found.distance,
    }


def _span(rows: pa.Table, first: int, last: int, example: Example) -> tuple[int, int]:
    """Return the frames at the common rate of an occurrence from a merged frame to another."""
    starts, ends = rows["first_frame"].to_numpy(), rows["last_frame"].to_numpy()
    lasting = example.last_frame - example.first_frame
    if first == last:
        return int(starts[first]), int(ends[first])
    return (
        int(max(starts[first], ends[first] - lasting[0])),
        int(min(ends[last], starts[last] + lasting[-1])),
    )
