"""What a run will take: sizes, memory and its refusal, the model of time, and the command."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections import namedtuple
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.task import MAKES, OF_LANDMARKS
from motionary.workflows.costs.amounts import Amounts
from motionary.workflows.costs.calibration import Calibration, Share, Tile, calibrate
from motionary.workflows.costs.disk import needed_bytes, refuse_small_disks
from motionary.workflows.costs.made_up import Squares
from motionary.workflows.costs.memory import need_of, refuse
from motionary.workflows.costs.model import foretold_by, with_seconds
from motionary.workflows.costs.sample import sample_size
from motionary.workflows.costs.sizes import parse_size, size_text, time_text
from motionary.workflows.errors import UserError
from motionary.workflows.main_job import _processes, run
from motionary.workflows.nightly_settings import load_nightly
from motionary.workflows.preparation import Job, prepare
from motionary.workflows.settings import SettingsError

GIB = 1 << 30
STAGES = [stage for stage in MAKES if stage not in OF_LANDMARKS]


@pytest.mark.parametrize(
    ("text", "size"),
    [("4GB", 4e9), ("512MiB", 512 << 20), ("1.5 g", 1.5e9), ("100", 100), ("2TiB", 2 << 40), (" 8kB ", 8e3)],
)
def test_sizes_are_read(text, size):
    assert parse_size(text) == size


@pytest.mark.parametrize(
    "text", ["", "GB", "0", "0GB", "-4GB", "4 apples", "nan", "inf", "1e9", "4GB4", "9" * 400 + "GB"]
)
def test_what_is_no_size_is_refused_with_a_mend(text):
    with pytest.raises(ValueError, match="4GB or 512MiB"):
        parse_size(text)


def test_sizes_and_times_are_written_shortly():
    assert [size_text(size) for size in (0, 1, 2.14e9, 25e9, 3e6)] == [
        "0 kB",
        "1 kB",
        "2.1 GB",
        "25 GB",
        "3.0 MB",
    ]
    assert [time_text(one) for one in (3, 150, 7300, 200 * 3600)] == ["3 s", "2 min", "2.0 h", "8.3 days"]


def test_a_size_that_is_needed_is_rounded_up():
    sizes = (377_000_000, 377_400_000, 1_310_000_000, 9_990_000)
    assert [size_text(size, up=True) for size in sizes] == ["377 MB", "378 MB", "1.4 GB", "10.0 MB"]


def amounts(clips: int, a_clip: int = 80_000) -> Amounts:
    side = min(clips, 1 << max(5, int(np.log2(6 * clips**0.5))))
    return Amounts(
        clips,
        batch=min(clips, 64) * a_clip,
        file=a_clip,
        largest="a.bvh",
        tile=side * side,
        library=clips * a_clip,
    )


@given(st.integers(1, 200_000), st.integers(1, 64), st.integers(1, 10))
def test_more_clips_and_more_workers_need_no_less_memory(clips, workers, more):
    need = need_of(amounts(clips), workers, 64 * GIB)
    assert need_of(amounts(clips + more), workers, 64 * GIB).bytes >= need.bytes
    assert need_of(amounts(clips), workers + more, 64 * GIB).bytes >= need.bytes
    assert need.bytes >= need.base + max(need.stages.values())


def test_a_worker_of_a_running_cluster_is_one_process():
    need = need_of(amounts(1000), 8, None, "tcp://nowhere:1")
    assert (need.processes, need.workers, need.allowed) == (1, 1, None)
    assert need.bytes < need_of(amounts(1000), 8, None).bytes
    refuse(need)


def test_less_memory_leaves_tasks_less_room():
    rooms = [need_of(amounts(10_000), 2, memory).room for memory in (GIB, 3 * GIB // 2, 8 * GIB, 64 * GIB)]
    assert rooms == sorted(rooms)
    assert 0 < rooms[0] < rooms[1] < rooms[2] == rooms[3]


def test_a_refusal_tells_both_numbers_what_needs_it_and_a_mend_that_mends():
    need = need_of(amounts(10_000), 8, 2 * 10**9)
    with pytest.raises(UserError) as told:
        refuse(need)
    message = str(told.value)
    assert size_text(need.bytes, up=True) in message
    assert "2.0 GB is allowed" in message
    assert need.largest in message
    fewer = int(message.split("--workers ")[1].split(maxsplit=1)[0])
    refuse(need_of(amounts(10_000), fewer, 2 * 10**9))
    with pytest.raises(UserError):
        refuse(need_of(amounts(10_000), fewer + 1, 2 * 10**9))
    refuse(need_of(amounts(10_000), 8, parse_size(message.split("--memory ")[1])))


def test_where_one_worker_is_too_much_none_fewer_is_proposed():
    with pytest.raises(UserError, match=r"--memory [\d.]+GB$") as told:
        refuse(need_of(amounts(100), 4, 10**8))
    assert "--workers" not in str(told.value)


def test_a_run_that_needs_too_much_writes_nothing(demo_library, tmp_path, silent_progress):
    job = Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig(), memory=10**8)
    with pytest.raises(UserError, match=r"needs about .* of memory and 100 MB is allowed"):
        run(job, silent_progress)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("full", "told"), [("catalog", "out; make room"), ("temporary", "TMPDIR")])
def test_a_run_for_which_a_disk_is_too_small_writes_nothing(
    full, told, demo_library, tmp_path, monkeypatch, silent_progress
):
    usage = namedtuple("usage", "free")
    monkeypatch.setattr(
        "motionary.workflows.costs.disk.shutil.disk_usage",
        lambda path: usage(1000 if (Path(path) == tmp_path) == (full == "catalog") else 10**12),
    )
    with pytest.raises(UserError, match="1 kB is free") as refused:
        run(Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig()), silent_progress)
    assert told in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_the_overview_page_needs_room_where_nothing_else_does(demo_library, tmp_path):
    ready = prepare(Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig()))
    nothing = replace(ready.plan, to_read=0, to_store=0)
    assert needed_bytes(ready.amounts, nothing) > 4.9e6


def test_a_plan_without_room_for_its_trial_names_the_folder(demo_library, tmp_path, monkeypatch):
    def full(*arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("motionary.workflows.costs.calibration.run_task", full)
    with pytest.raises(UserError, match="set TMPDIR"):
        calibrate(prepare(Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig())).graph)


@pytest.mark.parametrize("full", ["catalog", "temporary"])
def test_a_disk_too_small_for_all_pairs_has_fewer_proposed(full, demo_library, tmp_path, monkeypatch):
    ready = prepare(Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig()))
    many = replace(ready.plan, to_store=10_000 * 9_999 // 2)
    need = need_of(amounts(10_000), 2, 64 * GIB)
    usage = namedtuple("usage", "free")
    monkeypatch.setattr(
        "motionary.workflows.costs.disk.shutil.disk_usage",
        lambda path: usage(10**8 if (Path(path) == tmp_path) == (full == "catalog") else 10**12),
    )
    with pytest.raises(UserError, match="or compare fewer pairs: --landmarks auto"):
        refuse_small_disks(ready.store, amounts(10_000), many, need)
    refuse_small_disks(ready.store, amounts(10_000), replace(many, to_store=0), need)
    near = replace(amounts(10_000), pruned=True)
    refuse_small_disks(ready.store, near, many, need_of(near, 2, 64 * GIB))


MEASURED = Calibration(
    clips=35, quarantined=0, bytes=35 * 20_000, source_frames=3081, frames=2324, merged_frames=606, pairs=595,
    stages={stage: Share(1.0, 10_000) for stage in STAGES},
    tile=Tile(alone=5e-3, batch=2e-3, pair=2e-5, disk=3000, pair_disk=40),
    squares=Squares(((400, 0.2), (1200, 1.0)), passing=1e-7, similarity=2e-8),
    clusters=8, concentration=0.2, starting=5.0, seconds=10.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def ready(demo_library):
    return prepare(
        Job([str(demo_library)], str(demo_library.parent / "nowhere"), PipelineConfig(), workers=2)
    )


def test_more_workers_take_no_longer_and_leave_what_does_not_divide(ready):
    told = foretold_by(ready, MEASURED)
    assert [one.workers for one in told.elapsed] == [1, 2, 8, 64]
    divided = [one.seconds for one in told.elapsed[1:]]
    assert divided == sorted(divided, reverse=True)
    assert all(one.undivided <= one.seconds for one in told.elapsed)
    assert told.seconds == told.elapsed[1].seconds


def test_the_whole_library_is_counted(ready):
    told = foretold_by(ready, MEASURED)
    assert (told.clips, told.pairs) == (80, 3160)
    by_stage = {one.stage: one for one in told.stages}
    assert list(by_stage) == STAGES
    assert by_stage["compare"].tasks == len(ready.graph.compared)
    assert by_stage["align"].seconds == pytest.approx(80 / 35)
    assert told.disk == sum(one.disk for one in told.stages)


def test_landmarks_are_foretold_to_take_less(demo_library, tmp_path):
    config = PipelineConfig(clusters=ClusterConfig(landmarks=20), distances=DistanceConfig(pairs="landmarks"))
    whole = Job([str(demo_library)], str(tmp_path / "out"), PipelineConfig())
    one, other = (foretold_by(prepare(job), MEASURED) for job in (whole, replace(whole, config=config)))
    assert [stage.stage for stage in other.stages] == [*MAKES]
    assert other.plan.to_compare == 20 * 19 // 2 + 80 * 20 // 2
    assert (other.plan.to_store, one.plan.to_store) == (20 * 19 // 2, 80 * 79 // 2)
    seconds, disk, memory = (
        {stage.stage: getattr(stage, what) for stage in other.stages}
        for what in ("seconds", "disk", "memory")
    )
    assert seconds["refine"] >= MEASURED.tile.pair * 800
    assert seconds["assign"] / seconds["refine"] == pytest.approx(80 * 4 * 8 / 800)
    assert disk["compare"] == pytest.approx(190 * MEASURED.tile.pair_disk + MEASURED.tile.disk)
    assert min(memory.values()) > 0
    assert other.disk < one.disk


def test_what_landmarks_take_of_memory_and_disk_goes_with_the_landmarks(demo_library, tmp_path):
    few, many = (
        prepare(
            Job(
                [str(demo_library)],
                str(tmp_path / "out"),
                PipelineConfig(
                    clusters=ClusterConfig(landmarks=count), distances=DistanceConfig(pairs="landmarks")
                ),
            )
        )
        for count in (10, 70)
    )
    assert few.amounts.tile == 10 * 10 < many.amounts.tile
    assert needed_bytes(few.amounts, few.plan) < needed_bytes(many.amounts, many.plan)
    large = replace(amounts(100_000), landmarks=6_000, tile=512 * 512)
    need = need_of(large, 2, 64 * GIB)
    assert need.stages["stand"] > 8 * 6_000**2
    assert need.stages["refine"] > 8 * 6_000**2
    assert need.stages["compare"] < need_of(amounts(100_000), 2, 64 * GIB).stages["compare"]


def test_a_file_that_is_too_large_is_named():
    large = replace(amounts(100), file=30 * 10**9, largest="takes/huge.bvh")
    with pytest.raises(UserError, match=r"ingest of takes/huge.bvh 4.. GB; take that file out or allow more"):
        refuse(need_of(large, 1, 25 * 10**9))


def test_few_workers_work_alone_where_they_would_be_done_before_others_are_up(ready):
    def processes(workers: int, seconds: float | None) -> int:
        job = replace(ready, job=replace(ready.job, workers=workers))
        return _processes(replace(job, plan=replace(ready.plan, seconds=seconds)))

    assert (processes(2, 3.0), processes(2, 5.0)) == (1, 2)
    assert (processes(64, 0.05), processes(64, 3.9)) == (1, 64)
    assert (processes(1, 100.0), processes(4, None)) == (1, 4)


def test_what_near_pairs_take_is_not_known_before(demo_library, tmp_path):
    config = PipelineConfig(
        clusters=ClusterConfig(primary="complete", threshold=0.2), distances=DistanceConfig(pairs="pruned")
    )
    told = foretold_by(prepare(Job([str(demo_library)], str(tmp_path / "out"), config)), MEASURED)
    assert told.memory.scratch == 0
    assert "by how many pairs prove to be near" in str(told)


def test_work_grows_with_what_was_measured(ready):
    slow = replace(
        MEASURED,
        tile=replace(MEASURED.tile, pair=2e-3),
        squares=Squares(((400, 2.0), (1200, 10.0)), 1e-6, 1e-6),
    )
    few, many = foretold_by(ready, MEASURED), foretold_by(ready, slow)
    for stage, one, other in zip(STAGES, few.stages, many.stages, strict=True):
        assert (other.seconds > one.seconds) == (stage in ("compare", "cluster", "represent"))


def test_what_is_stored_costs_nothing(demo_library, demo_catalog):
    labels = demo_library / "labels.csv"
    there = prepare(Job([str(demo_library)], demo_catalog, PipelineConfig(), labels, workers=2))
    told = foretold_by(there, MEASURED)
    assert told.work == 0
    assert told.disk == 0
    assert told.plan.to_read == 0


def test_what_is_clustered_otherwise_may_be_aligned_anew(demo_library, demo_catalog):
    five = PipelineConfig(clusters=ClusterConfig(n_clusters=5))
    there = prepare(Job([str(demo_library)], demo_catalog, five, demo_library / "labels.csv"))
    told = {one.stage: one for one in foretold_by(there, MEASURED).stages}
    assert told["ingest"].seconds == told["compare"].seconds == 0
    assert told["align"].seconds == pytest.approx(80 / 35)
    assert (
        there.plan.seconds
        > dict(there.store.read(there.before.tables["runs"])["stage_seconds"][-1].as_py())["align"] / 2
    )


def test_a_dry_run_is_refused_like_the_run(demo_library, motionary, tmp_path):
    options = (demo_library, tmp_path / "out", "--memory", "100MB")
    dry, real = (motionary("run", *options, *more) for more in (("--dry-run",), ()))
    assert (dry[0], dry[2]) == (real[0], real[2])
    assert dry[0] == 1
    assert "clips: 80 new" in dry[1]


def test_the_calibration_runs_every_stage_and_leaves_nothing(ready, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    measured = calibrate(ready.graph)
    assert measured.clips == sample_size(80)
    assert measured.pairs == measured.clips * (measured.clips - 1) // 2
    assert all(share.seconds > 0 and share.disk > 0 for share in measured.stages.values())
    assert min(measured.tile.pair, measured.squares.passing, measured.squares.similarity) > 0
    assert 0 < measured.concentration <= 1
    assert not list(tmp_path.iterdir())
    told = foretold_by(ready, measured)
    frames = 5364  # of all 80 clips at the common rate
    assert told.frames == pytest.approx(frames, rel=0.2)


@pytest.mark.parametrize(("clips", "broken"), [(1, 0), (0, 3)])
def test_of_too_few_clips_there_is_no_plan(demo_library, tmp_path, clips, broken):
    for number, file in enumerate(sorted(demo_library.rglob("*.bvh"))[:clips]):
        (tmp_path / f"{number}.bvh").write_bytes(file.read_bytes())
    for number in range(broken):
        (tmp_path / f"broken-{number}.bvh").write_text(f"HIERARCHY {number}")
    graph = prepare(Job([str(tmp_path)], str(tmp_path / "out"), PipelineConfig())).graph
    said = f"of {clips + broken} clips that were tried, {clips} can be read, and a plan takes two"
    with pytest.raises(UserError, match=said):
        calibrate(graph)


def test_a_plan_that_is_ended_leaves_nothing(demo_library, tmp_path):
    program = "from motionary.workflows.cli import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, "plan", str(demo_library)],
        env=os.environ | {"TMPDIR": str(tmp_path)}, stderr=subprocess.PIPE,
    )  # fmt: skip
    deadline = time.monotonic() + 60
    while len([*tmp_path.glob("motionary-plan-*")]) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.terminate()
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("mu", [1e-9, 0.15])
def test_the_calibration_counts_pairs_that_are_left_out(demo_library, tmp_path, mu):
    config = PipelineConfig(
        clusters=ClusterConfig(primary="complete", threshold=mu), distances=DistanceConfig(pairs="pruned")
    )
    ready = prepare(Job([str(demo_library)], str(tmp_path / "out"), config))
    measured = calibrate(ready.graph)
    assert measured.pairs == measured.clips * (measured.clips - 1) // 2
    assert min(measured.tile.pair, measured.squares.passing) > 0
    assert measured.tile.pair_disk < 20  # of some 40 bytes, where all are kept
    assert foretold_by(ready, measured).seconds > 0


def test_the_command_says_it_all(demo_library, motionary, monkeypatch, tmp_path):
    monkeypatch.setattr("motionary.workflows.costs.model.calibrate", lambda graph, compiling: MEASURED)
    code, out, err = motionary("plan", demo_library, "--workers", 2, "--memory", "4GB")
    assert code == 0
    assert "trying 35 of 80 clips" in err
    for word in ("80 clips", "3,160 pairs", "of 4.0 GB allowed", "compare", "undivided", "disk:"):
        assert word in out
    code, out, err = motionary("plan", demo_library, tmp_path / "out", "--workers", 3, "--json")
    told = json.loads(out)
    assert {"seconds", "work", "disk", "memory", "pairs", "stages", "elapsed", "plan"} <= set(told)
    assert [one["workers"] for one in told["elapsed"]] == [1, 2, 3, 8, 64]
    assert told["room_on_disk"] > 0
    assert not (tmp_path / "out").exists()


def test_a_size_that_is_none_is_a_usage_error(demo_library, motionary):
    code, _, err = motionary("run", demo_library, "nowhere", "--memory", "lots")
    assert code == 2
    assert "4GB" in err
    assert not Path("nowhere").exists()


def test_a_dry_run_tells_both_numbers(demo_library, motionary, tmp_path):
    code, out, _ = motionary("run", demo_library, tmp_path / "out", "--dry-run", "--memory", "4GB")
    assert code == 0
    assert "of 4.0 GB allowed" in out


def test_the_nightly_job_has_a_limit_of_memory(tmp_path):
    text = '[job]\nlibraries = "takes"\ncatalog = "catalog"\nmemory = "{}"\n'
    (tmp_path / "nightly.toml").write_text(text.format("4GB"))
    assert load_nightly(tmp_path / "nightly.toml").job.memory == 4 * 10**9
    (tmp_path / "wrong.toml").write_text(text.format("much"))
    with pytest.raises(SettingsError, match=r"wrong.toml: .*job.memory.*512MiB"):
        load_nightly(tmp_path / "wrong.toml")


def test_only_large_first_runs_are_foretold_before_they_start(ready, monkeypatch):
    monkeypatch.setattr("motionary.workflows.costs.model.calibrate", lambda graph, compiling: MEASURED)
    assert with_seconds(ready, print, print) is ready
    monkeypatch.setattr("motionary.workflows.costs.model._WORTH_IT", 80)
    assert with_seconds(ready, print, print).plan.seconds == foretold_by(ready, MEASURED).seconds
