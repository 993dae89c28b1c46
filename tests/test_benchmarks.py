"""That `make bench` runs, and that it notices what it is there to notice."""

import json
import re
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from motionary.pipeline.alignment import cotw
from tests.alignment.naive import Problem
from tests.benchmarks import __main__ as program
from tests.benchmarks import alignment, alignment_clips
from tests.benchmarks.agreement import compared, with_ourselves, with_peers
from tests.benchmarks.clips import ClipSet
from tests.benchmarks.contests import Contestant, alternate
from tests.benchmarks.limits import recurrence
from tests.benchmarks.naive_cotw import naive_cotw
from tests.benchmarks.report import _target
from tests.distances import naive

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def clips() -> ClipSet:
    rng = np.random.default_rng(0)
    return ClipSet("few", [rng.normal(size=(n, 3)).astype(np.float32) for n in (4, 7, 1, 5)])


class Peers:
    """What every peer would say, by definition; `wrong` is what totals are off by."""

    def __init__(self, clips: ClipSet, wrong: float) -> None:
        self.clips, self.wrong = clips.clips, wrong

    def totals(self, peer: str, clips: str, backwards: bool = False) -> np.ndarray:
        power = 1 if peer == "dtaidistance, rooted" else 2
        root = 2 if peer in ("dtaidistance", "tslearn") else 1
        found = [self._key(i, j, power, backwards)[0] for i, j in combinations(range(4), 2)]
        return (np.array(found) * (1 + self.wrong)) ** (1 / root)

    def paths(self, clips: str, pairs: list[tuple[int, int]]) -> np.ndarray:
        return np.array([[*self._key(i, j, 1, False), *self._key(i, j, 1, True)] for i, j in pairs])

    def _key(self, i: int, j: int, power: int, backwards: bool) -> tuple[float, int]:
        other = self.clips[j][::-1] if backwards else self.clips[j]
        return naive.dtw_key(naive.euclidean(self.clips[i], other) ** power)


@pytest.mark.slow
def test_runs_without_peers_and_says_so(tmp_path):
    out = tmp_path / "made" / "bench.json"
    arguments = ["--quick", "--embedded", "--peers", str(tmp_path / "absent"), "--json", str(out)]
    command = [sys.executable, "-m", "tests.benchmarks", *arguments]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert "no peers" in told.stderr
    record = json.loads(out.read_text())
    assert record["peers"] is None
    assert record["library"] == "the embedded library"
    assert {pool["num_threads"] for pool in record["machine"]["blas"]} == {"1"}
    for kind in ("unmerged", "merged"):
        rows = record["contests"][kind]
        assert [(row["who"], row["task"]) for row in rows] == [
            ("motionary", task) for task in ("dtw", "b_dtw", "curve")
        ]
        for row in rows:
            assert len(row["samples"]) == record["settings"]["rounds"]
            assert row["cells_a_second"] * row["seconds"] == pytest.approx(record["clips"][kind]["cells"])
            assert row["product_share"] > 0
            assert row["recurrence_share"] > 0
    assert {stage["varied"] for stage in record["growth"]} == {"clips", "length", "dimension"}
    assert all(one["peak"] >= 0 and one["result"] > 0 for one in record["memory"])
    assert record["agreement"]
    assert all(one["holds"] for one in record["agreement"])
    assert {one["met"] for one in record["targets"] if "aeon" in one["what"]} == {None}
    for title in ("figures mean nothing", "All pairs, unmerged: 14 clips, 91 pairs", "Growth", "Peak memory"):
        assert title in told.stdout
    assert "What is asked for" not in told.stdout


@pytest.mark.parametrize(("holds", "code"), [(True, 0), (False, 1)])
def test_only_disagreement_makes_it_fail(holds, code, tmp_path, monkeypatch):
    record = {"agreement": [{"holds": True}, {"holds": holds}], "targets": [{"met": False}]}
    monkeypatch.setattr(program, "_measure", lambda *_: None)
    monkeypatch.setattr(program, "as_record", lambda _: record)
    monkeypatch.setattr(program, "print_tables", lambda *_: None)
    assert program.main(["--peers", str(tmp_path / "absent"), "--json", str(tmp_path / "out.json")]) == code


def test_right_totals_agree_with_every_peer(clips):
    found = with_ourselves(clips) + with_peers(clips, Peers(clips, wrong=0.0))
    assert len(found) == 10
    assert all(one.holds for one in found), found


def test_wrong_totals_do_not(clips):
    found = with_peers(clips, Peers(clips, wrong=1e-3))
    failed = [one.what for one in found if not one.holds]
    assert failed == [one.what for one in found if "tslearn's paths" not in one.what]


def test_a_difference_that_is_no_number_does_not_hold():
    assert not compared("", np.array([1.0, np.nan]), np.array([1.0, 1.0])).holds
    assert not compared("", np.array([1.0, 0.1]), np.array([1.0, 0.0])).holds


def test_contestants_take_turns_and_the_warm_up_is_not_counted():
    calls = []

    def seconds(who):
        return lambda first: calls.append((who, first)) or float(len(calls))

    a, b = alternate(
        [Contestant("a", "dtw", seconds("a")), Contestant("b", "dtw", seconds("b"), rounds=2)], rounds=3
    )
    assert [first for _, first in calls[:2]] == [4, 4]
    assert "".join(who for who, _ in calls) == "ab" + "ab" + "ba" + "a"
    assert (a.samples, b.samples) == ([3.0, 6.0, 7.0], [4.0, 5.0])
    assert a.seconds == 6.0


