"""A small share of `make torture`, and that it notices what it is there to notice.

It forks, so `tests/test_torture.py` gives it a process of its own.
"""

import errno
import re
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

if sys.platform != "linux":
    pytest.skip("torture forks and looks at /proc", allow_module_level=True)

from motionary.pipeline.readers import ReadError
from tests.torture import __main__ as program
from tests.torture import forked, fuzz_motion, kill
from tests.torture.disk import full_disk
from tests.torture.fuzz import Fault, Kind, Tally, fuzz
from tests.torture.fuzz_tables import CATALOG, LABELS, SETTINGS
from tests.torture.readers import readers_under_writing
from tests.torture.world import run_arguments, take_clips

pytestmark = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")  # the children only compute


def none_faulty(tallies: dict[str, Tally]) -> None:
    assert [fault for tally in tallies.values() for fault in tally.faults] == []


def test_damaged_motions_are_read_or_refused(tmp_path: Path) -> None:
    tallies = fuzz([fuzz_motion.BVH, fuzz_motion.ASF, fuzz_motion.AMC], 60, 7, tmp_path)
    none_faulty(tallies)
    assert all(tally.outcomes["refused"] > tally.outcomes["read"] > 0 for tally in tallies.values())


def test_damaged_labels_and_settings_are_read_or_refused(tmp_path: Path) -> None:
    tallies = fuzz([LABELS, SETTINGS], 50, 7, tmp_path)
    none_faulty(tallies)
    assert all(tally.outcomes["refused"] and tally.outcomes["read"] for tally in tallies.values())


@pytest.mark.slow
def test_damaged_catalogs_are_read_or_refused(tmp_path: Path) -> None:
    none_faulty(fuzz([CATALOG], 60, 7, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("group", ["_LARGE_BVH", "_LARGE_ASF", "_LARGE_AMC"])
def test_large_motions_on_purpose(tmp_path: Path, group: str) -> None:
    kind = {"_LARGE_BVH": fuzz_motion.BVH, "_LARGE_ASF": fuzz_motion.ASF, "_LARGE_AMC": fuzz_motion.AMC}[
        group
    ]
    count, every = len(getattr(fuzz_motion, group)), fuzz_motion.LARGE
    only = replace(kind, make=lambda rng, number, shared: kind.make(rng, number * every + every // 2, shared))
    none_faulty(fuzz([only], count, 0, tmp_path))


@pytest.mark.parametrize(
    ("deed", "told"),
    [
        (lambda: bytearray(2**30), "MemoryError"),
        (lambda: {}["no"], "KeyError"),
        (lambda: sys.exit(0), "SystemExit"),
        (lambda: forked.os._exit(3), "ended the process (3)"),
        (lambda: time.sleep(60), "Timeout"),
        (
            lambda: fuzz_motion.check_refusal(ReadError("else.bvh", 1, "a", "b"), Path()),
            "no file of the case",
        ),
    ],
)
def test_fuzz_notices(tmp_path: Path, monkeypatch, deed, told: str) -> None:
    monkeypatch.setattr("tests.torture.fuzz.SECONDS", 2)

    def check(shared: Path, folder: Path):
        if (folder / "x").read_bytes() == b"1":
            deed()
        return "read"

    kind = Kind("deeds", 1, lambda shared: None, lambda rng, number, shared: {"x": b"%d" % number}, check)
    tally = fuzz([kind], 3, 0, tmp_path)["deeds"]
    assert (tally.cases, tally.outcomes["read"], len(tally.faults)) == (3, 2, 1)
    assert tally.faults[0].startswith("1: ")
    assert told in tally.faults[0]
    assert (tmp_path / "faults" / "deeds-0-1" / "x").read_bytes() == b"1"


def test_refusals_have_a_line_of_their_file(tmp_path: Path) -> None:
    path = tmp_path / "x.bvh"
    path.write_text("one\ntwo")
    for line in (None, 0, 3):
        with pytest.raises(Fault, match="names line"):
            fuzz_motion.check_refusal(ReadError(path, line, "torn", "sew it"), tmp_path)
    fuzz_motion.check_refusal(ReadError(path, 2, "torn", "sew it"), tmp_path)


@pytest.mark.timeout(900)
def test_killed_runs_resume(tmp_path: Path) -> None:
    scene = kill.set_up(tmp_path, count=4, workers=(1,))
    found = kill.run_kills(scene, kill.plan(scene, 1, 0, steps=2))
    assert found.faults == []
    assert (found.by_moment, found.by_step, found.resumed) == (1, 2, 3)

    # It notices a part that was cut short.
    part = next((scene.catalog / "tables" / "pairs").iterdir())
    content = part.read_bytes()
    part.unlink()
    part.write_bytes(content[:-1])
    assert kill.run_kills(scene, [kill.Kill(seconds=0.0)]).faults


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_readers_under_writing(tmp_path: Path) -> None:
    found = readers_under_writing(tmp_path, readers=2, runs=2)
    assert (found.reading.errors, found.faults) == ([], [])
    assert (found.runs, found.vacuums) == (2, 2)
    assert found.reading.queries > 0


def test_a_full_disk_is_told_in_one_line(tmp_path: Path, demo_library: Path, motionary, monkeypatch) -> None:
    take_clips(demo_library, tmp_path / "library", 3)

    def full(file: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    code, _, err = motionary(*run_arguments(tmp_path / "library", tmp_path / "catalog"))
    (told,) = [line for line in err.splitlines() if line.startswith("motionary: ")]
    assert code == 1
    assert re.fullmatch(
        rf"motionary: {tmp_path}/catalog/\S+: no space left on device; make room there; .*", told
    )
    assert not list((tmp_path / "catalog").rglob("*.tmp"))


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_full_disk(tmp_path: Path) -> None:
    found = full_disk(tmp_path, every=12)
    assert found.faults == []
    assert set(found.refused) >= {"ENOSPC", "EROFS", "EACCES"}


def test_the_program_runs_one_part(tmp_path: Path, capsys) -> None:
    assert program.main(["fuzz", "--only", "toml", "--cases", "20", "--work", str(tmp_path)]) == 0
    assert "PASSED: 0 faults" in capsys.readouterr().out
    shutil.rmtree(tmp_path)
