"""`motionary label`: what it prints, what it changes, what it refuses."""

import csv
import io
import json
from pathlib import Path

import pytest

from motionary.catalog import Catalog
from tests.catalogs import copied

WALK = "walk/walk_tired_alex_01.bvh"


@pytest.fixture
def catalog(demo_catalog, tmp_path) -> str:
    """A copy of the embedded library's catalog, to be changed."""
    return copied(demo_catalog, tmp_path)


@pytest.fixture
def label(motionary, catalog):
    """Run a command on the copy; returns exit code, stdout and stderr."""

    def call(command: str, *arguments: object):
        return motionary("label", command, catalog, *arguments)

    return call


@pytest.fixture
def decisions(tmp_path):
    def write(*rows: str) -> Path:
        file = tmp_path / "decisions.csv"
        file.write_text("\n".join(rows))
        return file

    return write


def names(catalog: str) -> dict[str, tuple[str, str]]:
    rows = Catalog.open(catalog).clusters.to_arrow().to_pylist()
    return {row["clip_id"]: (row["label"], row["label_source"]) for row in rows}


def labels(label) -> dict[str, str]:
    return {row["clip_id"]: row["label"] for row in json.loads(label("list", "--format", "json")[1])}


def test_set_list_and_remove(label, catalog, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "ada")
    assert label("set", WALK, "trudge") == (0, "", "labels of 1 clip changed in snapshot 000002\n")
    assert names(catalog)[WALK] == ("trudge", "override")
    (row,) = json.loads(label("list", "--format", "json")[1])
    assert {key: row[key] for key in ("clip_id", "label", "set_by", "in_library")} == {
        "clip_id": WALK, "label": "trudge", "set_by": "ada", "in_library": True,
    }  # fmt: skip
    assert label("set", WALK, "trudge")[2] == "every label was so already; nothing was changed\n"
    assert label("remove", WALK)[0] == 0
    assert names(catalog)[WALK] == ("walk", "supplied")
    assert labels(label) == {}


def test_a_pattern_means_all_clips_that_match(label, catalog):
    _, _, said = label("set", "walk/*", "stroll")
    assert said == "labels of 10 clips changed in snapshot 000002\n"
    assert {clip for clip, (name, _) in names(catalog).items() if name == "stroll"} == {
        clip for clip in names(catalog) if clip.startswith("walk/")
    }
    label("set", "*_tired_*", "slow")
    assert labels(label)[WALK] == "slow"
    label("remove", "*")
    assert labels(label) == {}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("set", "walk/walk_tired_alex_1.bvh", "x"),
            rf"no clip 'walk/walk_tired_alex_1.bvh' (did you mean {WALK}",
        ),
        (("set", "WALK/*", "x"), "no clip 'WALK/*'"),
        (("set", WALK, " "), "'' cannot be the label of"),
        (("remove", WALK), f"the list of labels of {{catalog}} has no clip '{WALK}'"),
        (("import", "none.csv"), "no labels file none.csv"),
    ],
)
def test_a_mistake_is_one_clear_line(label, catalog, arguments, message):
    code, out, said = label(*arguments)
    assert (code, out) == (1, "")
    assert message.format(catalog=catalog) in said
    assert said.count("\n") == 1
    assert Catalog.open(catalog).snapshot.snapshot_id == "000001"


def test_import_refuses_typos_all_together_and_changes_nothing(label, catalog, decisions):
    file = decisions(
        "clip_id,label", f"{WALK},trudge", "walk/wolk_tired_alex_01.bvh,x", "nobody,y", "nowhere,"
    )
    code, out, said = label("import", file)
    assert (code, out) == (1, "")
    assert (
        f"nothing was changed: {catalog} has no clip 'nobody', 'walk/wolk_tired_alex_01.bvh' (did you" in said
    )
    assert "nowhere" not in said  # it has no label
    assert Catalog.open(catalog).snapshot.snapshot_id == "000001"
    assert labels(label) == {}


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (("clip_id,action", f"{WALK},trudge"), "has no column label; it has clip_id, action"),
        (("clip,label", f"{WALK},trudge"), "no column path or clip_id"),
        (("clip_id,label", f"{WALK},a", "walk/walk_tired_bea_02.bvh,", f"{WALK},b"), "in rows 2, 4"),
        (("clip_id,label", f'{WALK},"two\nlines"'), "cannot be the label"),
    ],
)
def test_a_wrong_file_is_explained_and_changes_nothing(label, catalog, decisions, rows, message):
    code, _, said = label("import", decisions(*rows))
    assert (code, said.startswith("motionary: ")) == (1, True)
    assert message in said
    assert Catalog.open(catalog).snapshot.snapshot_id == "000001"


