"""That `make scale` measures what it says, and that its model is the arithmetic that it prints."""

import json
import subprocess
import sys
import time
from dataclasses import replace
from io import StringIO
from itertools import combinations

import numpy as np
import pytest
from rich.console import Console

from tests.benchmarks import scale, scale_run
from tests.benchmarks.process_tree import TreePeak, Watch, tree, watched
from tests.benchmarks.scale_graph import GraphSize, graph_of
from tests.benchmarks.scale_kernel import cells_of_all_pairs
from tests.benchmarks.scale_model import (
    REST,
    fitted,
    fitted_sum,
    growth_by_stage,
    model,
    seconds_by_stage,
)
from tests.benchmarks.scale_report import checked, figures, large_tables, off_by, print_model, print_runs
from tests.benchmarks.scale_run import Measured, Route

MEBIBYTE = 2**20
# A process that starts another, which fills memory, says so, and waits until it is let go.
FILLS = "data = bytearray(b'x') * (150 * 2**20); print('full', flush=True); input()"
STARTS = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {FILLS!r}])"


def run_of(clips: int) -> Measured:
    """Make up a run in which everything goes by a power: 1 for reading, 2 for pairs."""
    pairs = clips * (clips - 1) // 2
    stages = {"ingest": 0.02 * clips, "compare": 2e-5 * pairs, "cluster": 1e-6 * clips**2, "name": 0.0}
    return Measured(
        route=Route(), clips=clips, pairs_computed=pairs, clusters=8, frames=70 * clips,
        merged_frames=20 * clips, workers=2,
        seconds=5 + stages["cluster"] + (stages["ingest"] + stages["compare"]) / 2,
        stages=stages, peak=TreePeak(3 * 10**9, int(2e8 + 1e4 * clips + 5 * clips**2), 3, 50),
        library=76_000 * clips, tables={"pairs": 50 * pairs, "frames": 26_000 * clips, "runs": 1000},
        kernel=1.6e-5, foretold=None,
    )  # fmt: skip


RUNS = [run_of(clips) for clips in (300, 1_000, 3_000, 10_000)]
GRAPH = GraphSize(1024, {"ingest": 5000, "compare": 10_000, "cluster": 1}, 7 * 10**7)