def test_a_sample_is_the_mean_of_as_many_passes_as_take_a_while():
    passes = iter([1.0, 0.1, 0.1, 0.3, 9.0])
    (timing,) = alternate([Contestant("a", "dtw", lambda first: next(passes))], rounds=1)
    assert timing.samples == [pytest.approx(0.5 / 3)]


def test_the_limits_recurrence_is_the_one_of_dtw():
    costs = np.random.default_rng(0).random((6, 3), dtype=np.float32)
    row = np.full_like(costs, np.inf)
    recurrence(costs, 9, row, np.empty(3, np.float32), np.empty(3, np.float32))
    for lane in range(3):
        total, _ = naive.dtw_key(np.tile(costs[:, lane], (9, 1)))
        assert row[-1, lane] == pytest.approx(total, rel=1e-6)


def test_a_target_is_met_from_the_right_side():
    assert _target("", 9.0, 8.0, None)["met"]
    assert not _target("", 7.0, 8.0, None)["met"]
    assert _target("", 0.6, 0.65, None, at_least=False)["met"]
    assert _target("", None, 8.0, None)["met"] is None


def test_the_peers_constraints_hold_versions_only():
    lines = (ROOT / "tests" / "benchmarks" / "constraints.txt").read_text().splitlines()
    for line in lines:
        assert re.fullmatch(r"[\w.-]+==[\w.!+]+", line), line
    assert {"aeon", "dtaidistance", "tslearn"} <= {line.split("==")[0] for line in lines}


@pytest.mark.slow
def test_the_alignments_benchmark_runs_with_and_without_real_clips(tmp_path):
    out = tmp_path / "made" / "alignment.json"
    command = [sys.executable, "-m", "tests.benchmarks.alignment", "--quick", "--json", str(out)]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    record = json.loads(out.read_text())
    assert {pool["num_threads"] for pool in record["machine"]["blas"]} == {"1"}
    figures = {one["what"]: one for one in record["figures"]}
    assert figures["times faster than naive"]["measured"] > 0
    assert figures["the whole grid of it, 660: seconds"]["measured"] > 0
    assert all(one["met"] for one in figures.values() if one["binding"])
    real = [what for what in figures if "HDM05" in what]
    assert bool(real) == alignment.REAL_DATA.is_dir() == ("no real clips" not in told.stderr)
    assert "figures mean nothing" in told.stdout
    assert "MISSED" not in told.stdout


def test_without_real_clips_their_figures_are_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(alignment, "REAL_DATA", tmp_path / "absent")
    assert alignment.main(["--quick", "--json", str(tmp_path / "out.json")]) == 0
    assert "no real clips" in capsys.readouterr().err


def test_another_optimum_makes_the_alignments_benchmark_fail(tmp_path, monkeypatch):
    def wrong(*arguments):
        objective, eta = naive_cotw(*arguments)
        return objective * (1 + 1e-6), eta

    monkeypatch.setattr(alignment, "REAL_DATA", tmp_path / "absent")
    monkeypatch.setattr(alignment, "naive_cotw", wrong)
    assert alignment.main(["--quick", "--json", str(tmp_path / "out.json")]) == 1


def test_a_search_below_length_matching_is_counted():
    pair = tuple(alignment_clips.smooth_sequence(frames, 3, seed=frames) for frames in (50, 40))
    good = alignment.searched([pair])[0]
    bent = cotw(pair[0], -pair[1], 10, 6)
    assert alignment.never_below_uniform([pair, pair], [good, bent]).measured == 1


@pytest.mark.parametrize("seed", range(3))
def test_the_naive_alignment_is_the_one_of_the_plain_recursion(seed):
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(21, 2)).cumsum(axis=0), rng.normal(size=(23, 2)).cumsum(axis=0)
    objective, eta = naive_cotw(moving, reference, 7, 3)
    best, (_, etas) = Problem(moving, reference, 7).best(3)
    assert objective == pytest.approx(best, abs=1e-9)
    assert eta == etas


def test_an_alignments_figure_is_met_from_the_right_side():
    assert alignment.Figure("", 90, required=80, at_least=True).met
    assert not alignment.Figure("", 90, required=80).met
    assert not alignment.Figure("", float("nan"), required=80).met
    assert alignment.Figure("", 90).met is None


@pytest.mark.slow
def test_the_questions_benchmark_runs_on_the_catalog_that_is_there(tmp_path, demo_catalog):
    folder, out = tmp_path / "ask", tmp_path / "made" / "ask.json"
    folder.mkdir()
    (folder / "catalog-80").symlink_to(demo_catalog)
    command = [sys.executable, "-m", "tests.benchmarks.ask", "--quick", "--folder", folder, "--json", out]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert not (folder / "library-80").exists()
    figures = {one["what"]: one for one in json.loads(out.read_text())["figures"]}
    assert all(one["measured"] > 0 for one in figures.values())
    assert {f"80 clips: {what}" for what in ("similar to a new file, ms", "files assigned a second")} <= {
        *figures
    }
