"""Which clusters, and which alignments in them, are what they were in the earlier run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pyarrow as pa

from motionary.pipeline.layout import Earlier, Layout


class Alignment(NamedTuple):
    """A clip and the reference that it is aligned to, with the keys of their contents."""

    clip_id: str
    key: str
    cluster_id: int
    reference_id: str
    reference_key: str


@dataclass(frozen=True)
class KeptAlignments:
    """What can be taken over from the earlier run.

    Parameters
    ----------
    layout : Layout
        The library.
    names : mapping of str to (int, str)
        Of clips aligned to what they were aligned to: the batch and the clip_id there.
    whole_clusters : mapping of str to str
        Of the clips of clusters in which nothing changed: the clip_id there.
    """

    layout: Layout
    names: Mapping[str, tuple[int, str]]
    whole_clusters: Mapping[str, str]

    def by_batch(self, clip_ids: Sequence[str]) -> dict[int, dict[str, str]]:
        """Sort clips by the earlier batch that holds them; clips that none does are left out."""
        found: dict[int, dict[str, str]] = {}
        for clip_id in clip_ids:
            if clip_id in self.names:
                batch, there = self.names[clip_id]
                found.setdefault(batch, {})[clip_id] = there
        return found

    def alignments_of(self, represented: pa.Table) -> dict[str, Alignment]:
        """Say of every clip what it is aligned to."""
        return _alignments(represented, self.layout.keys)


def kept_clusters(members: pa.Table, layout: Layout, before: pa.Table, earlier: Earlier) -> dict[int, str]:
    """Find the clusters that hold the contents they held.

    Parameters
    ----------
    members : pyarrow.Table
        The cluster of every clip.
    layout : Layout
        The library.
    before : pyarrow.Table
        `represented` of the earlier run.
    earlier : Earlier
        That run.

    Returns
    -------
    dict of int to str
        Of each, what its reference is called now.
    """
    now: dict[int, dict[str, str]] = {}
    for row in members.to_pylist():
        now.setdefault(row["cluster_id"], {})[row["clip_id"]] = layout.keys[row["clip_id"]]
    then: dict[int, list[str]] = {}
    reference_key: dict[int, str] = {}
    for row in before.to_pylist():
        key = earlier.keys[row["clip_id"]]
        then.setdefault(row["cluster_id"], []).append(key)
        if row["is_reference"]:
            reference_key[row["cluster_id"]] = key
    return {
        cluster_id: next(clip_id for clip_id, key in clips.items() if key == reference_key[cluster_id])
        for cluster_id, clips in now.items()
        if sorted(clips.values()) == sorted(then.get(cluster_id, ()))
    }


def kept_alignments(
    represented: pa.Table, layout: Layout, before: pa.Table, earlier: Earlier
) -> KeptAlignments:
    """Find the clips that are aligned to the reference they were aligned to.

    Parameters
    ----------
    represented : pyarrow.Table
        The cluster of every clip, and who its reference is.
    layout : Layout
        The library.
    before : pyarrow.Table
        The same of the earlier run.
    earlier : Earlier
        That run.
    """
    then = {}
    clusters_then: dict[int, list[tuple[str, str]]] = {}
    for one in _alignments(before, earlier.keys).values():
        then[one.key, one.reference_key] = one.clip_id
        clusters_then.setdefault(one.cluster_id, []).append((one.key, one.reference_key))
    batch_of = {clip_id: number for number, batch in enumerate(earlier.batches) for clip_id in batch}
    clusters_now: dict[int, list[Alignment]] = {}
    for one in _alignments(represented, layout.keys).values():
        clusters_now.setdefault(one.cluster_id, []).append(one)

    names: dict[str, tuple[int, str]] = {}
    whole: dict[str, str] = {}
    for cluster_id, clips in clusters_now.items():
        contents = [(one.key, one.reference_key) for one in clips]
        found = {one.clip_id: then[pair] for one, pair in zip(clips, contents, strict=True) if pair in then}
        names |= {clip_id: (batch_of[there], there) for clip_id, there in found.items()}
        if sorted(contents) == sorted(clusters_then.get(cluster_id, ())):
            whole |= found
    return KeptAlignments(layout, names, whole)


def _alignments(represented: pa.Table, keys: Mapping[str, str]) -> dict[str, Alignment]:
    rows = represented.to_pylist()
    reference_of = {row["cluster_id"]: row["clip_id"] for row in rows if row["is_reference"]}
    return {
        row["clip_id"]: Alignment(
            row["clip_id"],
            keys[row["clip_id"]],
            row["cluster_id"],
            reference_of[row["cluster_id"]],
            keys[reference_of[row["cluster_id"]]],
        )
        for row in rows
    }
