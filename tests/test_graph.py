"""The graph: what depends on what, what keys cover, and how it grows."""

import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from motionary.pipeline.config import (
    AlignmentConfig,
    ClusterConfig,
    DistanceConfig,
    FeatureConfig,
    PipelineConfig,
    ReadConfig,
)
from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import Earlier, cut_by_name, lay_out, side_for
from motionary.pipeline.readers.library import FORMATS, Source
from motionary.pipeline.stage_settings import reading_settings
from motionary.pipeline.tables import TABLES
from motionary.pipeline.task import Task

NO_LABELS = pa.table({"clip_id": pa.array([], pa.string())})
NOT_SAID = TABLES["labels"].empty_table()


def library(clips: int) -> list[Source]:
    names = [f"clip-{number:05d}.bvh" for number in range(clips)]
    return [Source(name, name, "", (name,), f"digest of {name}", "bvh") for name in names]


def graph_of(sources, config=None, labels=NO_LABELS, overrides=NOT_SAID) -> LibraryGraph:
    earlier = Earlier()
    config = config or PipelineConfig()
    side = config.distances.tile or side_for(len(sources), earlier)
    layout = lay_out(sources, reading_settings(config), side, earlier)
    return LibraryGraph(layout, labels, overrides, config, earlier, lambda key, tables: True)


def tasks_of(graph: LibraryGraph) -> list[Task]:
    """All tasks, were all clips one cluster with the first as its reference."""
    members = [{"clip_id": clip.clip_id, "cluster_id": 1} for clip in graph.layout]
    rows = [
        one | {"is_reference": not place, "distance_to_reference": 0.0} for place, one in enumerate(members)
    ]
    before = TABLES["represented"].empty_table()
    represented = graph.representation(pa.Table.from_pylist(members, TABLES["members"]), before)
    references = pa.Table.from_pylist(rows, TABLES["represented"])
    return [*graph.comparison(), represented, *graph.alignment(represented, references, before)]


def keys(sources, config=None, **given) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for task in tasks_of(graph_of(sources, config, **given)):
        found.setdefault(task.stage, set()).add(task.key)
    return found


def changed(first, second) -> set[str]:
    return {stage for stage in first if first[stage] != second[stage]}


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("x_120.bvh", "y_240.bvh", True),
        ("x.bvh", "x.c3d", False),
        ("x_120.amc x.asf", "y_120.amc y.asf", True),
        ("x_120.amc x.asf", "x_240.amc x.asf", False),  # the name says the rate
        ("x.amc x.asf", "x_120.amc x.asf", False),
        ("x.amc", "y.amc", False),  # which skeleton is missing depends on the name
        ("gone.bvh", "gone-too.bvh", False),
    ],
)
def test_equal_bytes_are_read_once_where_the_name_says_nothing(one, other, same):
    def key(files: str) -> str:
        name, *_ = names = files.split()
        digest = "" if "gone" in name else "digest"
        source = Source(name, name, "", tuple(names), digest, FORMATS[Path(name).suffix])
        return lay_out([source], ["reading"], 32, Earlier()).keys[name]

    assert (key(one) == key(other)) == same


def test_tasks_follow_what_they_read():
    seen = set()
    for task in tasks_of(graph_of(library(100))):
        assert set(task.after) <= seen
        seen.add(task.key)
    counts = graph_of(library(100)).tasks_by_stage()
    assert len(seen) == sum(counts.values())


@pytest.mark.parametrize("size", [1, 2, 7, 32])
def test_batches_hold_every_clip_once_in_order(size):
    sources = library(200)
    clip_ids = [source.clip_id for source in sources]
    batches = cut_by_name(clip_ids, size)
    assert [clip for batch in batches for clip in batch] == clip_ids
    assert max(map(len, batches)) <= size + size // 2
    assert all(batches)


@pytest.mark.parametrize("size", [32, 512, 1024])
def test_batches_are_about_as_large_as_was_asked_for(size):
    batches = cut_by_name([f"{number:06}.bvh" for number in range(40 * size)], size)
    assert 0.8 * size < np.mean([len(batch) for batch in batches]) < 1.1 * size
    assert min(map(len, batches[:-1])) >= size // 2


