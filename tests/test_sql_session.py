"""What a query cannot do, and that where a catalog lies, who asks and when it is closed change no answer."""

import multiprocessing
import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from motionary.catalog import Catalog, CatalogError, sql
from motionary.catalog.verify import verify
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from tests.catalogs import copied


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


def test_a_selection_that_writes_is_refused(demo_catalog, tmp_path):
    """DuckDB calls `with x as (copy ...)` a selection, and may write where it may read."""
    catalog = Path(copied(demo_catalog, tmp_path))
    before = (catalog / "CURRENT").read_bytes()
    for inner in (
        f"copy (select '999999') to '{catalog / 'CURRENT'}' (format csv, header false)",
        f"copy (select 1) to '{catalog / 'tables' / 'new.parquet'}'",
        "insert into clips select * from clips",
    ):
        for query in (
            f"with x as ({inner}), y as (from clips) select * from x",
            f"with x as ({inner}) from x;",
        ):
            with pytest.raises(CatalogError, match="a catalog is only read|clips is not an table"):
                Catalog.open(catalog).sql(query)
    assert (catalog / "CURRENT").read_bytes() == before
    assert not (catalog / "tables" / "new.parquet").exists()


@pytest.mark.parametrize(
    "query",
    ["from clips;", "select 1 -- one;", "select ? as n, ? as n", "show tables", "describe clips",
     "with t as (from clips) select count(*) from t", "(select 1) union (select 2)", "summarize clusters"],
)  # fmt: skip
def test_what_only_selects_is_answered(catalog, query):
    assert catalog.sql(query, [1, 2] if "?" in query else None).num_rows


def test_an_answer_keeps_its_order(catalog):
    ids = catalog.sql("select clip_id from clips order by clip_id desc")["clip_id"].to_pylist()
    assert ids == sorted(ids, reverse=True)


@pytest.mark.parametrize("folder", ["label=walk", "clip_id=5/weighted=0.5"])
def test_the_catalogs_place_changes_no_answer(demo_catalog, catalog, tmp_path, folder):
    elsewhere = Catalog.open(copied(demo_catalog, tmp_path / folder))
    query = "select label, count(*) as n from clusters group by label order by label"
    assert elsewhere.sql(query).equals(catalog.sql(query))
    clip_id = catalog.clips.to_arrow()["clip_id"][0].as_py()
    assert elsewhere.similar(clip_id).table.equals(catalog.similar(clip_id).table)


def test_a_query_reads_no_temporary_files_of_its_own(catalog, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".tmp").mkdir()
    (tmp_path / ".tmp" / "secret.txt").write_text("secret")
    with Catalog.open(catalog.store.url) as opened, pytest.raises(CatalogError):
        opened.sql("select content from read_text('.tmp/secret.txt')")


def test_a_supplied_label_in_other_capitals_does_not_hide_ours(demo_library, tmp_path, silent_progress):
    labels = tmp_path / "labels.csv"
    names = sorted(path.relative_to(demo_library).as_posix() for path in demo_library.glob("run/*.bvh"))
    rows = [f"{name},run,mine,7" for name in (one.removeprefix("run/") for one in names)]
    labels.write_text("\n".join(["clip_id,action,Label,Cluster_ID", *rows]) + "\n")
    url = str(tmp_path / "catalog")
    run(Job([str(demo_library / "run")], url, PipelineConfig(), labels), silent_progress)
    with Catalog.open(url) as catalog:
        assert set(catalog.sql("select label from takes")["label"].to_pylist()) == {"run"}
        assert len(catalog.where("label = 'run'")) == len(names)
        assert (
            catalog.similar(catalog.clips.to_arrow()["clip_id"][0].as_py(), 1).table["label"][0].as_py()
            == "run"
        )
    assert [check.detail for check in verify(url) if not check.passed] == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_forked_process_asks_by_connections_of_its_own(catalog):
    clip_id = catalog.clips.to_arrow()["clip_id"][0].as_py()
    expected = catalog.similar(clip_id, 3).table["clip_id"].to_pylist()
    _IN_THE_PARENT[:] = [catalog]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forking with threads, which is the point
        with multiprocessing.get_context("fork").Pool(1) as pool:
            assert pool.apply_async(_asked_in_a_fork, (clip_id,)).get(timeout=60) == expected


_IN_THE_PARENT: list[Catalog] = []


def _asked_in_a_fork(clip_id):
    return _IN_THE_PARENT[0].similar(clip_id, 3).table["clip_id"].to_pylist()


def test_closing_while_others_ask(demo_catalog):
    query = "select count(*) n from pairs a, pairs b where a.dtw < b.dtw"
    catalog = Catalog.open(demo_catalog)
    with ThreadPoolExecutor(2) as threads:
        asked = [threads.submit(catalog.sql, query) for _ in range(2)]
        catalog.close()
        assert len({one.result()["n"][0].as_py() for one in asked}) == 1


def test_a_relative_place_stays_where_it_was(demo_catalog, tmp_path, monkeypatch):
    monkeypatch.chdir(Path(demo_catalog).parent)
    with Catalog.open("catalog") as catalog:
        monkeypatch.chdir(tmp_path)
        assert catalog.sql("select count(*) n from clips")["n"][0].as_py() == len(catalog.clips) == 80
        assert catalog.store.url == "catalog"


def test_a_catalog_without_clips_has_nothing_to_compare_with(
    tmp_path, demo_library, silent_progress, motionary
):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "bad.bvh").write_text("no motion")
    url = str(tmp_path / "catalog")
    run(Job([str(tmp_path / "library")], url, PipelineConfig()), silent_progress)
    file = next(demo_library.rglob("*.bvh"))
    for options in ((), ("--within",), ("--rank", "mutual"), ("--joints", "arms")):
        code, _, told = motionary("similar", url, file, *options)
        assert (code, "has no clips" in told) == (1, True), told


def test_a_mistake_has_only_the_tables_it_names_looked_at_for_damage(catalog, monkeypatch):
    looked = []
    monkeypatch.setattr(
        sql, "damaged_file", lambda store, snapshot, names: looked.append(set(snapshot.tables))
    )
    with pytest.raises(CatalogError, match="secs"):
        catalog.sql("select secs from takes")
    assert looked == [{"clips", "clusters"}]
