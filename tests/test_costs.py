"""The arithmetic of what a run costs: memory, disk, the sample, and from the sample to the library."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.catalog.store import Store
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.graph import ROOM
from motionary.pipeline.layout import Clip, Layout
from motionary.pipeline.readers.library import FileState, Source
from motionary.pipeline.tables import TABLES
from motionary.pipeline.task import MAKES
from motionary.workflows.costs import calibration, made_up
from motionary.workflows.costs.amounts import Amounts, clip_sizes
from motionary.workflows.costs.calibration import Calibration, Share, Tile, calibrate
from motionary.workflows.costs.disk import needed_bytes
from motionary.workflows.costs.made_up import Squares, time_squares
from motionary.workflows.costs.memory import need_of
from motionary.workflows.costs.model import affected, foretold_by
from motionary.workflows.costs.sample import sample_size, sampled
from motionary.workflows.costs.sizes import time_text
from motionary.workflows.preparation import Job, Prepared, prepare

MEGABYTE = 10**6
LIBRARY = Amounts(
    clips=10_000,
    batch=10 * MEGABYTE,
    file=2 * MEGABYTE,
    largest="a.bvh",
    tile=40_000,
    library=4000 * MEGABYTE,
)
"""Its poses are 1200 MB, those of its largest cluster 300."""

BASE = 140e6 + 10_000 * 15e3
ROOM_FOR_TASKS = {  # allowed beside the base and 64 MB, and what `represent` then holds of poses
    "more than the library's": (2000e6, ROOM),
    "less than the library's": (500e6, 500e6),
    "less than a cluster's": (100e6, 300e6),
}


def test_the_memory_of_every_stage_is_this_arithmetic():
    need = need_of(LIBRARY, 1, round(BASE + 200e6 + 64e6 + 500e6))
    assert (need.base, need.room, need.processes) == (BASE + 200e6, 500e6, 1)
    assert need.stages == {
        "ingest": 30e6 + 3 * 10e6 + 16 * 2e6,
        "resample": 30e6 + 3 * 10e6,
        "compare": 30e6 + 500 * 40_000,
        "cluster": 30e6 + 8e3 * 10_000 + 10_000**2 / 16,
        "identify": 30e6 + 600 * 10_000,
        "represent": 30e6 + 600 * 10_000 + 500e6,
        "name": 30e6 + 600 * 10_000,
        "align": 30e6 + 3 * 10e6 + 600 * 10_000,
        "style": 30e6 + 2.6e3 * 10_000 + (13e3 + 62e3) * 10_000 / 4,
        "publish": 30e6 + 80e6,
    }
    assert need.bytes == need.base + need.stages["represent"]
    assert need.scratch == 16 * 10_000 * 9_999 / 2


@pytest.mark.parametrize(("allowed", "poses"), ROOM_FOR_TASKS.values(), ids=ROOM_FOR_TASKS)
def test_poses_take_their_room_and_no_less_than_the_largest_clusters(allowed, poses):
    need = need_of(LIBRARY, 1, round(BASE + 200e6 + 64e6 + allowed))
    assert need.stages["represent"] == 30e6 + 600 * 10_000 + poses


def test_few_poses_do_not_fill_their_room():
    few = replace(LIBRARY, library=400 * MEGABYTE)
    assert need_of(few, 1, 10**10).stages["represent"] == 30e6 + 600 * 10_000 + 0.3 * 400e6


def test_the_memory_of_landmarks_and_four_workers_is_this_arithmetic():
    need = need_of(replace(LIBRARY, landmarks=3_000), 4, 10**10)
    assert (need.processes, need.base) == (5, BASE + 5 * 200e6)
    by_stage = {
        "cluster": 30e6 + 8e3 * 3_000 + 600 * 7_000 + 3_000**2 / 16,
        "sample": 30e6 + 3 * 10e6,
        "assign": 30e6 + 3 * 10e6,
        "stand": 30e6 + 8 * 3_000**2,
        "refine": 30e6 + 8 * 3_000**2,
        "regroup": 30e6 + 600 * 10_000,
    }
    assert {stage: need.stages[stage] for stage in by_stage} == by_stage
    assert need.stages["represent"] == 30e6 + 600 * 10_000 + ROOM
    assert need.bytes == need.base + need.stages["represent"]
    assert need.scratch == 16 * 3_000 * 2_999 / 2 + 4 * 8 * 3_000**2 + 0.1 * 4000e6
    small = need_of(replace(LIBRARY, landmarks=3_000, library=MEGABYTE), 4, 10**10)
    assert small.bytes == small.base + 4 * small.stages["refine"]


def clips_of(sizes: Sequence[int], start: int = 0) -> list[Clip]:
    names = [f"{number:05d}.bvh" for number in range(start, start + len(sizes))]
    sources = [
        Source(name, name, "", (name,), name, "bvh", (FileState(name, size, 0, 0, 0),))
        for name, size in zip(names, sizes, strict=True)
    ]
    return [Clip(source, source.clip_id) for source in sources]


def sizes_in(clips: Sequence[Clip]) -> list[int]:
    return sorted(clip.source.states[0].size for clip in clips)


@given(st.lists(st.integers(1, 10**6), min_size=1, max_size=500))
def test_a_sample_is_of_different_clips_of_all_sizes(sizes):
    layout = Layout([[clips_of(sizes)]])
    drawn = [clip for clip in sampled(layout, clip_sizes(layout))]
    assert len({clip.clip_id for clip in drawn}) == len(drawn) == sample_size(len(sizes))
    ranks = sorted(sorted(sizes).index(clip.source.states[0].size) for clip in drawn)
    stretch = len(sizes) / len(drawn)
    # Equal sizes share the lowest rank of them.
    assert all(rank <= (place + 1) * stretch for place, rank in enumerate(ranks))


def test_each_batch_of_a_sample_is_of_all_sizes_whatever_the_names():
    layout = Layout([[clips_of([37 * number % 300 for number in range(300)])]])
    drawn = sampled(layout, {clip.clip_id: clip.source.states[0].size for clip in layout})
    ends = np.arange(70) * 300 // 69
    stretches = np.searchsorted(ends, sizes_in([*drawn]), side="right") - 1
    assert stretches.tolist() == [*range(69)]
    of_batches = [np.searchsorted(ends, sizes_in(batch), side="right") - 1 for batch in drawn.batches]
    assert [one.tolist() for one in of_batches] == [[*range(start, 69, 4)] for start in range(4)]


def test_what_lies_in_a_zip_has_its_share_of_it(tmp_path):
    archive = tmp_path / "all.zip"
    archive.write_bytes(b"x" * 1000)
    names = [f"{archive}/{number}.bvh" for number in range(4)]
    states = [(FileState(name, 1000, 0, 0, 0),) for name in names]
    sources = [Source(n, n, "", (n,), n, "bvh", state) for n, state in zip(names, states, strict=True)]
    sizes = clip_sizes(Layout([[[Clip(source, source.clip_id) for source in sources]]]))
    assert set(sizes.values()) == {1000}  # four times a zip's bytes, among four


SAMPLE = Calibration(
    clips=20, quarantined=5, bytes=0, source_frames=3000, frames=2000, merged_frames=600, pairs=105,
    stages={stage: Share(0.1 * (place + 1), 1000 * (place + 1)) for place, stage in enumerate(MAKES)},
    tile=Tile(alone=0.01, batch=4e-3, pair=2e-4, disk=3000, pair_disk=40),
    squares=Squares(((400, 0.5), (1200, 1.8)), passing=1e-5, similarity=2e-6),
    clusters=8, concentration=0.2, starting=5.0, seconds=10.0,
)  # fmt: skip


def prepared(library: object, catalog: object, clusters: ClusterConfig, pairs: str) -> Prepared:
    """Prepare a job of two workers whose tiles are small, so that there are many."""
    config = PipelineConfig(clusters=clusters, distances=DistanceConfig(pairs=pairs, tile=8))
    return prepare(Job([str(library)], str(catalog), config, workers=2))


def twice_as_long(ready: Prepared, **changes: object) -> Calibration:
    """Return a sample of a quarter of the clips, half as long as those of the library."""
    return replace(SAMPLE, bytes=ready.amounts.library / 8, **changes)


@pytest.fixture(scope="module")
def ready(demo_library):
    return prepared(demo_library, demo_library.parent / "nowhere", ClusterConfig(), "all")


def test_the_model_of_a_run_is_this_arithmetic(ready):
    sample = twice_as_long(ready)
    own = sample.stages
    told = foretold_by(ready, sample, listing=0.5)
    pairs = 60 * 59 / 2  # of 80 clips a quarter cannot be read
    assert (told.pairs, told.source_frames, told.frames, told.merged_frames) == (pairs, 24_000, 16_000, 4800)

    by_stage = {one.stage: one for one in told.stages}
    batches, sides = len(ready.graph.layout.batches), len(ready.graph.layout.sides)
    tiles = sides * (sides + 1) // 2
    read = 2 * sum(map(len, ready.graph.layout.batches_of_side)) + (sides - 1) * batches
    assert {stage: one.tasks for stage, one in by_stage.items()} == {
        "ingest": batches, "resample": batches, "compare": tiles, "cluster": 1, "identify": 1, "represent": 1,
        "align": batches, "style": 1, "name": 1,
    }  # fmt: skip
    square = (1.8 - 0.5) / (1200**2 - 400**2)
    assert {stage: one.seconds for stage, one in by_stage.items()} == pytest.approx(
        {
            "ingest": 8 * own["ingest"].seconds,
            "resample": 8 * own["resample"].seconds,
            "compare": 0.01 * tiles + 2 * 4e-3 * read + 2**2 * 2e-4 * pairs,
            "cluster": 0.5 - square * 400**2 + square * 60**2,
            "identify": own["identify"].seconds,
            "represent": 4 * own["represent"].seconds
            + 1e-5 * pairs
            + 2e-6 * 0.2 * 60**2 * 2 * sample.frames / 15,
            "align": 4 * own["align"].seconds,
            "style": 4 * own["style"].seconds,
            "name": own["name"].seconds,
        }
    )
    disk = {stage: 4 * own[stage].disk for stage in by_stage}
    disk |= {"ingest": 8 * own["ingest"].disk, "resample": 8 * own["resample"].disk}
    disk["compare"] = 3000 * tiles + 40 * pairs
    assert {stage: one.disk for stage, one in by_stage.items()} == pytest.approx(disk)


@pytest.mark.parametrize(
    ("workers", "of_batches", "of_tiles", "slower", "more"),
    [
        (1, 1, 1, 1, 0),
        (2, 6 / 12, 1 / 2, 1.1, 4),
        (8, 2 / 12, 1 / 8, 1.1, 4),
        (64, 1 / 12, 2 / 78, 1.1, 4),
    ],
)
def test_the_clock_of_a_run_is_this_arithmetic(ready, workers, of_batches, of_tiles, slower, more):
    told = foretold_by(ready, twice_as_long(ready), listing=0.5)
    seconds = {one.stage: one.seconds for one in told.stages}
    assert [one.tasks for one in told.stages] == [12, 12, 78, 1, 1, 1, 12, 1, 1]
    (elapsed,) = [one for one in told.elapsed if one.workers == workers]
    one_task = sum(seconds[stage] for stage in ("cluster", "identify", "represent", "style", "name"))
    undivided = 0.5 + 5 + 2 + 3e-4 * 80 + more + 2e-3 * 119 + one_task
    divided = of_batches * (seconds["ingest"] + seconds["resample"] + seconds["align"])
    divided += of_tiles * seconds["compare"]
    assert elapsed.undivided == pytest.approx(undivided)
    assert elapsed.seconds == pytest.approx(undivided + slower * divided)
    last = [line.split() for line in str(told).splitlines() if line.startswith(f"{workers} ")][-1]
    assert " ".join(last) == f"{workers} {time_text(elapsed.seconds)} {time_text(elapsed.undivided)}"


def test_the_model_of_landmarks_is_this_arithmetic(demo_library, tmp_path):
    there = prepared(demo_library, tmp_path / "out", ClusterConfig(landmarks=20), "landmarks")
    sample = twice_as_long(there, quarantined=0)
    told = {one.stage: one for one in foretold_by(there, sample).stages}
    square = (1.8 - 0.5) / (1200**2 - 400**2)
    expected = {
        "compare": 0.01 * 6 + 2 * 4e-3 * 12 + 2**2 * 2e-4 * 190,
        "cluster": 0.5 - square * 400**2 + square * 20**2,
        "assign": 2**2 * 2e-4 * 80 * 4 * 8,
        "refine": 2**2 * 2e-4 * 800,
        "represent": 4 * sample.stages["represent"].seconds + 2e-6 * 0.2 * 80**2 * 2 * sample.frames / 20,
    }
    assert {stage: told[stage].seconds for stage in expected} == pytest.approx(expected)
    assert told["compare"].disk == 3000 * 6 + 40 * 190


def test_what_is_affected_is_the_clusters_of_what_comes_and_goes(demo_library, demo_catalog):
    there = prepare(Job([str(demo_library)], demo_catalog, PipelineConfig(), demo_library / "labels.csv"))
    clusters = there.store.rows(there.before.tables["references"])

    def share(**counts: int) -> float:
        return affected(replace(there, plan=replace(there.plan, **counts)))

    assert [share(), share(new=1), share(changed=1), share(removed=1)] == [0] + 3 * [1 / clusters]
    assert share(new=1, changed=1, removed=1) == pytest.approx(3 / clusters)
    assert share(new=1000) == 1


def test_the_largest_batch_and_clip_are_found(ready):
    first, second, third = clips_of([1, 20, 9]), clips_of([5, 5, 5], 3), clips_of([12], 6)
    found = Amounts.of(replace(ready.graph, layout=Layout([[first, second], [third]])))
    assert (found.clips, found.batch, found.library) == (7, 30, 57)
    assert (found.file, found.largest) == (20, "00001.bvh")
    assert found.tile == 6 * 1


def test_the_disk_of_a_run_is_this_arithmetic(ready):
    plan = replace(ready.plan, to_read=2_500, to_store=6_000)
    assert needed_bytes(LIBRARY, plan) == 0.65 * 4000e6 / 4 + 40 * 6_000 + 5e6
    assert needed_bytes(replace(LIBRARY, pruned=True), plan) == 0.65 * 4000e6 / 4 + 5e6


def test_a_calibration_counts_what_cannot_be_read_and_takes_the_fastest_of_repeats(
    demo_library, tmp_path, monkeypatch
):
    for number, file in enumerate(sorted(demo_library.rglob("*.bvh"))[::10]):
        (tmp_path / f"{number}.bvh").write_bytes(file.read_bytes())
    (tmp_path / "broken.bvh").write_text("HIERARCHY")
    run_task, took = calibration.run_task, {"-0": 3.0, "-1": 1.0, "-2": 2.0}
    monkeypatch.setattr(
        calibration,
        "run_task",
        lambda task, store: replace(run_task(task, store), seconds=took.get(task.key[-2:], 7.0)),
    )
    monkeypatch.setattr(calibration, "time_squares", lambda *arguments: SAMPLE.squares)
    measured = calibrate(prepare(Job([str(tmp_path)], str(tmp_path / "out"), PipelineConfig())).graph)
    assert (measured.clips, measured.quarantined, measured.pairs) == (9, 1, 8 * 7 // 2)
    assert measured.stages["cluster"].seconds == 7
    assert measured.tile.alone == pytest.approx(1 - 2 * measured.tile.batch)
    assert measured.tile.pair <= 1 / measured.pairs
    assert measured.clusters > 1
    assert 1 / measured.clusters <= measured.concentration < 1


def test_copies_lie_as_far_apart_as_the_clips_they_are_of(tmp_path, monkeypatch):
    seen = {}
    monkeypatch.setattr(made_up, "CLIPS", (4, 7))
    monkeypatch.setattr(
        made_up,
        "cluster",
        lambda clips, parts, *more: seen.update({len(clips): pa.concat_tables(parts.read())}),
    )
    ingested = pa.table({"clip_id": ["a", "b", "c"]}, pa.schema([TABLES["ingested"].field("clip_id")]))
    values = pa.array([1, 2, 4], pa.float32())
    rows = dict.fromkeys(("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high"), values)
    rows |= {"clip_a": ["a", "a", "b"], "clip_b": ["b", "c", "c"], "curve": 3 * [8 * [0.0]]}
    pairs = pa.table(rows, TABLES["pairs"])
    features = pa.table({"feature": pa.array(np.zeros((3, 200)).tolist(), pa.list_(pa.float32()))})
    time_squares(Store(str(tmp_path)), ingested, pairs, features, PipelineConfig())
    far = np.array([[0, 1, 2], [1, 0, 4], [2, 4, 0]])
    for count in (4, 7):
        i, j = (np.triu_indices(count, 1)[side] % 3 for side in (0, 1))
        beyond = seen[count]["weighted"].to_numpy() - far[i, j]
        assert beyond.min() >= -1e-6
        assert beyond.max() <= 0.05 * far.mean() + 1e-6
