"""CSV that a spreadsheet opens: text is never a formula, and reads back as it was."""

import csv
import io
import sys
from types import SimpleNamespace

import pyarrow as pa
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from motionary.workflows.csv_cells import csv_plain, csv_safe
from motionary.workflows.tables import write_table

STARTS = "=+-@＝＋－＠\t\r\n"
TRICKY = st.text(st.one_of(st.sampled_from("'=+-@＝＠\t\r\n\"a"), st.characters()))


@given(TRICKY)
@example("'=1")
@example("''")
@example("\n=1")
def test_reading_undoes_writing_for_every_text(text):
    assert csv_plain(csv_safe(text)) == text
    assert not csv_safe(text).startswith(tuple(STARTS))


@pytest.mark.parametrize("text", ["walk", "", "it's", "'quoted'", "1-2", " =1", "é", "a\n=1", "全＝1"])
def test_other_text_stays_as_it_is(text):
    assert csv_safe(text) == csv_plain(text) == text


@pytest.mark.parametrize("start", STARTS)
def test_what_begins_like_a_formula_gets_an_apostrophe(start):
    assert csv_safe(f"{start}cmd|' /C calc'!A0") == f"'{start}cmd|' /C calc'!A0"
    assert csv_safe(f"'{start}1") == f"''{start}1"


def csv_of(table: pa.Table, monkeypatch) -> str:
    sink = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(buffer=sink))
    write_table(table, "csv")
    monkeypatch.undo()
    return sink.getvalue().decode()


# Arrow's text is UTF-8: a lone surrogate cannot be in a table.
STORABLE = TRICKY.filter(lambda text: not any("\ud800" <= one <= "\udfff" for one in text))


@given(texts=st.lists(STORABLE, min_size=1, max_size=4))
def test_a_table_written_is_a_table_read(texts):
    with pytest.MonkeyPatch.context() as patch:
        written = csv_of(pa.table({"text": texts, "row": range(len(texts))}), patch)
    rows = list(csv.DictReader(io.StringIO(written, newline="")))
    assert [csv_plain(row["text"]) for row in rows] == texts
    assert not any(row["text"].startswith(tuple(STARTS)) for row in rows)


def test_numbers_keep_their_sign_and_no_value_stays_none(monkeypatch):
    table = pa.table({"number": [-1.5, 2.0], "text": ["-1.5", None], "whole": pa.array([-3, 4], pa.int8())})
    assert csv_of(table, monkeypatch).splitlines() == [
        '"number","text","whole"',
        """-1.5,"'-1.5",-3""",
        "2,,4",
    ]


@pytest.mark.parametrize(
    "column",
    [
        pa.array(["=1"], pa.large_string()),
        pa.array([b"=1"], pa.binary()),
        pa.array(["=1"]).dictionary_encode(),
    ],
    ids=lambda column: str(column.type),
)
def test_every_kind_of_text_and_the_header(column, monkeypatch):
    table = pa.table({"@label": column})
    assert list(csv.reader(csv_of(table, monkeypatch).splitlines())) == [["'@label"], ["'=1"]]


def test_a_query_answers_with_cells_that_are_no_formulas(motionary, demo_catalog):
    sql = "select '=HYPERLINK(1)' as name, -1 as number, ['=1'] as list"
    _, out, _ = motionary("query", demo_catalog, sql, "--format", "csv")
    assert list(csv.reader(out.splitlines()))[1] == ["'=HYPERLINK(1)", "-1", '["=1"]']
    _, out, _ = motionary("query", demo_catalog, sql, "--format", "json")
    assert '"=HYPERLINK(1)"' in out