def test_a_file_by_path_as_labels_files_are(label, demo_library, tmp_path):
    library = tmp_path / "link"
    library.symlink_to(demo_library)
    file = tmp_path / "decisions.csv"
    file.write_text(f"path,label\nlink/{WALK},trudge\n")
    assert label("import", file)[0] == 0
    assert labels(label) == {WALK: "trudge"}


def test_a_file_without_a_decision(label, decisions):
    code, _, said = label("import", decisions("clip_id,label", f"{WALK},", "nobody,"))
    assert (code, said) == (0, "there is no label to set; nothing was changed\n")


def test_the_review_is_edited_and_imported(label, catalog, tmp_path):
    listed = label("review", "--format", "csv", "-n", "1")
    rows = list(csv.DictReader(io.StringIO(listed[1])))
    assert [row["reason"] for row in rows] == ["mislabelled"]
    assert rows[0]["label"] == ""
    rows[0]["label"] = rows[0]["suggested"]
    file = tmp_path / "review.csv"
    with file.open("w", newline="") as out:
        writer = csv.DictWriter(out, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    assert label("import", file)[0] == 0
    clip = rows[0]["clip_id"]
    assert names(catalog)[clip] == (rows[0]["suggested"], "override")
    assert clip not in label("review", "--format", "csv")[1]


def test_what_a_spreadsheet_must_not_run_survives_a_round_trip(label, decisions, tmp_path):
    label("import", decisions("clip_id,label", f"{WALK},=2+3", "walk/walk_tired_bea_02.bvh,'quoted"))
    before = labels(label)
    assert before == {WALK: "=2+3", "walk/walk_tired_bea_02.bvh": "'quoted"}
    _, listed, _ = label("list", "--format", "csv")
    assert '"=2' not in listed
    (tmp_path / "listed.csv").write_text(listed)
    label("remove", "*")
    label("import", tmp_path / "listed.csv")
    assert labels(label) == before


def test_the_review_is_cut_and_says_so(label):
    label("set", "*_01.bvh", "act")  # half of each cluster or so: many are called by it
    count = len(json.loads(label("review", "--format", "json", "-n", 1000)[1]))
    assert count > 10
    code, out, said = label("review", "-n", 2)
    assert (code, len(out.splitlines())) == (0, 3)
    assert said == f"2 of {count} clips; -n {count} lists them all\n"


@pytest.mark.parametrize("error", [KeyError("getpwuid"), OSError("no user")])
def test_a_user_that_the_system_does_not_know(label, monkeypatch, error):
    def nobody():
        raise error

    monkeypatch.setattr("getpass.getuser", nobody)
    monkeypatch.setattr("os.getuid", lambda: 4711)
    label("set", WALK, "trudge")
    assert "user 4711" in label("list")[1]


@pytest.mark.parametrize("command", ["set", "remove", "import", "list", "review"])
def test_every_command_has_help_and_takes_the_catalog_first(motionary, command):
    code, out, _ = motionary("label", command, "--help")
    assert code == 0
    assert f"Usage: motionary label {command} [OPTIONS] {{CATALOG}}" in " ".join(out.split())


def test_a_path_that_reads_like_a_clip_but_leads_elsewhere_is_refused(label, tmp_path):
    file = tmp_path / "decisions.csv"
    file.write_text(f"path,label\n{WALK},trudge\n")  # relative to this folder, where no clip is
    code, _, said = label("import", file)
    assert (code, f"has no clip {WALK!r}" in said) == (1, True)
    assert labels(label) == {}
