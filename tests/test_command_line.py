"""The command line: what it prints, where, and with which exit code."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import pyarrow.parquet as pq
import pytest

from motionary.workflows.commands.reproduce import reproduce
from motionary.workflows.reproduce import EXPERIMENTS
from tests.catalogs import copied


def test_help_answers_without_the_numerical_stack():
    script = (
        "import sys; sys.argv = ['motionary', '--help']\n"
        "from motionary.workflows.cli import main\n"
        "try: main()\n"
        "finally: print(sorted({'numpy', 'scipy', 'pyarrow', 'numba', 'dask'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "Cluster, name and align" in done.stdout
    assert done.stdout.strip().endswith("[]")


@pytest.mark.parametrize("command", ["run", "demo", "status", "query", "graph"])
def test_every_command_has_help(motionary, command):
    code, out, _ = motionary(command, "--help")
    assert code == 0
    assert "Usage: motionary" in out


@pytest.mark.parametrize(
    ("file", "options", "expected"),
    [
        ("[clusters]\nthreshold = 0.3", ("--kappa", 3), (3, None, "all", None)),
        ("[clusters]\nn_clusters = 3", ("--mu", 0.3), (None, 0.3, "all", None)),
        (
            '[clusters]\nlandmarks = 9\n[distances]\npairs = "landmarks"',
            ("--primary", "complete", "--mu", 0.3, "--prune"),
            (None, 0.3, "pruned", None),
        ),
        (
            '[clusters]\nprimary = "complete"\nthreshold = 0.3\n[distances]\npairs = "pruned"',
            ("--landmarks", 9),
            (None, 0.3, "landmarks", 9),
        ),
    ],
)
def test_an_option_wins_over_what_excludes_it_in_the_file(
    motionary, demo_library, tmp_path, monkeypatch, file, options, expected
):
    jobs = []
    monkeypatch.setattr("motionary.workflows.commands.run._run", lambda job, as_json: jobs.append(job))
    (tmp_path / "motionary.toml").write_text(file)
    config = ("--config", tmp_path / "motionary.toml")
    code, _, err = motionary("run", demo_library, tmp_path / "out", *config, *options)
    assert code == 0, err
    clusters, pairs = jobs[0].config.clusters, jobs[0].config.distances.pairs
    assert (clusters.n_clusters, clusters.threshold, pairs, clusters.landmarks) == expected


def test_run_prints_what_it_found(motionary, demo_library, demo_catalog, tmp_path):
    catalog = copied(demo_catalog, tmp_path)
    code, out, err = motionary(
        "run", demo_library, catalog, "--labels", demo_library / "labels.csv", "--workers", 1
    )
    assert code == 0
    for words in (
        "clips, 0 quarantined",
        "reference",
        "reward-punish",
        "ARI",
        "widest strip",
        "b_dtw",
        "fuzzy",
        "Time:",
    ):
        assert words in out
    assert str(catalog) in out
    assert "ingest: " in err
    assert "results were there already" in err
    assert "ingest: " not in out


def test_a_run_with_quarantined_clips_exits_3(motionary, demo_library, tmp_path):
    library = tmp_path / "library"
    library.mkdir()
    (library / "bad.bvh").write_text("HIERARCHY\n")
    good = next(demo_library.rglob("squat*.bvh"))
    (library / "good.bvh").write_bytes(good.read_bytes())
    code, out, _ = motionary("run", library, tmp_path / "out", "--workers", 1)
    assert code == 3
    assert "1 clip, 1 quarantined, 1 cluster\n" in out
    assert "bad.bvh" in out


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("run", "nowhere", "out"), 1, "nowhere"),
        (("run", "{library}", "{out}", "--labels", "none.csv"), 1, "no labels file none.csv"),
        (("run", "{library}", "{out}", "--config", "none.toml"), 1, "no configuration file none.toml"),
        (("run", "{library}", "{out}", "--clusters", "2", "--threshold", "1"), 2, "not both"),
        (("run", "{library}", "{out}", "--clusters", "999"), 1, "999 clusters are asked for"),
        (("query", "{catalog}", "create table t as select 1"), 1, "a catalog is only read"),
        (("query", "{catalog}", "select 1; select 2"), 1, "give one statement"),
        (
            ("run", "{library}", "{out}", "--labels", "{labels}", "--label-column", "mood"),
            1,
            "no column 'mood'",
        ),
        (
            ("run", "{library}", "{out}", "--scheduler", "tcp://127.0.0.1:9", "--workers", "1"),
            1,
            "no Dask scheduler",
        ),
        (("status", "nowhere"), 1, "nowhere is not a catalog"),
        (("status", "{catalog}", "--clip", "gone.bvh"), 1, "no clip 'gone.bvh'"),
        (("query", "{catalog}", "select oops"), 1, "oops"),
        (("graph", "graph.png"), 1, "written as .svg or .txt"),
        (("run", "{library}", "{out}", "--primary", "single"), 2, "--primary"),
        (("run", "{library}"), 2, "CATALOG"),
        (("query", "{catalog}", "select 1", "--format", "xml"), 2, "--format"),
        (("dance",), 2, "dance"),
    ],
)
def test_a_mistake_is_one_clear_line(
    motionary, demo_library, demo_catalog, tmp_path, arguments, code, message
):
    places = {"library": demo_library, "catalog": demo_catalog, "out": tmp_path / "out"}
    places["labels"] = demo_library / "labels.csv"
    got, out, err = motionary(*(argument.format(**places) for argument in arguments))
    assert got == code
    assert message in err
    assert "Traceback" not in err
    assert out == ""
    if code == 1:
        assert err.splitlines()[-1].startswith("motionary: ")
        assert all(line.startswith(("motionary: ", "clips: ")) for line in err.splitlines())


def test_query_formats(motionary, demo_catalog):
    sql = "select label, count(*) as clips from clusters group by label order by label"
    _, table, _ = motionary("query", demo_catalog, sql)
    _, as_json, _ = motionary("query", demo_catalog, sql, "--format", "json")
    _, as_csv, _ = motionary("query", demo_catalog, sql, "--format", "csv")
    _, as_parquet, _ = motionary("query", demo_catalog, sql, "--format", "parquet", binary=True)
    rows = json.loads(as_json)
    assert [row["label"] for row in rows] == [
        "jump",
        "kick",
        "punch",
        "run",
        "squat",
        "throw",
        "walk",
        "wave",
    ]
    assert [row["label"] for row in csv.DictReader(io.StringIO(as_csv))] == [row["label"] for row in rows]
    assert pq.read_table(io.BytesIO(as_parquet)).to_pylist() == rows
    assert all(row["label"] in table for row in rows)


def test_nested_values_survive_csv(motionary, demo_catalog):
    _, out, _ = motionary("query", demo_catalog, "select eta from alignments limit 1", "--format", "csv")
    assert isinstance(json.loads(next(csv.DictReader(io.StringIO(out)))["eta"]), list)


def test_a_long_value_is_not_cut_where_nobody_looks(motionary, demo_catalog):
    _, out, _ = motionary("query", demo_catalog, "select repeat('x', 150) || 'end' as long")
    assert "xend" in out.replace("\n", "")


def test_status_of_a_catalog_and_of_a_clip(motionary, demo_catalog):
    code, out, _ = motionary("status", demo_catalog)
    assert code == 0
    assert "Clusters" in out
    code, out, _ = motionary("status", demo_catalog, "--clip", "walk/walk_neutral_alex_01.bvh")
    assert code == 0
    assert "walk" in out
    assert "reference" in out


def test_graph_as_text_and_picture(motionary, tmp_path, demo_library):
    code, _, _ = motionary("graph", tmp_path / "graph.txt")
    assert code == 0
    lines = (tmp_path / "graph.txt").read_text().splitlines()
    assert lines[0] == "ingest 1"
    assert "compare 2 <- resample 1, resample 2" in lines
    waits = next(line for line in lines if line.startswith("represent 1 <- ")).split(" <- ")[1].split(", ")
    assert {*waits} == {
        "identify 1",
        *(f"ingest {n}" for n in (1, 2, 3)),
        *(f"compare {n}" for n in range(1, 7)),
    }
    assert "name 1 <- cluster 1, represent 1" in lines
    motionary("graph", tmp_path / "graph.svg", "--library", demo_library)
    picture = (tmp_path / "graph.svg").read_text()
    assert picture.startswith("<svg")
    assert picture.count("<rect") > picture.count(">ingest ") > 1


def test_names_with_brackets_and_columns_of_one_name_are_shown(motionary, demo_catalog):
    _, out, _ = motionary("query", demo_catalog, "select '[bold]x' as a, 'second' as b, 'third' as b")
    assert "[bold]x" in out
    assert "second" in out
    assert "third" in out


def test_version(motionary):
    code, out, _ = motionary("--version")
    assert code == 0
    assert out.strip().count(".") >= 1


def test_a_folder_of_other_files_is_not_taken_for_a_catalog(motionary, demo_library):
    code, out, err = motionary("run", demo_library, demo_library, "--workers", 1)
    assert (code, out) == (1, "")
    assert "is no catalog and holds other files (jump, kick, labels.csv); name a new folder" in err
    assert not (demo_library / "tables").exists()


def test_a_fault_inside_a_worker_is_one_line(demo_library, tmp_path):
    command = [sys.executable, "-c", "from motionary.workflows.cli import main; main()", "run", demo_library]
    done = subprocess.run(
        [*command, "/proc/nowhere", "--workers", "2"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("motionary: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("sql", "format_", "reader", "lines"),
    [
        ("select * from frames", "csv", "head -2", 2),
        ("select * from frames", "json", "head -2", 2),
        ("select * from range(20000)", "table", "head -2", 2),
        ("select 1", "csv", "true", 0),  # so short an answer is sent when all is done
        ("select 1", "table", "true", 0),
    ],
)
def test_a_reader_that_has_seen_enough_ends_it_quietly(demo_catalog, sql, format_, reader, lines):
    command = f"{sys.executable} -c 'from motionary.workflows.cli import main; main()' query {demo_catalog}"
    shown = subprocess.run(
        ["bash", "-c", f"{command} '{sql}' --format {format_} | {reader}; exit ${{PIPESTATUS[0]}}"],
        capture_output=True, text=True, check=False, env=os.environ | {"PYTHONUNBUFFERED": ""},
    )  # fmt: skip
    assert len(shown.stdout.splitlines()) == lines
    assert shown.stderr == ""
    assert shown.returncode == 128 + signal.SIGPIPE


def test_an_answer_that_can_go_nowhere_is_refused_before_the_work():
    command = f"{sys.executable} -c 'from motionary.workflows.cli import main; main()' align a.bvh b.bvh"
    shown = subprocess.run(f"{command} >&-", shell=True, capture_output=True, text=True, check=False)
    assert (shown.returncode, shown.stderr.count("\n")) == (1, 1)
    assert "standard output is closed" in shown.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("format_", ["csv", "table"])
def test_an_answer_that_finds_no_room_is_a_failure(demo_catalog, format_):
    command = f"{sys.executable} -c 'from motionary.workflows.cli import main; main()' query {demo_catalog}"
    shown = subprocess.run(
        f"{command} 'select 1' --format {format_} > /dev/full",
        shell=True, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (shown.returncode, shown.stderr.count("\n")) == (1, 1)
    assert "no space left on device; make room there" in shown.stderr


INTERVAL = "interval '1 year -2 days 03:04:05.000006'"
ODD = {
    INTERVAL: "12 months -2 days 11045.000006 seconds",
    "interval 0 days": "0 seconds",
    f"[{INTERVAL}]": ["12 months -2 days 11045.000006 seconds"],
    "union_value(num := 2)": 2,
    "[union_value(word := 'a')]": ["a"],
    "struct_pack()": {},
    "map {}": [],
    "['nan'::double]": [None],
    "null::interval": None,
}
"""What not every format has a type for, and what JSON says of it."""


@pytest.mark.parametrize("value", ODD)
def test_what_a_format_cannot_hold_is_text(motionary, demo_catalog, value):
    sql, expected = f"select {value} as odd", ODD[value]
    assert json.loads(motionary("query", demo_catalog, sql, "--format", "json")[1]) == [{"odd": expected}]
    _, out, _ = motionary("query", demo_catalog, f"{sql}, 1 as row", "--format", "csv")
    (row,) = csv.DictReader(io.StringIO(out))
    assert row["odd"] == (expected or "" if isinstance(expected, str | None) else json.dumps(expected))
    code, out, err = motionary("query", demo_catalog, sql, "--format", "parquet", binary=True)
    assert (code, err) == (0, "")
    (held,) = pq.read_table(io.BytesIO(out))["odd"].to_pylist()
    if "nan" not in value:
        assert held == (json.dumps(expected) if isinstance(expected, int | list | dict) else expected)
    assert motionary("query", demo_catalog, sql)[0] == 0


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("'10101'::bit", r"\x03\xF5"),
        (r"'\xAA\x00=\x5C\x27a'::blob", r"\xAA\x00=\x5C\x27a"),
        ("'a'::blob", "a"),
    ],
)
def test_bytes_are_text_that_gives_them_back(motionary, demo_catalog, value, text):
    _, out, _ = motionary("query", demo_catalog, f"select {value} as bytes", "--format", "csv")
    assert out.splitlines() == ['"bytes"', f'"{text}"']
    _, out, _ = motionary("query", demo_catalog, f"select {value} as bytes", "--format", "json")
    assert json.loads(out) == [{"bytes": text}]
    same = f"select {value}::blob = '{text}'::blob as same" if "bit" not in value else "select true as same"
    assert json.loads(motionary("query", demo_catalog, same, "--format", "json")[1]) == [{"same": True}]


def test_an_interval_as_text_gives_it_back(motionary, demo_catalog):
    sql = f"select {INTERVAL} = '{ODD[INTERVAL]}'::interval as same"
    assert json.loads(motionary("query", demo_catalog, sql, "--format", "json")[1]) == [{"same": True}]


@pytest.mark.parametrize("format_", ["json", "parquet"])
def test_columns_of_one_name_are_not_lost(motionary, demo_catalog, format_):
    code, out, err = motionary("query", demo_catalog, "select 1 as a, 2 as b, 3 as b", "--format", format_)
    assert (code, out) == (1, "")
    assert "motionary: 2 columns are called 'b'" in err
    _, out, _ = motionary("query", demo_catalog, "select 1 as a, 2 as b, 3 as b", "--format", "csv")
    assert out.splitlines() == ['"a","b","b"', "1,2,3"]


@pytest.mark.parametrize("format_", ["json", "table"])
@pytest.mark.parametrize("value", ["'infinity'::timestamp", "[date '20000-01-01']"])
def test_a_date_that_python_does_not_have_is_told_by_its_column(motionary, demo_catalog, value, format_):
    code, out, err = motionary("query", demo_catalog, f"select 1 as a, {value} as far", "--format", format_)
    assert (code, out) == (1, "")
    assert "motionary: column 'far' holds a value that cannot be written" in err
    assert '"far"::varchar' in err


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["cotw"], "cotw needs a labelled CATALOG"),
        (["style", "somewhere"], "takes no CATALOG"),
        (["gtw", "somewhere"], "takes no CATALOG"),
        (["dtw"], "'dtw' is not one of 'dtw-curve', 'dtw-curve-better', 'cotw', 'gtw'"),
    ],
)
def test_reproduce_tells_what_an_experiment_is_made_on(motionary, arguments, problem):
    code, out, log = motionary("reproduce", *arguments)
    assert (code, out) == (2, "")
    assert problem in " ".join(log.replace("│", " ").split())


@pytest.mark.slow
def test_reproduce_names_every_experiment():
    assert set(get_args(get_type_hints(reproduce)["name"])) == set(EXPERIMENTS)


@pytest.mark.slow
def test_reproduce_cotw_prints_its_tables_and_writes_its_values(motionary, demo_catalog):
    code, out, _ = motionary("reproduce", "cotw", demo_catalog, "--draws", 1)
    assert code == 0
    assert "CoTW" in out
    code, out, _ = motionary("reproduce", "cotw", demo_catalog, "--draws", 1, "--format", "csv")
    assert code == 0
    assert out.splitlines()[0].count(",") >= 3


def test_run_takes_what_alignment_attends_to(motionary, tmp_path, demo_library):
    code, _, log = motionary("run", demo_library, tmp_path / "catalog", "--weights", "hands")
    assert code == 2
    assert "'hands' is not one of 'full', 'legs', 'arms'" in " ".join(log.replace("│", " ").split())
