"""The Dask graph where not all pairs are compared: see `motionary.pipeline.clustering.landmarks`.

    files -> ingest (a batch) -> resample -> sample (a side) -> compare (two sides) -> cluster -> stand
             resample, stand -> assign (a batch)
             resample, assign -> refine (some groups) -> regroup -> identify

The rest is as in `motionary.pipeline.graph`. The three lines are built one after the other: who is nearest to
which landmarks is known when they are chosen, and what there is to refine when all clips are assigned. An
assignment is named by the contents of its batch and of the landmarks that stand for groups, a refinement by
those of its groups and by the threshold on all clips; so what stays the same from run to run is not computed
again. By Ward linkage, unless it is told, that threshold moves with the number of clips: then all is refined
anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations_with_replacement
from math import inf

import pyarrow as pa

from motionary.pipeline.clustering.landmark_steps import landmark_count, sample_clips
from motionary.pipeline.clustering.primary import threshold_on_all
from motionary.pipeline.graph import Grouped, LibraryGraph, Load
from motionary.pipeline.layout import Clip, Earlier, cut_by_name, side_for
from motionary.pipeline.stages import (
    assign,
    cluster_landmarks,
    compare,
    refine,
    regroup,
    represent_landmarks,
    sample,
    stand,
)
from motionary.pipeline.stages.cluster import TooFewClipsError
from motionary.pipeline.task import MAKES, OF_LANDMARKS, Task


class LandmarkGraph(LibraryGraph):
    """The tasks over a library whose clips are clustered by landmarks."""

    @cached_property
    def landmarks(self) -> list[Clip]:
        """The clips all pairs of which are compared, in clip_id order; some may prove not to be readable."""
        clips = sorted(self.layout, key=lambda clip: clip.clip_id)
        count = self.config.clusters.landmarks or landmark_count(len(clips))
        return [
            clips[place] for place in sample_clips([self.contents[clip.clip_id] for clip in clips], count)
        ]

    @cached_property
    def contents(self) -> dict[str, str]:
        """What every clip is drawn by: its bytes, which stay what they are when it is read again."""
        return {clip.clip_id: clip.source.digest or clip.clip_id for clip in self.layout}

    @cached_property
    def compared_sides(self) -> list[list[Clip]]:
        """The sides of the tiles of landmarks."""
        by_id = {clip.clip_id: clip for clip in self.landmarks}
        size = side_for(len(by_id), Earlier())
        sides = cut_by_name([*by_id], min(size, self.config.distances.tile or size))
        return [[by_id[clip_id] for clip_id in side] for side in sides]

    @cached_property
    def sampled(self) -> list[Task]:
        """Every side of landmarks gathered."""
        batch_of = {
            clip.clip_id: number for number, batch in enumerate(self.layout.batches) for clip in batch
        }
        return [
            Task(
                "sample", self._key("sample", _contents(side)), sample.sample, reads=(),
                streams=[("resampled", self._resampled({batch_of[clip.clip_id] for clip in side}))],
                arguments=([clip.clip_id for clip in side],),
            )
            for side in self.compared_sides
        ]  # fmt: skip

    @cached_property
    def compared(self) -> list[Task]:
        """Every tile of landmarks compared."""
        sides = [*zip(self.compared_sides, self.sampled, strict=True)]
        return [
            Task(
                "compare", self._key("compare", [_contents(one), _contents(other)]), compare.compare,
                reads=[("sampled", [first.key]), ("sampled", [second.key])],
                arguments=(self.config.distances,),
            )
            for (one, first), (other, second) in combinations_with_replacement(sides, 2)
        ]  # fmt: skip

    @cached_property
    def clustered(self) -> Task:
        """The landmarks clustered."""
        ingested = [task.key for task in self.ingested]
        about = (ingested, self.labels.to_pylist(), self._named)
        ids = [clip.clip_id for clip in self.landmarks]
        return Task(
            "cluster", self._key("cluster", about), cluster_landmarks.cluster_landmarks,
            reads=[("ingested", ingested)],
            streams=[("pairs", [task.key for task in self.compared])],
            arguments=(ids, self.labels, self.overrides, self.config.clusters),
        )  # fmt: skip

    @cached_property
    def standing(self) -> Task:
        """The landmarks chosen that stand for their clusters."""
        return Task(
            "stand", self._key("stand", self.clustered.key), stand.stand,
            reads=[("groups", [self.clustered.key])],
            streams=[
                ("pairs", [task.key for task in self.compared]),
                ("sampled", [task.key for task in self.sampled]),
            ],
            arguments=(self.config.clusters,),
        )  # fmt: skip

    @property
    def grouped(self) -> Grouped:
        """What the published groups are read from: they depend on nothing that the clusters do not."""
        return Grouped("regroup", "regrouped", self._key("regroup", self.clustered.key))

    def comparison(self) -> list[Task]:
        """List the tasks that lead to the landmarks' clusters."""
        compared = [*self.sampled, *self.compared]
        return [*self.ingested, *self.resampled, *compared, self.clustered, self.standing]

    def waves(self, load: Load) -> Iterator[list[Task]]:
        """List the tasks that lead to the clusters: of the landmarks, of all clips, of all groups."""
        yield self.comparison()
        groups = load(self.clustered.key, "groups")
        if not len(groups):
            self._refuse_without_landmarks(load)
        assigned = self._assigned(groups, load(self.standing.key, "standing", ["group", "clip_id"]))
        yield assigned
        group_of: dict[str, int] = {}
        for task in assigned:
            rows = load(task.key, "assigned", ["clip_id", "group"])
            group_of |= zip(rows["clip_id"].to_pylist(), rows["group"].to_pylist(), strict=True)
        share = len(groups) / max(len(group_of), 1)
        mu = threshold_on_all(self.config.clusters, *_published_cut(load(self.clustered.key, "cuts")), share)
        refined = self._refined(group_of, mu, len(groups))
        regrouped = Task(
            "regroup", self.grouped.key, regroup.regroup,
            reads=[
                ("groups", [self.clustered.key]), ("assigned", [task.key for task in assigned]),
                ("refined", [task.key for task in refined]),
            ],
            arguments=(),
        )  # fmt: skip
        yield [*refined, regrouped, self.identified]

    def tasks_by_stage(self) -> dict[str, int]:
        """Count the tasks of every stage."""
        counts = super().tasks_by_stage()
        own = {"sample": len(self.sampled), "assign": len(self.ingested), "refine": self._refinements}
        counts |= {stage: own.get(stage, 1) for stage in OF_LANDMARKS}
        return {stage: counts[stage] for stage in MAKES}

    def later_pairs(self) -> int:
        """Say how many pairs are compared, about, that no task of `compared` has: those inside groups."""
        done = self.is_stored(self.grouped.key, MAKES["regroup"])
        return 0 if done else len(self.layout.keys) * len(self.landmarks) // 2

    def representation(self, members: pa.Table, earlier: pa.Table) -> Task:
        """Choose the references; distances to them are computed there."""
        exact = super().representation(members, earlier)
        _, features = exact.streams
        kept, *others = exact.arguments
        return replace(
            exact, body=represent_landmarks.represent_landmarks,
            streams=[("resampled", [task.key for task in self.resampled]), features],
            arguments=(kept, self.config.distances, *others),
        )  # fmt: skip

    def _refuse_without_landmarks(self, load: Load) -> None:
        readable = sum(len(load(task.key, "ingested", ["clip_id"])) for task in self.ingested)
        if readable:
            raise TooFewClipsError(
                f"of {len(self.landmarks)} landmarks none can be read, and of the other clips {readable}; "
                "take more landmarks"
            )

    @property
    def _refinements(self) -> int:
        """How many tasks refine: each has groups of together about as many clips as there are landmarks."""
        return max(1, -(-len(self.layout.keys) // max(len(self.landmarks), 1)))

    def _assigned(self, groups: pa.Table, standing: pa.Table) -> list[Task]:
        own = dict(zip(groups["clip_id"].to_pylist(), groups["group"].to_pylist(), strict=True))
        standing_for = dict(zip(standing["clip_id"].to_pylist(), standing["group"].to_pylist(), strict=True))
        keys = self.layout.keys
        stand_for = [(keys[clip_id], group) for clip_id, group in standing_for.items()]
        made = []
        for task, batch in zip(self.resampled, self.layout.batches, strict=True):
            here = {clip.clip_id: own[clip.clip_id] for clip in batch if clip.clip_id in own}
            made.append(
                Task(
                    "assign", self._key("assign", (task.key, here, stand_for)), assign.assign,
                    reads=[("resampled", [task.key]), ("standing", [self.standing.key])],
                    arguments=(here, self.config.clusters, self.config.distances),
                )
            )  # fmt: skip
        return made

    def _refined(self, group_of: dict[str, int], mu: float, most: int) -> list[Task]:
        members: list[list[tuple[str, str]]] = [[] for _ in range(max(group_of.values(), default=-1) + 1)]
        for clip_id in sorted(group_of):
            members[group_of[clip_id]].append((clip_id, self.contents[clip_id]))
        made = []
        for number in range(self._refinements):
            some = members[number :: self._refinements]
            parted = {clip_id for group in some if refine.to_part(group, mu) for clip_id, _ in group}
            batches = {
                one
                for one, batch in enumerate(self.layout.batches)
                if any(clip.clip_id in parted for clip in batch)
            }
            keys = [self.layout.keys[clip_id] for group in some for clip_id, _ in group]
            made.append(
                Task(
                    "refine", self._key("refine", (some, keys, mu, most)), refine.refine, reads=(),
                    streams=[("resampled", self._resampled(batches))],
                    arguments=(some, self.config.clusters, self.config.distances, mu, most),
                )
            )  # fmt: skip
        return made

    def _resampled(self, batches: set[int]) -> Sequence[str]:
        return [self.resampled[number].key for number in sorted(batches)]


def _published_cut(cuts: pa.Table) -> tuple[int, float]:
    """Return how many clusters were published, and where they were cut; of no clips there is no cut."""
    for row in cuts.to_pylist():
        if row["primary"]:
            return row["published_clusters"], row["published_threshold"]
    return 0, inf


def _contents(side: Sequence[Clip]) -> list[tuple[str, str]]:
    return [(clip.clip_id, clip.key) for clip in side]
