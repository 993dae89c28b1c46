"""Labels that come with a library: from a CSV, from a pattern on the clips' names, from both."""

import signal
import threading

import pytest

from motionary.pipeline.readers.library import scan_library
from motionary.workflows import label_pattern
from motionary.workflows.errors import UserError
from motionary.workflows.label_pattern import PatternError, labels_by_pattern
from motionary.workflows.labels_file import LabelsError, supplied_labels

PATTERN = r"(?P<action>[a-z]+)_(?P<style>[a-z]+)?_\d"


@pytest.fixture
def sources(tmp_path):
    for name in ("walk_sad_1.bvh", "run__2.bvh", "other.bvh"):
        (tmp_path / "takes").mkdir(exist_ok=True)
        (tmp_path / "takes" / name).write_text("")
    return scan_library(tmp_path / "takes")


@pytest.fixture
def csv(tmp_path):
    def write(text: str):
        file = tmp_path / "labels.csv"
        file.write_text(text)
        return file

    return write


def test_neither_gives_no_labels(sources):
    assert len(supplied_labels(None, None, sources, "action").table) == 0


def test_a_pattern_labels_the_clips_it_is_found_in(sources):
    made = supplied_labels(None, PATTERN, sources, "action")
    assert made.table.to_pylist() == [
        {"clip_id": "run__2.bvh", "action": "run", "style": None},
        {"clip_id": "walk_sad_1.bvh", "action": "walk", "style": "sad"},
    ]
    assert made.outside == []


def test_a_csvs_value_wins_but_an_empty_one_does_not(sources, csv):
    file = csv(
        "path,action,mood\ntakes/walk_sad_1.bvh,stroll,blue\ntakes/run__2.bvh,,\ntakes/other.bvh,jump,\ngone,x,\n"
    )
    made = supplied_labels(file, PATTERN, sources, "action")
    assert made.table.to_pylist() == [
        {"clip_id": "other.bvh", "action": "jump", "mood": None, "style": None},
        {"clip_id": "run__2.bvh", "action": "run", "mood": None, "style": None},
        {"clip_id": "walk_sad_1.bvh", "action": "stroll", "mood": "blue", "style": "sad"},
    ]
    assert made.outside == ["gone"]


def test_either_may_have_the_label_column(sources, csv):
    file = csv("path,mood\ntakes/other.bvh,blue\n")
    for column in ("mood", "action", "style"):
        assert column in supplied_labels(file, PATTERN, sources, column).table.column_names


def test_the_order_of_a_csv_does_not_matter(sources, csv):
    rows = ["takes/other.bvh,jump", "takes/walk_sad_1.bvh,walk"]
    tables = [
        supplied_labels(csv("\n".join(["path,action", *some])), None, sources, "action").table
        for some in (rows, rows[::-1])
    ]
    assert tables[0].equals(tables[1])


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        (r"(?P<action>[a-z)", r"not a regular expression: unterminated character set at position 11"),
        (r"(?P<action>a)(?P<action>b)", "not a regular expression: redefinition of group name 'action'"),
        (r"([a-z]+)_", "has no named groups"),
        ("", "has no named groups"),
        (r"(?P<style>[a-z]+)", "has no group 'action'; name one of its groups with --label-column: style"),
        (r"(?P<action>[A-Z]+)", "in none of 3 clips; it is searched in names like 'other.bvh'"),
        (r"(?P<clip_id>.*)", "a group 'clip_id', which every clip has anyway"),
        (r"(?P<fps>\d)", "a group 'fps'"),
    ],
)
def test_a_wrong_pattern_is_explained(sources, pattern, message):
    with pytest.raises(UserError, match=message):
        supplied_labels(None, pattern, sources, "action")


def test_a_column_that_neither_has(sources, csv):
    file = csv("path,mood\ntakes/other.bvh,blue\n")
    with pytest.raises(
        LabelsError, match=r"neither .*labels.csv \(mood\) nor .*\(style\) has a label 'action'"
    ):
        supplied_labels(file, "(?P<style>[a-z]+)", sources, "action")


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="the limit needs POSIX timers")
@pytest.mark.parametrize(
    "pattern", [r"(?P<action>(a+)+)$", r"(?P<action>(?:.*)*(?:.*)*(?:.*)*)=", "(?P<a>(a|aa)+)$"]
)
def test_a_pattern_that_would_never_end_is_stopped(monkeypatch, pattern):
    monkeypatch.setattr(label_pattern, "LIMIT", 0.1)
    before = signal.getsignal(signal.SIGVTALRM)
    with pytest.raises(PatternError, match=r"takes more than 0.1 s of processor time"):
        labels_by_pattern(pattern, ["a" * 60 + "b" + "a" * 60 + ".bvh"])
    assert signal.getsignal(signal.SIGVTALRM) is before
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0, 0)


def test_many_clips_take_little_of_the_limit(monkeypatch):
    monkeypatch.setattr(label_pattern, "LIMIT", 2.0)
    names = [f"takes/{number}/walk_sad_{number}.bvh" for number in range(10_000)]
    assert len(labels_by_pattern(r"(?P<folder>(?:[^/]+/)+)" + PATTERN, names)[1]) == len(names)
    if hasattr(signal, "getitimer"):
        assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0, 0)


def test_a_pattern_works_outside_the_main_thread(sources):
    found = []
    thread = threading.Thread(
        target=lambda: found.append(supplied_labels(None, PATTERN, sources, "action").table)
    )
    thread.start()
    thread.join()
    assert len(found[0]) == 2
