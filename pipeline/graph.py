"""The graph: which stage feeds which. Wiring, no mathematics; `dask_graph.py` writes it as Dask wants it.

    files -> ingest (a batch) -> resample -> compare (two sides) -> cluster -> identify
             identify -> represent
             represent -> align (a batch) -> style
             represent -> name

The three lines are built one after the other: what is to be done for the clusters is known when they are.

A result is named by its key: a digest of its stage's version and settings and of what goes into it, down to
the bytes of the files. Equal keys mean equal results, so a task whose result is stored has nothing to do. A
task that has takes over what earlier results hold of its rows and computes the others; see
`motionary.pipeline.layout`. Tasks hand each other keys, never arrays; tables pass through the store that the
caller gives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import pyarrow as pa

from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.layout import Clip, Earlier, Layout, digest_of_settings
from motionary.pipeline.origins import Block, clip_origins, pair_origins
from motionary.pipeline.reuse import kept_alignments, kept_clusters
from motionary.pipeline.stage_settings import stage_settings
from motionary.pipeline.stages import (
    align,
    cluster,
    cluster_pruned,
    compare,
    identify,
    ingest,
    name,
    represent,
    resample,
    style,
)
from motionary.pipeline.task import MAKES, OF_LANDMARKS, IsStored, Task

Load = Callable[..., pa.Table]
"""Given a result's key, a table and maybe columns, what `TableStore.load` returns."""

ROOM = 1 << 30
"""Bytes that a task may hold, unless the caller says otherwise."""


class Grouped(NamedTuple):
    """Who made the groups that are published: a stage, its table, and the key of its result."""

    stage: str
    table: str
    key: str


