"""The nightly job: what it publishes, what it refuses, whom it tells, and what it leaves when it fails."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace

import pytest

from motionary.catalog import Catalog
from motionary.catalog.store import Store
from motionary.catalog.writer_lock import the_only_writer
from motionary.workflows import nightly
from motionary.workflows.announce import post_report
from motionary.workflows.limits import measure
from motionary.workflows.nightly_settings import Limits, load_nightly
from motionary.workflows.run_log import RunLog
from motionary.workflows.run_report import RunReport
from motionary.workflows.settings import SettingsError, load_settings

EXAMPLE = Path(nightly.__file__).with_name("nightly.toml")


@pytest.fixture
def library(demo_library, tmp_path) -> Path:
    """A small library beside the configuration file: eight clips of two actions."""
    library = tmp_path / "library"
    for action in ("walk", "squat"):
        (library / action).mkdir(parents=True)
        for file in sorted((demo_library / action).glob("*.bvh"))[:4]:
            shutil.copy(file, library / action)
    return library


def configuration(folder: Path, more: str = "", job: str = "") -> Path:
    file = folder / "nightly.toml"
    file.write_text(
        f'[job]\nlibraries = "library"\ncatalog = "catalog"\nworkers = 1\n{job}\n'
        f'[log]\nfile = "logs/nightly.jsonl"\n{more}\n'
    )
    return file


def logged(folder: Path, event: str | None = None) -> list[dict]:
    lines = [json.loads(line) for line in (folder / "logs" / "nightly.jsonl").read_text().splitlines()]
    assert all({"time", "event"} <= line.keys() for line in lines)
    return [line for line in lines if event in (None, line["event"])]


def the_report(folder: Path) -> dict:
    """The last one written."""
    (file,) = (Path(line["file"]) for line in logged(folder, "report")[-1:])
    return json.loads(file.read_text())


def spoil(library: Path, count: int) -> None:
    for file in sorted((library / "walk").glob("*.bvh"))[:count]:
        file.write_text("HIERARCHY\nnothing\n")


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(file): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


# Configuration


def test_the_example_is_valid_and_what_the_command_prints(motionary, tmp_path):
    code, out, _ = motionary("nightly", "--example")
    assert (code, out) == (0, EXAMPLE.read_text())
    (tmp_path / "nightly.toml").write_text(out)
    settings = load_nightly(tmp_path / "nightly.toml")
    assert settings.job.libraries == [str(tmp_path / "library")]
    assert settings.job.catalog == str(tmp_path / "catalog")
    assert settings.reports == tmp_path / "reports"
    assert settings.job.config == load_settings(None, {})


def test_every_setting_that_the_example_shows_in_a_comment_is_one(tmp_path):
    shown = EXAMPLE.read_text().replace("# scheduler", "# # scheduler")
    lines = [
        line.removeprefix("# ") if line.startswith("# ") and line.split(" ")[2:3] == ["="] else line
        for line in shown.splitlines()
    ]
    (tmp_path / "nightly.toml").write_text("\n".join(lines))
    settings = load_nightly(tmp_path / "nightly.toml")
    assert settings.job.labels == tmp_path / "library/labels.csv"
    assert settings.finish.command == ("./announce.sh",)
    assert settings.log == tmp_path / "nightly.jsonl"
    assert settings.retention.grace_hours == 24


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[job]\nlibraries = []\ncatalog = 'c'\n", "nightly.toml: setting job.*names no folder"),
        ("[job]\ncatalog = 'c'\n", "nightly.toml: setting job.libraries.* is missing"),
        ("[limits]\nmax_moved = 1\n", "nightly.toml: setting job is missing"),
        ("JOB\nworkers = 0\n", "nightly.toml: setting job.workers"),
        ("JOB\nworkers = 2\nscheduler = 'tcp://x'\n", "workers or scheduler, not both"),
        ("JOB\n[job.more]\n", "nightly.toml: there is no setting job.more"),
        ("JOB\n[limit]\nmax_moved = 1\n", "nightly.toml: there is no setting limit"),
        ("JOB\n[limits]\nmax_move = 1\n", "there is no setting limits.max_move"),
        ("JOB\n[limits]\nmax_moved = 1.5\n", "limits.max_moved: 1.5 has a decimal point and so is a share"),
        ("JOB\n[limits]\nmax_moved = -1\n", "limits.max_moved: -1 is no limit"),
        ("JOB\n[limits]\nmax_moved = true\n", "limits.max_moved: True is no limit"),
        ("JOB\n[limits]\nmax_moved = nan\n", "limits.max_moved"),
        ("JOB\n[labels]\npattern = '('\n", "labels.pattern: '\\(' is no regular expression"),
        ("JOB\n[labels]\npattern = 'a'\n", "labels.pattern: 'a' names no label"),
        ("JOB\n[finish]\nwebhook = 'file:///etc/passwd'\n", "finish.webhook: give an address"),
        ("JOB\n[finish]\ntimeout = 0\n", "finish.timeout"),
        ("JOB\n[retention]\nkeep = 0\n", "retention.keep"),
        ("JOB\n[features]\nepsilom = 1\n", "nightly.toml: there is no setting features.epsilom"),
        ("JOB\n[labels]\ncolumn = 'a'\n[clusters]\nlabel_column = 'b'\n", "give one of them"),
        ("[job\n", "nightly.toml: "),
    ],
)
def test_a_wrong_setting_is_named_with_its_file(motionary, tmp_path, text, message):
    file = tmp_path / "nightly.toml"
    file.write_text(text.replace("JOB", "[job]\nlibraries = ['library']\ncatalog = 'catalog'"))
    with pytest.raises(SettingsError, match=message):
        load_nightly(file)
    code, out, err = motionary("nightly", file)
    assert (code, out) == (2, "")
    assert str(file) in err
    assert list(tmp_path.iterdir()) == [file]


def test_usage_is_exit_code_2(motionary, tmp_path):
    assert motionary("nightly")[0] == 2
    assert motionary("nightly", tmp_path / "none.toml")[0] == 2
    assert motionary("nightly", tmp_path)[0] == 2


def test_the_environment_wins_over_the_file(tmp_path, monkeypatch):
    file = configuration(tmp_path, "[limits]\nmax_moved = 7\n[features]\nepsilon = 0.3")
    monkeypatch.setenv("MOTIONARY_LIMITS__MAX_MOVED", "0.25")
    monkeypatch.setenv("MOTIONARY_LIMITS__MAX_REMOVED", "3")
    monkeypatch.setenv("MOTIONARY_FEATURES__EPSILON", "0.2")
    monkeypatch.setenv("MOTIONARY_JOB__CATALOG", "s3://bucket/catalog")
    monkeypatch.setenv("MOTIONARY_JOB__LIBRARIES", "/mocap")
    settings = load_nightly(file)
    limits = settings.limits
    assert (limits.max_moved, type(limits.max_removed), limits.max_removed) == (0.25, int, 3)
    assert settings.job.config.features.epsilon == 0.2
    assert (settings.job.catalog, settings.job.libraries) == ("s3://bucket/catalog", ["/mocap"])


@pytest.mark.parametrize(("text", "libraries"), [("/a", ["/a"]), ('["/a", "/b"]', ["/a", "/b"])])
def test_the_environment_names_one_library_or_several(tmp_path, monkeypatch, text, libraries):
    monkeypatch.setenv("MOTIONARY_JOB__LIBRARIES", text)
    assert load_nightly(configuration(tmp_path)).job.libraries == libraries


def test_the_column_of_the_labels_names_the_clusters(tmp_path):
    settings = load_nightly(
        configuration(tmp_path, "[labels]\ncolumn = 'style'\n[clusters]\nprimary='complete'")
    )
    assert (settings.job.config.clusters.label_column, settings.job.config.clusters.primary) == (
        "style", "complete",
    )  # fmt: skip


# Limits


@pytest.mark.parametrize(
    ("limit", "quarantined", "exceeded"),
    [(None, 100, False), (3, 3, False), (3, 4, True), (0, 1, True), (0.0, 0, False), (1.0, 100, False),
     (0.29, 29, False), (0.29, 30, True), (1, 2, True)],
)  # fmt: skip
def test_a_limit_is_a_count_or_a_share(limit, quarantined, exceeded):
    after = SimpleNamespace(quarantine=range(quarantined), clips=range(100 - quarantined))
    (measured,) = measure(Limits(max_quarantined=limit), None, after, None)  # type: ignore[arg-type]
    assert measured.exceeded == exceeded


@pytest.mark.parametrize(
    ("of_which", "limit"), [("max_moved", 3 / 12), ("max_removed", 8 / 20), ("max_relabelled", 6 / 12)]
)
def test_moved_removed_and_relabelled_clips_are_shares_of_their_own_kind(of_which, limit):
    before, after = SimpleNamespace(clips=range(20)), SimpleNamespace(quarantine=[], clips=range(50))
    changes = SimpleNamespace(moved=range(3), removed=range(8), relabelled=range(6))
    for share, exceeded in ((limit, False), (limit - 0.001, True)):
        measured = measure(Limits(**{of_which: share}), before, after, changes)  # type: ignore[arg-type]
        assert [one.name for one in measured if one.exceeded] == [of_which] * exceeded
        assert len(measured) == 4


# Runs


def test_two_nights(library, motionary, tmp_path):
    file = configuration(tmp_path, "[labels]\npattern = '^(?P<action>[a-z]+)/'\n[retention]\nkeep = 1")
    code, out, err = motionary("nightly", file)
    assert (code, err) == (0, "")
    first = the_report(tmp_path)
    assert f"{first['run_id']} published, snapshot 000001" in out
    events = [line["event"] for line in logged(tmp_path)]
    assert events[:2] == ["started", "planned"]
    assert events[-5:] == ["published", "vacuumed", "report", "page", "finished"]
    catalog = Catalog.open(str(tmp_path / "catalog"))
    assert first["run_id"] == catalog.runs.to_arrow()["run_id"][-1].as_py()
    assert (first["status"], first["exit_code"], first["error"]) == ("published", 0, None)
    assert (first["snapshot_before"], first["snapshot_after"]) == (None, "000001")
    counts = {"new": 8, "changed": 0, "renamed": 0, "removed": 0, "unchanged": 0}
    assert {name: first["clips"][name] for name in counts} == counts
    assert sorted(one["label"] for one in first["clusters"]) == ["squat", "walk"]
    assert first["stage_seconds"].keys() >= {"ingest", "compare", "cluster", "align"}
    assert {line["stage"] for line in logged(tmp_path, "stage")} >= {"ingest", "compare", "align"}
    assert first["settings"]["stages"]["features"]["epsilon"] == 0.1
    assert first["versions"].keys() >= {"motionary", "numpy", "numba"}
    assert [(one["name"], one["found"], one["exceeded"]) for one in first["limits"]] == [
        ("max_quarantined", 0, False)
    ]

    (library / "walk" / "broken.bvh").write_text("HIERARCHY\nnothing\n")
    next((library / "squat").iterdir()).unlink()
    code, out, err = motionary("nightly", file)
    assert (code, err) == (3, "")
    second = the_report(tmp_path)
    assert (second["status"], second["exit_code"]) == ("published", 3)
    assert (second["snapshot_before"], second["snapshot_after"]) == ("000001", "000002")
    counts = {"new": 1, "changed": 0, "renamed": 0, "removed": 1, "unchanged": 7}
    assert {name: second["clips"][name] for name in counts} == counts
    (quarantined,) = logged(tmp_path, "quarantined")
    assert (quarantined["path"], quarantined["line"]) == ("walk/broken.bvh", 2)
    assert quarantined["reason"]
    assert [one["path"] for one in second["quarantined"]] == ["walk/broken.bvh"]
    assert [len(second[name]) for name in ("removed", "moved", "relabelled")] == [1, 0, 0]
    stems = {first["run_id"], second["run_id"]}
    assert {one.name for one in (tmp_path / "reports").iterdir()} == {
        f"{stem}.{suffix}" for stem in stems for suffix in ("json", "html")
    }
    page = (tmp_path / "reports" / f"{second['run_id']}.html").read_text()
    assert "Since snapshot 000001 of" in page
    assert "walk/<wbr>broken.bvh" in page


def test_what_a_run_remarks_is_logged(library, motionary, tmp_path):
    file = configuration(tmp_path, '[distances]\npairs = "landmarks"')
    assert motionary("nightly", file)[0] == 0
    assert "compares all pairs: of 8 clips, landmarks would be all" in [
        line["text"] for line in logged(tmp_path, "remark")
    ]


def test_a_page_can_be_left_out(library, motionary, tmp_path):
    file = configuration(tmp_path, "[report]\nhtml = false")
    assert motionary("nightly", file)[0] == 0
    assert [one.suffix for one in (tmp_path / "reports").iterdir()] == [".json"]
    assert logged(tmp_path, "page") == []


def test_a_refused_run_has_no_page(library, motionary, tmp_path):
    spoil(library, 1)
    file = configuration(tmp_path, "[limits]\nmax_quarantined = 0")
    assert motionary("nightly", file)[0] == 1
    assert [one.suffix for one in (tmp_path / "reports").iterdir()] == [".json"]
    assert the_report(tmp_path)["status"] == "refused"


def test_what_fails_after_publishing_leaves_the_page(library, motionary, tmp_path, monkeypatch):
    monkeypatch.setattr("motionary.workflows.nightly.vacuum", fault)
    assert motionary("nightly", configuration(tmp_path, "[retention]\nkeep = 1"))[0] == 1
    report = the_report(tmp_path)
    assert (report["status"], report["exit_code"]) == ("published", 1)
    assert "no such luck" in report["error"]
    assert {one.suffix for one in (tmp_path / "reports").iterdir()} == {".json", ".html"}


def fault(*_, **__):
    raise ZeroDivisionError("no such luck")


def sigterm(*_, **__):
    signal.raise_signal(signal.SIGTERM)
    pytest.fail("SIGTERM was passed over while the page was made")


@pytest.mark.parametrize(("spoiled", "told"), [(fault, "no such luck"), (sigterm, "stopped by SIGTERM")])
def test_a_page_that_fails_changes_nothing_of_the_run(
    library, motionary, tmp_path, monkeypatch, spoiled, told
):
    monkeypatch.setattr("motionary.workflows.report_page.report_page", spoiled)
    file = configuration(tmp_path, "[finish]\ncommand = ['touch', 'announced']")
    code, _, err = motionary("nightly", file)
    assert (code, err) == (0, "")
    assert [one.suffix for one in (tmp_path / "reports").iterdir()] == [".json"]
    report = the_report(tmp_path)
    assert (report["status"], report["exit_code"], report["error"]) == ("published", 0, None)
    (line,) = logged(tmp_path, "page")
    assert (line["ok"], line["error"]) == (False, told)
    assert (tmp_path / "announced").exists()


@pytest.mark.parametrize(
    ("limit", "exceeded"),
    [("max_quarantined = 1", True), ("max_quarantined = 0.2", True), ("max_quarantined = 2", False),
     ("max_quarantined = 0.25", False)],
)  # fmt: skip
def test_too_many_quarantined_clips_publish_nothing(library, motionary, tmp_path, limit, exceeded):
    spoil(library, 2)
    code, out, err = motionary("nightly", configuration(tmp_path, f"[limits]\n{limit}"))
    report = the_report(tmp_path)
    assert len(report["quarantined"]) == 2
    (measured,) = report["limits"]
    assert (measured["name"], measured["found"], measured["of"], measured["exceeded"]) == (
        "max_quarantined", 2, 8, exceeded,
    )  # fmt: skip
    assert (tmp_path / "catalog" / "CURRENT").exists() != exceeded
    if not exceeded:
        assert (code, report["status"]) == (3, "published")
        return
    assert (code, report["status"], report["exit_code"]) == (1, "refused", 1)
    assert "2 of 8 clips" in report["error"]
    assert report["error"] in err
    assert report["run_id"].endswith("-refused")
    assert [line["limit"] for line in logged(tmp_path, "limit_exceeded")] == ["max_quarantined"]
    assert logged(tmp_path)[-1]["status"] == "refused"


def test_the_old_snapshot_stays_where_a_limit_is_exceeded(library, motionary, tmp_path):
    file = configuration(tmp_path)
    assert motionary("nightly", file)[0] == 0
    before = Catalog.open(str(tmp_path / "catalog"))
    shutil.rmtree(library / "walk")  # a share half mounted is within the default, an empty folder more is not
    for clip in sorted((library / "squat").iterdir())[1:2]:
        clip.unlink()
    assert motionary("nightly", file)[0] == 1
    report = the_report(tmp_path)
    assert (report["status"], report["snapshot_before"], report["snapshot_after"]) == (
        "refused",
        "000001",
        None,
    )
    assert "max_removed is 0.5, and 5 of 8 clips are" in report["error"]
    assert len(report["removed"]) == 5
    assert Catalog.open(str(tmp_path / "catalog")).snapshot == before.snapshot

    assert motionary("nightly", configuration(tmp_path, "[limits]\nmax_removed = 5"))[0] == 0
    assert len(Catalog.open(str(tmp_path / "catalog")).clips) == 3


def test_clusters_thrown_into_disorder_are_not_published(library, motionary, tmp_path):
    assert motionary("nightly", configuration(tmp_path))[0] == 0
    more = "[clusters]\nn_clusters = 4\n[limits]\nmax_moved = "
    assert motionary("nightly", configuration(tmp_path, f"{more}0.05"))[0] == 1
    report = the_report(tmp_path)
    assert report["status"] == "refused"
    assert [line["limit"] for line in logged(tmp_path, "limit_exceeded")] == ["max_moved"]
    assert {"clip_id", "cluster_id"} <= report["moved"][0].keys()
    assert len(Catalog.open(str(tmp_path / "catalog")).references) == 2
    assert motionary("nightly", configuration(tmp_path, f"{more}8"))[0] == 0
    assert len(Catalog.open(str(tmp_path / "catalog")).references) == 4


def test_nothing_readable_is_not_published(library, motionary, tmp_path):
    shutil.rmtree(library / "squat")
    spoil(library, 4)
    assert motionary("nightly", configuration(tmp_path))[0] == 1
    report = the_report(tmp_path)
    assert report["status"] == "refused"
    assert not (tmp_path / "catalog" / "CURRENT").exists()


def test_a_library_that_is_not_mounted_fails_the_run(library, motionary, tmp_path):
    (tmp_path / "empty" / ".snapshots").mkdir(parents=True)
    shutil.copy(next(library.rglob("*.bvh")), tmp_path / "empty" / ".snapshots")
    for second in ("empty", "gone"):
        file = tmp_path / "nightly.toml"
        file.write_text(configuration(tmp_path).read_text().replace('"library"', f'["library", "{second}"]'))
        code, _, err = motionary("nightly", file)
        assert code == 1
        assert str(tmp_path / second) in err
        assert the_report(tmp_path)["status"] == "failed"
    assert not (tmp_path / "catalog").exists()


def test_a_dry_run_writes_nothing(library, motionary, tmp_path):
    file = configuration(tmp_path)
    before = everything_in(tmp_path)
    code, out, err = motionary("nightly", file, "--dry-run")
    assert code == 0
    assert everything_in(tmp_path) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["library", "nightly.toml"]
    assert json.loads(out)["new"] == 8


def test_a_second_writer_is_refused(library, motionary, tmp_path):
    catalog = tmp_path / "catalog"
    (catalog / "tables").mkdir(parents=True)
    with the_only_writer(Store(str(catalog)), lambda dead: None):
        code, _, err = motionary("nightly", configuration(tmp_path))
    assert code == 1
    assert f"process {os.getpid()}" in err
    (failed,) = logged(tmp_path, "failed")
    assert f"process {os.getpid()}" in failed["error"]
    assert the_report(tmp_path)["error"] == failed["error"]


def test_a_fault_of_ours_is_logged_with_its_traceback(library, motionary, tmp_path, monkeypatch):
    monkeypatch.setattr(nightly, "run", lambda *_, **__: 1 // 0)
    assert motionary("nightly", configuration(tmp_path))[0] == 1
    (failed,) = logged(tmp_path, "failed")
    assert failed["error"].startswith("ZeroDivisionError")
    assert "1 // 0" in failed["traceback"]
    assert the_report(tmp_path)["status"] == "failed"


def test_what_fails_after_publishing_does_not_hide_that_it_is_published(
    library, motionary, tmp_path, monkeypatch
):
    def full(*_, **__):
        raise OSError("no space left")

    monkeypatch.setattr(nightly, "vacuum", full)
    assert motionary("nightly", configuration(tmp_path, "[retention]\nkeep = 3"))[0] == 1
    report = the_report(tmp_path)
    assert (report["status"], report["snapshot_after"], report["error"]) == (
        "published", "000001", "no space left",
    )  # fmt: skip


def test_without_a_log_file_the_log_is_stderr(library, motionary, tmp_path):
    file = configuration(tmp_path)
    file.write_text(file.read_text().replace('[log]\nfile = "logs/nightly.jsonl"', ""))
    shutil.rmtree(library)
    code, _, err = motionary("nightly", file)
    assert code == 1
    assert [json.loads(line)["event"] for line in err.splitlines()] == [
        "started",
        "failed",
        "report",
        "finished",
    ]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the machine has no /dev/full")
def test_a_log_that_cannot_be_written_ends_no_run(library, motionary, tmp_path):
    file = configuration(tmp_path)
    file.write_text(file.read_text().replace("logs/nightly.jsonl", "/dev/full"))
    code, out, err = motionary("nightly", file)
    assert (code, json.loads(err.splitlines()[-1])["status"]) == (0, "published")


def test_a_report_that_cannot_be_written_is_a_failure(library, motionary, tmp_path):
    (tmp_path / "reports").write_text("a file where the folder should be")
    shutil.rmtree(library)
    assert motionary("nightly", configuration(tmp_path))[0] == 1
    assert [line["event"] for line in logged(tmp_path)] == ["started", "failed", "failed", "finished"]


def test_what_fails_right_after_publishing_finds_the_catalog_new(library, motionary, tmp_path, monkeypatch):
    def terminated(*_):
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr("motionary.workflows.publication.overview_page", terminated)
    assert motionary("nightly", configuration(tmp_path))[0] == 1
    report = the_report(tmp_path)
    assert (report["status"], report["snapshot_after"], report["error"]) == (
        "published", "000001", "stopped by SIGTERM",
    )  # fmt: skip
    assert report["run_id"] == Catalog.open(str(tmp_path / "catalog")).runs.to_arrow()["run_id"][-1].as_py()


@pytest.mark.parametrize("status", ["failed", "published"])
def test_no_report_takes_the_place_of_another(tmp_path, status):
    at, written = "2026-01-02T03:04:05.000+00:00", []
    for config in ("one.toml", "two.toml", "three.toml"):
        report = RunReport(config, "catalog", [], {}, "20260102T030405Z-000001", status, started_at=at)
        report.end()
        written.append(report.write(tmp_path))
    assert [json.loads(file.read_text())["config"] for file in written] == [
        "one.toml", "two.toml", "three.toml",
    ]  # fmt: skip
    assert sorted(tmp_path.iterdir()) == sorted(written)


# SIGTERM


def test_sigterm_ends_a_run_in_order(library, tmp_path):
    file = configuration(tmp_path, job="")
    file.write_text(
        file.read_text()
        .replace("workers = 1", "workers = 2")
        .replace('[log]\nfile = "logs/nightly.jsonl"', "")
    )
    program = "from motionary.workflows.cli import main\nif __name__ == '__main__': main()"
    lines = []
    command = [sys.executable, "-c", program, "nightly", str(file)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr
        for line in process.stderr:
            lines.append(json.loads(line))
            if lines[-1]["event"] == "planned":
                process.send_signal(signal.SIGTERM)
    assert process.returncode == 1
    events = [line["event"] for line in lines]
    assert events[-3:] == ["failed", "report", "finished"]
    assert lines[-3]["error"] == "stopped by SIGTERM"
    report = json.loads(Path(lines[-2]["file"]).read_text())
    assert (report["status"], report["snapshot_after"]) == ("failed", None)
    assert not (tmp_path / "catalog" / "CURRENT").exists()


def test_a_second_sigterm_does_not_end_the_tidying_up(library, motionary, tmp_path, monkeypatch):
    tidied = []

    def terminated(*_, **__):
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            tidied.append("the work")

    def announced(*_):
        os.kill(os.getpid(), signal.SIGTERM)
        tidied.append("the end")

    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(nightly, "run", terminated)
    monkeypatch.setattr(nightly, "post_report", announced)
    finish = "[finish]\nwebhook = 'http://127.0.0.1/'"
    assert motionary("nightly", configuration(tmp_path, finish))[0] == 1
    assert tidied == ["the work", "the end"]
    assert [line["event"] for line in logged(tmp_path)] == ["started", "failed", "report", "finished"]
    assert the_report(tmp_path)["error"] == "stopped by SIGTERM"
    assert signal.getsignal(signal.SIGTERM) == before


# The end


@contextmanager
def web_server(status: int | None, slow_bytes: int = 0) -> Iterator[tuple[str, list[dict]]]:
    """Take POSTs on this machine; no status: never answer. Of slow bytes it sends one each 0.1 s."""
    taken: list[dict] = []
    over = Event()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            taken.append({"type": self.headers["Content-Type"], "report": json.loads(body)})
            if status is None:
                over.wait()
                return
            self.send_response(status)
            self.flush_headers()
            for _ in range(slow_bytes):
                self.wfile.write(b"a")
                over.wait(0.1)
            self.wfile.write(b": b\r\n" if slow_bytes else b"")
            self.end_headers()

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/hook/secret", taken
    finally:
        over.set()
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.mark.parametrize("status", [200, 500, None])
def test_the_webhook_takes_the_report_and_decides_nothing(library, motionary, tmp_path, monkeypatch, status):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with web_server(status) as (url, taken):
        finish = f'[finish]\nwebhook = "{url}"\ntimeout = 0.5'
        assert motionary("nightly", configuration(tmp_path, finish))[0] == 0
    (post,) = taken
    assert post["type"] == "application/json"
    assert post["report"] == the_report(tmp_path)
    (line,) = logged(tmp_path, "webhook")
    assert line["ok"] == (status == 200)
    assert ("error" in line) == (status != 200)
    assert "secret" not in (tmp_path / "logs/nightly.jsonl").read_text() + json.dumps(post["report"])


def test_a_webhook_that_answers_byte_by_byte_is_given_up(monkeypatch):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    lines: list[str] = []
    with web_server(200, slow_bytes=30) as (url, taken):
        post_report(url, "{}", 0.5, RunLog(lines.append))
    (line,) = map(json.loads, lines)
    assert (len(taken), line["event"], line["ok"]) == (1, "webhook", False)
    assert line["error"] == "no answer within 0.5 s"


def test_a_webhook_that_nobody_serves_is_logged(library, motionary, tmp_path, monkeypatch):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with web_server(200) as (url, _):
        pass
    shutil.rmtree(library)
    assert motionary("nightly", configuration(tmp_path, f'[finish]\nwebhook = "{url}"'))[0] == 1
    (line,) = logged(tmp_path, "webhook")
    assert not line["ok"]
    assert line["error"]


def test_the_command_is_told_of_a_failure_too(library, motionary, tmp_path):
    shutil.rmtree(library)
    script = (
        "import os, pathlib; print('told'); pathlib.Path('told').write_text(os.environ['MOTIONARY_REPORT'])"
    )
    command = json.dumps([sys.executable, "-c", script])
    assert motionary("nightly", configuration(tmp_path, f"[finish]\ncommand = {command}"))[0] == 1
    assert json.loads(Path((tmp_path / "told").read_text()).read_text())["status"] == "failed"
    (line,) = logged(tmp_path, "command")
    assert (line["ok"], line["printed"]) == (True, "told\n")


@pytest.mark.parametrize(
    ("script", "error"),
    [
        ("import sys; sys.exit(7)", "exit code 7"),
        ("import time; time.sleep(60)", "timed out"),
        (None, "No such"),
    ],
)
def test_a_command_that_fails_is_logged(library, motionary, tmp_path, monkeypatch, script, error):
    monkeypatch.setattr(nightly, "_publish_and_vacuum", lambda settings, log, report: _publish(report))

    def _publish(report):
        report.status, report.exit_code, report.run_id = "published", 0, "some-run"

    command = json.dumps([sys.executable, "-c", script] if script else ["./no-such-program"])
    finish = f"[finish]\ncommand = {command}\ncommand_timeout = {1 if script and 'sleep' in script else 60}"
    assert motionary("nightly", configuration(tmp_path, finish))[0] == 0
    (line,) = logged(tmp_path, "command")
    assert not line["ok"]
    assert error in line["error"]