@pytest.mark.parametrize(
    ("clips", "side"),
    [
        (1, 32),
        (113, 32),
        (1000, 128),
        (3000, 256),
        (10_000, 512),
        (29_127, 512),
        (29_128, 1024),
        (10**6, 1024),
    ],
)
def test_sides_grow_with_the_library_so_that_tiles_do_not_become_many(clips, side):
    assert side_for(clips, Earlier()) == side
    assert (clips / side) * (clips / side + 1) / 2 < max(100, clips / 2)


def test_a_side_stays_while_the_library_has_not_grown_much():
    assert side_for(1000, Earlier(side=64)) == 64
    assert side_for(3000, Earlier(side=64)) == 256
    assert side_for(300, Earlier(side=128)) == 128
    assert side_for(300, Earlier(side=512)) == 64


def test_sides_are_read_in_batches_and_tiles_read_all_of_them():
    graph = graph_of(library(500), PipelineConfig(distances=DistanceConfig(tile=128)))
    layout = graph.layout
    assert len(layout.sides) < len(layout.batches)
    assert max(map(len, layout.batches)) <= 64
    assert [clip for batch in layout.batches for clip in batch] == [*layout]
    assert [clip for side in layout.sides for clip in side] == [*layout]
    read = {table_keys for task in graph.compared for _, keys in task.reads for table_keys in keys}
    assert read == {task.key for task in graph.resampled}
    assert len(graph.compared) == len(layout.sides) * (len(layout.sides) + 1) // 2


@pytest.mark.parametrize("place", [0, 100, 199])
def test_a_clip_more_leaves_most_results_as_they_were(place):
    sources = library(200)
    fewer = sources[:place] + sources[place + 1 :]
    before, after = keys(fewer), keys(sources)
    assert len(after["ingest"] - before["ingest"]) <= 2
    kept = len(after["compare"] & before["compare"]) / len(after["compare"])
    assert kept > 0.5


AFTER = ["ingest", "resample", "compare", "cluster", "identify", "represent", "align", "style", "name"]


def from_stage(stage: str) -> set[str]:
    """The stage and what follows it."""
    return set(AFTER[AFTER.index(stage) :])


def test_keys_cover_what_matters_to_a_stage_and_what_follows():
    sources, plain = library(40), keys(library(40))

    def by(**stages) -> set[str]:
        return changed(plain, keys(sources, PipelineConfig(**stages)))

    assert changed(plain, keys(sources)) == set()
    assert by(read=ReadConfig(up="z")) == from_stage("ingest")
    assert by(features=FeatureConfig(epsilon=0.2)) == from_stage("resample") - {"align", "style"}
    assert by(features=FeatureConfig(travel_time=0.2)) == from_stage("ingest")
    assert by(distances=DistanceConfig(thresholds="random")) == from_stage("compare") - {"align", "style"}
    assert by(distances=DistanceConfig(seed=1)) == set()
    # The same clips in the same cluster need no other reference, whatever linkage found them.
    assert by(clusters=ClusterConfig(primary="complete")) == {"cluster", "identify", "name"}
    assert by(clusters=ClusterConfig(reach=2.0)) == {"cluster", "identify", "name"}
    assert by(alignment=AlignmentConfig(weights="legs")) == {"represent", "align", "style", "name"}
    assert by(alignment=AlignmentConfig(search="full")) == {"align", "style"}
    labels = pa.table({"clip_id": ["clip-00001.bvh"], "action": ["walk"]})
    assert changed(plain, keys(sources, labels=labels)) == {"cluster", "identify", "name"}
    said = [{"clip_id": "clip-00001.bvh", "digest": "", "label": "run", "set_at": None, "set_by": ""}]
    overrides = pa.Table.from_pylist(said, TABLES["labels"])
    assert changed(plain, keys(sources, overrides=overrides)) == {"cluster", "identify", "name"}
    other = [Source(s.clip_id, s.path, s.root, s.files, s.digest + "!", s.format) for s in sources[:1]]
    assert changed(plain, keys(other + sources[1:])) == set(AFTER)


def test_the_time_to_build_a_graph_grows_with_its_tasks():
    def per_task(clips: int) -> float:
        start = time.process_time()
        tasks = graph_of(library(clips)).comparison()
        return (time.process_time() - start) / len(tasks)

    per_task(200)
    # Quadratic growth would make this ratio some thirty.
    assert per_task(4000) < 8 * per_task(400)