@dataclass(frozen=True)
class LibraryGraph:
    """The tasks over a library.

    Parameters
    ----------
    layout : Layout
        Its clips.
    labels : pyarrow.Table
        Supplied labels: clip_id and text columns.
    overrides : pyarrow.Table
        What people called clips: clip_id, label.
    config : PipelineConfig
        Every stage's settings.
    earlier : Earlier
        The run to build upon.
    is_stored : callable
        Asked for the results of that run.
    room : int
        Bytes that a task may hold of what would not fit into memory whole; changes no result.
    """

    layout: Layout
    labels: pa.Table
    overrides: pa.Table
    config: PipelineConfig
    earlier: Earlier
    is_stored: IsStored
    room: int = ROOM

    @cached_property
    def settings(self) -> dict[str, str]:
        """Of every stage, the digest of its version and settings."""
        return stage_settings(self.config)

    @cached_property
    def names(self) -> dict[str, str]:
        """Of every clip that was there in the earlier run, what it was called."""
        return self.earlier.names_of(self.layout.digests)

    @cached_property
    def ingested(self) -> list[Task]:
        """Every batch read."""
        made: list[Task] = []
        for number, batch in enumerate(self.layout.batches):
            about = [(clip.clip_id, clip.source.path, clip.key) for clip in batch]
            origins = clip_origins(number, self.layout, self.earlier)
            keys = {
                one: self._earlier("ingest", one.batch) if one.earlier else made[one.batch].key
                for one in origins
            }
            made.append(
                Task(
                    "ingest", self._key("ingest", about), ingest.ingest, reads=(),
                    arguments=([(clip.key, clip.source) for clip in batch], self.config),
                    carries=[(keys[one], names) for one, names in origins.items() if keys[one]],
                )
            )  # fmt: skip
        return made

    @cached_property
    def resampled(self) -> list[Task]:
        """Every batch with its low-motion frames merged."""
        return [
            Task(
                "resample", self._key("resample", task.key), resample.resample,
                reads=[("features", [task.key])], arguments=(self.config.features,),
            )
            for task in self.ingested
        ]  # fmt: skip

    @cached_property
    def compared(self) -> list[Task]:
        """Every tile of two sides, or of one, compared."""
        tiles = [*combinations_with_replacement(range(len(self.layout.sides)), 2)]
        contents = [
            digest_of_settings([(clip.clip_id, clip.key) for clip in side]) for side in self.layout.sides
        ]
        keys = {tile: self._key("compare", [contents[side] for side in tile]) for tile in tiles}
        frames = [[self.resampled[batch].key for batch in batches] for batches in self.layout.batches_of_side]
        return [
            Task(
                "compare", keys[tile], compare.compare,
                reads=[("resampled", frames[side]) for side in tile],
                arguments=(self.config.distances, self.config.most_distance),
                carries=self._carried_pairs(tile, keys),
            )
            for tile in tiles
        ]  # fmt: skip

    @cached_property
    def clustered(self) -> Task:
        """The library clustered."""
        ingested = [task.key for task in self.ingested]
        about = (ingested, self.labels.to_pylist(), self._named)
        all_pairs = self.config.most_distance is None
        return Task(
            "cluster", self._key("cluster", about),
            cluster.cluster if all_pairs else cluster_pruned.cluster_pruned,
            reads=[("ingested", ingested)],
            streams=[("pairs", [task.key for task in self.compared])],
            arguments=(self.labels, self.overrides, self.config.clusters),
        )  # fmt: skip

    @property
    def grouped(self) -> Grouped:
        """What the published groups are read from."""
        return Grouped("cluster", "groups", self.clustered.key)

    @cached_property
    def identified(self) -> Task:
        """The clusters numbered. Where they are those of the earlier run, so are the numbers."""
        stage, table, key = self.grouped
        same = self._earlier(stage) == key
        before = self._earlier("identify")
        return Task(
            "identify", before if same and before else self._key("identify", (key, before)),
            identify.identify,
            reads=[(table, [key]), *((one, _list(before)) for one in identify.MAKES)],
            arguments=(self.names, self.earlier.snapshot_id),
        )  # fmt: skip

    @property
    def compared_sides(self) -> Sequence[Sequence[Clip]]:
        """The sides of the tiles of `compared`."""
        return self.layout.sides

    def later_pairs(self) -> int:
        """Say how many pairs are compared, about, that no task of `compared` has."""
        return 0

    def comparison(self) -> list[Task]:
        """List the tasks that lead to the clusters, each after those it reads from."""
        return [*self.ingested, *self.resampled, *self.compared, self.clustered, self.identified]

    def waves(self, load: Load) -> Iterator[list[Task]]:
        """List the tasks that lead to the clusters, those together that are known at a time.

        Parameters
        ----------
        load : callable
            Returns a table that a task of an earlier wave made, given its key.
        """
        yield self.comparison()

    def tasks_by_stage(self) -> dict[str, int]:
        """Count the tasks of every stage."""
        counts = {stage: 1 for stage in MAKES if stage not in OF_LANDMARKS}
        counts["ingest"] = counts["resample"] = counts["align"] = len(self.ingested)
        counts["compare"] = len(self.compared)
        return counts

    def representation(self, members: pa.Table, earlier: pa.Table) -> Task:
        """Choose the references.

        Parameters
        ----------
        members : pyarrow.Table
            What `identified` made.
        earlier : pyarrow.Table
            `represented` of the earlier run.
        """
        before = self._earlier_alike("represent")
        kept = kept_clusters(members, self.layout, earlier, self.earlier) if before else {}
        cluster_of = _pairs(members, "clip_id", "cluster_id")
        batches = [
            task.key
            for task, batch in zip(self.ingested, self.layout.batches, strict=True)
            if any(clip.clip_id in cluster_of and cluster_of[clip.clip_id] not in kept for clip in batch)
        ]
        about = [(one, cluster_id, self.layout.keys[one]) for one, cluster_id in cluster_of.items()]
        return Task(
            "represent", self._key("represent", about), represent.represent,
            reads=[
                ("members", [self.identified.key]), ("ingested", batches),
                ("centres", _list(before)), ("reference_features", _list(before)),
            ],
            streams=[("pairs", [task.key for task in self.compared]), ("features", batches)],
            arguments=(kept, self.config.clusters, self.config.alignment, self.room),
        )  # fmt: skip

    def alignment(self, represented: Task, references: pa.Table, earlier: pa.Table) -> list[Task]:
        """List the tasks that need the references: align, style, name.

        Parameters
        ----------
        represented : Task
            Of `representation`.
        references : pyarrow.Table
            `represented` as it made it.
        earlier : pyarrow.Table
            The same of the earlier run.
        """
        kept = kept_alignments(references, self.layout, earlier, self.earlier)
        about = kept.alignments_of(references)
        aligned = []
        for task, batch in zip(self.ingested, self.layout.batches, strict=True):
            ids = [clip.clip_id for clip in batch if clip.clip_id in about]
            alignments = ([clip.clip_id for clip in batch], [about[one] for one in ids])
            carried = kept.by_batch(ids) if self._earlier_alike("align") else {}
            aligned.append(
                Task(
                    "align", self._key("align", alignments), align.align,
                    reads=[*((table, [task.key]) for table in ("ingested", "frames", "features")),
                           *((table, [represented.key]) for table in ("represented", "reference_features"))],
                    arguments=(self.config.alignment, self.config.features.frame_rate),
                    carries=[
                        (key, names) for number, names in carried.items()
                        if (key := self._earlier("align", number))
                    ],
                )
            )  # fmt: skip
        return [
            *aligned,
            self._styled(represented, aligned, about, kept.whole_clusters),
            self.naming(represented.key),
        ]

    def _styled(
        self, represented: Task, aligned: Sequence[Task], about: Mapping[str, Any], kept: Mapping[str, str]
    ) -> Task:
        before = self._earlier_alike("style")
        kept = kept if before else {}
        batches = [
            number
            for number, batch in enumerate(self.layout.batches)
            if any(clip.clip_id in about and clip.clip_id not in kept for clip in batch)
        ]
        return Task(
            "style", self._key("style", [*about.values()]), style.style,
            reads=[("represented", [represented.key]), ("styles", _list(before))],
            streams=[
                ("ingested", [self.ingested[number].key for number in batches]),
                ("aligned", [aligned[number].key for number in batches]),
            ],
            arguments=(kept, self.config.features.conventions, self.config.features.frame_rate, self.room),
        )  # fmt: skip

    def naming(self, represented: str) -> Task:
        """Name the clusters whose references are this result."""
        return naming_task(self.clustered.key, represented, self.overrides, self.config)

    @cached_property
    def _named(self) -> list[tuple[str, str]]:
        return _named(self.overrides)

    def _key(self, stage: str, about: Any) -> str:
        return digest_of_settings(stage, self.settings[stage], about)

    def _earlier(self, stage: str, place: int = 0) -> str:
        """Return the key of an earlier result; empty where there is none."""
        keys = self.earlier.results.get(stage, ())
        key = keys[place] if place < len(keys) else ""
        return key if key and self.is_stored(key, MAKES[stage]) else ""

    def _earlier_alike(self, stage: str) -> str:
        """Return the key of a stage's earlier result, if it had these settings."""
        return self._earlier(stage) if self.earlier.settings.get(stage) == self.settings[stage] else ""

    def _carried_pairs(
        self, tile: tuple[int, int], keys: Mapping[tuple[int, int], str]
    ) -> list[tuple[str, Block]]:
        alike = self.earlier.settings.get("compare") == self.settings["compare"]
        found = []
        for block in pair_origins(tile, self.layout, self.earlier):
            if not block.origin.earlier:
                found.append((keys[block.origin.sides], block))
            elif alike and (key := self._earlier("compare", self.earlier.tile(*block.origin.sides))):
                found.append((key, block))
        return found


def naming_task(clustered: str, represented: str, overrides: pa.Table, config: PipelineConfig) -> Task:
    """Name clusters and clips.

    Parameters
    ----------
    clustered, represented : str
        The keys of the results of these stages.
    overrides : pyarrow.Table
        What people called clips: clip_id, label.
    config : PipelineConfig
        `clusters` is used.
    """
    about = (clustered, represented, _named(overrides))
    return Task(
        "name", digest_of_settings("name", stage_settings(config)["name"], about), name.name,
        reads=[("clips", [clustered]), ("represented", [represented]), ("centres", [represented])],
        arguments=(overrides, config.clusters),
    )  # fmt: skip


def _named(overrides: pa.Table) -> list[tuple[str, str]]:
    return [*_pairs(overrides, "clip_id", "label").items()]


def _pairs(table: pa.Table, one: str, other: str) -> dict[Any, Any]:
    return dict(zip(table[one].to_pylist(), table[other].to_pylist(), strict=True))


def _list(key: str) -> list[str]:
    return [key] if key else []
