"""The embedded library in files: any number of clips, the same ones always, and none written twice."""

import csv
import hashlib
import os
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.pipeline.synthetic import (
    ACTIONS,
    STYLES,
    files,
    least_clips,
    numbered_take,
    synthetic_library,
    take_numbers,
    write_library,
)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def states(folder: Path) -> dict[str, tuple[int, int]]:
    return {
        str(path): (path.stat().st_mtime_ns, path.stat().st_ino)
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def quick_takes(monkeypatch):
    """Let every take be the same few frames, for tests that are about files and not about motion."""
    plain = numbered_take(0, "punch", "energetic", 1)
    short = plain.motion.sampled([0.0, 1.0])

    def take(seed: int, action: str, style: str, number: int):
        name = f"{action}_{style}_{plain.subject}_{number:02d}"
        values = vars(plain) | {"action": action, "style": style, "take": number, "warp": plain.warp[:2]}
        return type(plain)(**values | {"motion": type(short)(**vars(short) | {"name": name})})

    monkeypatch.setattr(files, "numbered_take", take)


@given(st.integers(1, 1000))
def test_there_are_as_many_as_asked_evenly_over_actions_and_styles(clips):
    takes = list(take_numbers(clips))
    assert len(takes) == len(set(takes)) == clips
    for place, names in ((0, ACTIONS), (1, STYLES)):
        counts = Counter(dict.fromkeys(names, 0)) + Counter(take[place] for take in takes)
        each = [counts[name] for name in names]
        assert max(each) - min(each) <= 1


@given(st.integers(1, 400), st.integers(1, 400))
def test_a_larger_library_has_the_takes_of_a_smaller_one(one, other):
    small, large = sorted((one, other))
    assert set(take_numbers(small)) <= set(take_numbers(large))


@given(st.integers(1, 300))
def test_a_take_tells_the_least_library_that_has_it(clips):
    assert max(least_clips(*take) for take in take_numbers(clips)) == clips


def test_the_default_is_the_library_of_two_takes(tmp_path):
    write_library(tmp_path)
    takes = synthetic_library()
    assert {take.path for take in takes} | {"labels.csv", "warps.csv"} == set(contents(tmp_path))
    with (tmp_path / "labels.csv").open(encoding="utf-8") as file:
        assert [row["path"] for row in csv.DictReader(file)] == [take.path for take in takes]


def test_the_labels_of_seed_0_are_what_they_always_were(tmp_path):
    write_library(tmp_path)
    told = hashlib.sha256((tmp_path / "labels.csv").read_bytes()).hexdigest()
    assert told == "b72f5b8387d31a4ddd34ccef191951b4c16433a2edaa290d19d0c1d1cbc0dd9a"


@pytest.mark.parametrize("clips", [1, 7, 41])
def test_a_library_has_its_clips_and_their_labels(clips, tmp_path):
    write_library(tmp_path, seed=2, clips=clips)
    motions = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.bvh"))
    with (tmp_path / "labels.csv").open(encoding="utf-8") as file:
        labels = list(csv.DictReader(file))
    assert len(motions) == clips
    assert sorted(row["path"] for row in labels) == motions
    for row in labels:
        take = numbered_take(2, row["action"], row["style"], int(row["take"]))
        assert (take.path, take.subject, take.description) == (
            row["path"],
            row["subject"],
            row["description"],
        )


def test_names_are_unique_and_folders_stay_small():
    takes = [numbered_take(0, "walk", "tired", number).path for number in (1, 99, 100, 199, 200, 3550)]
    folders = [path.rpartition("/")[0] for path in takes]
    assert folders == ["walk", "walk", "walk/100", "walk/100", "walk/200", "walk/3500"]
    assert len(set(takes)) == len(takes)


def test_takes_are_performed_one_after_the_other(tmp_path, monkeypatch, quick_takes):
    alive, most = [], []
    quick, write = files.numbered_take, files.write_bvh

    def performed(*numbers):
        alive.append(numbers)
        most.append(len(alive))
        return quick(*numbers)

    def written(motion, path):
        write(motion, path)
        alive.pop()

    monkeypatch.setattr(files, "numbered_take", performed)
    monkeypatch.setattr(files, "write_bvh", written)
    steps = []
    write_library(tmp_path, clips=90, written=lambda: steps.append(len(list(tmp_path.rglob("*.bvh")))))
    assert set(most) == {1}
    assert steps == list(range(1, 91))


def test_what_is_there_with_equal_bytes_is_not_written_again(tmp_path, quick_takes):
    write_library(tmp_path, clips=50)
    changed = next(tmp_path.rglob("*_tired_*.bvh"))
    before = states(tmp_path)
    changed.write_text("somebody else's", encoding="utf-8")
    write_library(tmp_path, clips=50)
    after = states(tmp_path)
    assert {path for path in after if after[path] != before.get(path)} == {str(changed)}
    assert changed.read_text(encoding="utf-8").startswith("HIERARCHY")


def test_a_library_grows_and_leaves_what_it_had(tmp_path, quick_takes):
    write_library(tmp_path, clips=30)
    before = states(tmp_path)
    write_library(tmp_path, clips=70)
    after = states(tmp_path)
    motions = [path for path in before if path.endswith(".bvh")]
    assert len(motions) == 30
    assert all(after[path] == before[path] for path in motions)
    assert len(list(tmp_path.rglob("*.bvh"))) == 70


def test_a_smaller_library_over_a_larger_one_is_refused_before_anything_is_written(tmp_path, quick_takes):
    write_library(tmp_path, clips=43)
    (tmp_path / "labels.csv").unlink()  # a larger one that was killed before its end is noticed too
    (tmp_path / "walk" / "mine.bvh").write_text("another's", encoding="utf-8")
    before = states(tmp_path)
    with pytest.raises(
        ValueError, match=r"holds 3 takes that a library of 40 clips has not .*ask for 43 clips"
    ):
        write_library(tmp_path, clips=40)
    assert states(tmp_path) == before
    write_library(tmp_path, clips=43)


def test_a_write_that_fails_leaves_no_half_files(tmp_path, quick_takes):
    def stop():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_library(tmp_path, clips=10, written=stop)
    assert {Path(path).suffix for path in contents(tmp_path)} == {".bvh"}


def test_two_processes_write_the_same_files(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_WORTH_A_PROCESS", 1)
    monkeypatch.setattr(files, "_AT_ONCE", 2)
    counted = []
    write_library(tmp_path / "two", clips=9, processes=2, written=lambda: counted.append(os.getpid()))
    write_library(tmp_path / "one", clips=9)
    assert contents(tmp_path / "two") == contents(tmp_path / "one")
    assert counted == [os.getpid()] * 9


@pytest.mark.parametrize("clips", [0, -3])
def test_no_clips_are_no_library(clips, tmp_path):
    with pytest.raises(ValueError, match=f"clips is {clips}"):
        write_library(tmp_path / "none", clips=clips)
    assert not (tmp_path / "none").exists()


def test_the_command_refuses_a_smaller_library_too(tmp_path, quick_takes, motionary):
    write_library(tmp_path / "library", clips=43)
    code, out, err = motionary("demo", tmp_path, "--clips", 40)
    assert (code, out) == (1, "")
    assert "ask for 43 clips" in " ".join(err.split())
    assert not (tmp_path / "catalog").exists()