@pytest.fixture
def child_that_fills_memory():
    process = subprocess.Popen(
        [sys.executable, "-c", STARTS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "full\n"
    yield process
    process.communicate("\n", timeout=60)


@pytest.mark.skipif(sys.platform != "linux", reason="measured on Linux only")
def test_memory_of_a_processs_child_is_seen_from_outside(child_that_fills_memory):
    watch = Watch(child_that_fills_memory.pid)
    watch.sample()
    assert watch.peak.processes == len(tree(child_that_fills_memory.pid)) == 2
    assert 150 * MEBIBYTE < watch.peak.own <= watch.peak.total < 250 * MEBIBYTE


@pytest.mark.skipif(sys.platform != "linux", reason="measured on Linux only")
def test_a_thread_samples_until_the_block_ends(child_that_fills_memory):
    with watched(child_that_fills_memory.pid) as watch:
        deadline = time.monotonic() + 60
        while watch.peak.samples < 2 and time.monotonic() < deadline:
            time.sleep(0.05)
    samples = watch.peak.samples
    assert samples >= 2
    assert watch.peak.own > 150 * MEBIBYTE
    time.sleep(0.3)
    assert watch.peak.samples == samples


@pytest.mark.skipif(sys.platform != "linux", reason="measured on Linux only")
def test_mapped_files_are_told_apart(tmp_path):
    file = tmp_path / "large"
    file.write_bytes(b"x" * (64 * MEBIBYTE))
    maps = (
        "import mmap, sys; f = open(sys.argv[1], 'rb'); m = mmap.mmap(f.fileno(), 0, prot=mmap.PROT_READ);"
        "print(sum(m[i] for i in range(0, len(m), 4096)), flush=True); input()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", maps, str(file)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    process.stdout.readline()
    watch = Watch(process.pid)
    watch.sample()
    process.communicate("\n", timeout=60)
    assert watch.peak.total - watch.peak.own > 60 * MEBIBYTE
    assert watch.peak.own < 60 * MEBIBYTE


def test_a_process_that_has_ended_holds_nothing():
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    watch = Watch(process.pid)
    watch.sample()
    assert watch.peak == TreePeak(0, 0, 0, 1)


def test_a_peak_is_the_most_of_each():
    peak = TreePeak().with_sample(5, 4, 1).with_sample(9, 2, 3).with_sample(1, 1, 1)
    assert peak == TreePeak(9, 4, 3, 3)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.7, 2.0])
def test_the_exponent_of_a_power_is_found(exponent):
    sizes = [300, 1_000, 3_000, 10_000]
    growth = fitted(sizes, [0.3 * n**exponent for n in sizes])
    assert growth.exponent == pytest.approx(exponent, abs=1e-9)
    assert growth.at(142_000) == pytest.approx(0.3 * 142_000**exponent)


def test_nothing_measured_is_passed_over_and_one_size_has_no_exponent():
    assert fitted([1, 2, 4], [0.0, 2.0, 4.0]).exponent == pytest.approx(1)
    assert fitted([1, 2, 4], [0.0, 0.0, 0.0]).at(100) == 0
    assert np.isnan(fitted([80], [1.0]).exponent)


def test_a_sum_of_a_constant_clips_and_pairs_goes_on():
    sizes = [300, 1_000, 3_000, 10_000]

    def memory(n):
        return 2e8 + 1e4 * n + 5 * n**2

    assert fitted_sum(sizes, [memory(n) for n in sizes], 142_000) == pytest.approx(memory(142_000), rel=1e-6)
    assert fitted_sum(sizes, [5.0, 4.0, 3.0, 2.0], 142_000) < 5  # nothing may count below 0
    assert np.isnan(fitted_sum(sizes[:2], [1.0, 2.0], 142_000))


def test_what_the_clock_shows_beside_the_stages():
    run = run_of(1_000)
    assert seconds_by_stage(run)[REST] == pytest.approx(5)
    assert seconds_by_stage(replace(run, seconds=0.1))[REST] == 0


def test_stages_grow_as_they_were_made_up_to():
    grown = growth_by_stage(RUNS)
    assert grown["ingest"].exponent == pytest.approx(1)
    assert grown["compare"].exponent == pytest.approx(2, abs=0.01)
    assert grown["cluster"].exponent == pytest.approx(2)
    assert grown[REST].exponent == pytest.approx(0, abs=1e-9)


def test_the_model_is_this_arithmetic():
    found = model(RUNS, 142_000, 64, None, GRAPH)
    pairs = 142_000 * 141_999 / 2
    ingest, compare, cluster = (found.stages[one] for one in ("ingest", "compare", "cluster"))
    assert ingest.work == pytest.approx(0.02 * 142_000)
    assert ingest.elapsed == pytest.approx(ingest.work / 64 + ingest.work / 5000)
    assert compare.work == pytest.approx(2e-5 * pairs, rel=0.01)
    assert compare.elapsed == pytest.approx(compare.work / 64 + compare.work / 10_000)
    assert cluster.elapsed == cluster.work == pytest.approx(1e-6 * 142_000**2)
    assert found.stages[REST].elapsed == pytest.approx(5)
    assert found.seconds == pytest.approx(ingest.elapsed + compare.elapsed + cluster.elapsed + 5)
    assert found.disk["pairs"] == pytest.approx(50 * pairs, rel=0.01)
    assert found.disk["frames"] == pytest.approx(26_000 * 142_000)
    assert found.memory == pytest.approx(2e8 + 1e4 * 142_000 + 5 * 142_000**2, rel=1e-3)
    assert found.frames_a_clip == 70


def test_longer_clips_and_fewer_workers_cost_more():
    found, longer = (model(RUNS, 142_000, 64, frames, GRAPH) for frames in (None, 210))
    assert longer.stages["ingest"].work == pytest.approx(3 * found.stages["ingest"].work)
    assert longer.stages["compare"].work == pytest.approx(9 * found.stages["compare"].work)
    assert longer.stages["cluster"].work == found.stages["cluster"].work
    assert longer.disk["pairs"] == found.disk["pairs"]
    one = model(RUNS, 142_000, 1, None, GRAPH)
    assert all(stage.elapsed == stage.work for stage in one.stages.values())


def test_the_smaller_runs_are_held_against_the_largest():
    (told,) = checked(RUNS)
    work = sum(seconds_by_stage(RUNS[-1]).values())
    assert f"{work:,.0f} s." in told
    assert checked(RUNS[:2]) == []


def test_a_ratio_is_to_the_kernels_own_time():
    run = run_of(1_000)
    assert run.kernel_ratio == pytest.approx(2e-5 / 1.6e-5)
    bounds = {one.what.rpartition(": ")[2]: one.required for one in figures([run_of(10_000)])}
    assert bounds["comparing, times the kernel's own"] == 1.3
    assert bounds["peak memory of the process tree, GB"] == 6
    assert {one.required for one in figures([run])} == {None}
    assert off_by(2, 3) == off_by(3, 2) == 1.5


def test_cells_are_those_of_all_pairs():
    frames = [3, 5, 9, 9, 1]
    assert cells_of_all_pairs(frames) == sum(a * b for a, b in combinations(frames, 2))


def test_small_tables_are_shown_together():
    shown = large_tables(RUNS)
    assert list(shown) == ["pairs", "frames", "others"]
    assert shown["others"] == [1000] * 4


def test_tables_and_model_are_printed():
    out = StringIO()
    console = Console(file=out, width=124)
    print_runs(RUNS, console)
    print_model(model(RUNS, 142_000, 64, None, GRAPH), RUNS, console)
    for told in (
        "All pairs, 2 processes",
        "exponent",
        "142,000 clips of 70 frames on 64 workers",
        "It assumes",
    ):
        assert told in out.getvalue()


def test_the_graph_of_a_large_library_is_small():
    found = graph_of(2_000)
    assert found.tasks["compare"] < 1_000
    assert found.bytes < 5e6
    assert found.tasks["cluster"] == 1


def test_what_was_measured_is_read_and_not_run_again(tmp_path, monkeypatch):
    found = run_of(300)
    ran = []

    def watched_run(arguments, log):
        ran.append(arguments)
        return found.seconds, found.peak

    of_catalog = {
        name: getattr(found, name)
        for name in ("clips", "pairs_computed", "clusters", "frames", "merged_frames", "stages")
    }
    for name, value in {
        "_watched_run": watched_run,
        "_foretold": lambda given: {"seconds": 9.0},
        "_of_catalog": lambda catalog: of_catalog,
        "bytes_by_table": lambda catalog: found.tables,
        "kernel_seconds_a_pair": lambda catalog, processes: found.kernel,
        "embedded_library": lambda folder, *given: folder / "library-300",
    }.items():
        monkeypatch.setattr(scale_run, name, value)
    route, said = Route("cut at mu", ("--mu", "0.4")), []
    first = scale_run.measured_run(tmp_path, route, 300, 2, said.append)
    again = scale_run.measured_run(tmp_path, route, 300, 2, said.append)
    assert first == again == replace(found, route=route, library=0, foretold={"seconds": 9.0})
    assert len(ran) == 1
    assert ran[0][-2:] == ["--mu", "0.4"]
    assert "measured before" in said[-1]


def test_a_route_is_a_name_and_arguments():
    options = scale._parser().parse_args(["--route", "cut=--primary complete --mu 0.4", "--sizes", "3,40"])
    assert options.route == [Route("cut", ("--primary", "complete", "--mu", "0.4"))]
    assert options.sizes == [3, 40]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_benchmark_runs(tmp_path):
    command = [sys.executable, "-m", "tests.benchmarks.scale", "--quick", "--model-clips", "500"]
    given = ["--folder", str(tmp_path / "scale"), "--json", str(tmp_path / "scale.json")]
    told = subprocess.run([*command, *given], capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    record = json.loads((tmp_path / "scale.json").read_text())
    (route,) = record["routes"]
    assert [run["clips"] for run in route["runs"]] == [40, 80]
    assert all(run["peak"]["own"] > 50 * MEBIBYTE and run["kernel"] > 0 for run in route["runs"])
    assert route["model"]["seconds"] > 0
    assert "figures mean nothing" in told.stdout
