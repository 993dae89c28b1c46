"""The graph: what depends on what, what keys cover, and how it grows."""

import time

import pyarrow as pa
import pytest

from motionary.pipeline.config import (
    AlignmentConfig,
    ClusterConfig,
    DistanceConfig,
    FeatureConfig,
    PipelineConfig,
)
from motionary.pipeline.graph import batched_by_name, build_graph
from motionary.pipeline.readers.library import Source

NO_LABELS = pa.table({"clip_id": pa.array([], pa.string())})


def library(clips: int) -> list[Source]:
    names = [f"clip-{number:05d}.bvh" for number in range(clips)]
    return [Source(name, name, "", (name,), f"digest of {name}", "bvh") for name in names]


def keys(sources, config=None, labels=NO_LABELS) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for task in build_graph(sources, labels, config or PipelineConfig(), store=None):
        found.setdefault(task.stage, set()).add(task.key)
    return found


def changed(first, second) -> set[str]:
    return {stage for stage in first if first[stage] != second[stage]}


def test_tasks_follow_what_they_read():
    seen = set()
    for task in build_graph(library(100), NO_LABELS, PipelineConfig(), store=None):
        assert set(task.reads) <= seen
        seen.add(task.key)
    assert len(seen) == len(
        {task.key for task in build_graph(library(100), NO_LABELS, PipelineConfig(), None)}
    )


@pytest.mark.parametrize("size", [1, 2, 7, 32])
def test_batches_hold_every_clip_once_in_order(size):
    sources = library(200)
    batches = batched_by_name(sources, size)
    assert [clip for batch in batches for clip in batch] == sources
    assert max(map(len, batches)) <= 2 * size
    assert all(batches)


@pytest.mark.parametrize("place", [0, 100, 199])
def test_a_clip_more_leaves_most_results_as_they_were(place):
    sources = library(200)
    fewer = sources[:place] + sources[place + 1 :]
    before, after = keys(fewer), keys(sources)
    assert len(after["ingest"] - before["ingest"]) <= 2
    kept = len(after["compare"] & before["compare"]) / len(after["compare"])
    assert kept > 0.5


def test_keys_cover_what_matters_to_a_stage_and_what_follows():
    sources, plain = library(40), keys(library(40))
    everything = {"ingest", "compare", "cluster", "represent", "align", "style"}
    assert changed(plain, keys(sources)) == set()
    assert changed(plain, keys(sources, PipelineConfig(features=FeatureConfig(epsilon=0.2)))) == everything
    drawn = PipelineConfig(distances=DistanceConfig(thresholds="random"))
    assert changed(plain, keys(sources, drawn)) == everything - {"ingest"}
    seed = PipelineConfig(distances=DistanceConfig(seed=1))
    assert changed(plain, keys(sources, seed)) == set()
    primary = PipelineConfig(clusters=ClusterConfig(primary="complete"))
    assert changed(plain, keys(sources, primary)) == {"cluster", "represent", "align", "style"}
    labels = pa.table({"clip_id": ["clip-00001.bvh"], "action": ["walk"]})
    assert changed(plain, keys(sources, labels=labels)) == {"cluster", "represent", "align", "style"}
    weighted = PipelineConfig(alignment=AlignmentConfig(weights="legs"))
    assert changed(plain, keys(sources, weighted)) == {"represent", "align", "style"}
    thorough = PipelineConfig(alignment=AlignmentConfig(search="full"))
    assert changed(plain, keys(sources, thorough)) == {"align", "style"}
    other = [Source(s.clip_id, s.path, s.root, s.files, s.digest + "!", s.format) for s in sources[:1]]
    assert changed(plain, keys(other + sources[1:])) == everything


def test_the_time_to_build_a_graph_grows_with_its_tasks():
    def per_task(clips: int) -> float:
        start = time.process_time()
        tasks = build_graph(library(clips), NO_LABELS, PipelineConfig(), store=None)
        return (time.process_time() - start) / len(tasks)

    per_task(200)
    # Quadratic growth would make this ratio some thirty.
    assert per_task(4000) < 8 * per_task(400)
