"""The main job: nothing lost, nothing recomputed, the same bytes however it is run."""

import errno
import json
import shutil
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from motionary.catalog import Catalog
from motionary.catalog.schema import PUBLISHED
from motionary.catalog.snapshot import OVERVIEW
from motionary.catalog.store import Store
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.stages import ingest
from motionary.workflows.errors import UserError
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job


def manifest(catalog: Path | str) -> dict:
    current = (Path(catalog) / "CURRENT").read_text()
    return json.loads((Path(catalog) / "snapshots" / f"{current}.json").read_text())


def table_bytes(catalog: Path | str) -> dict[str, bytes]:
    """Every file of a snapshot but those that hold times: the runs, and when the inputs were changed."""
    tables = manifest(catalog)["tables"]
    files = [file for name in tables if name not in ("runs", "inputs") for file in tables[name]]
    return {file: (Path(catalog) / file).read_bytes() for file in files}


@pytest.fixture
def few(demo_library, tmp_path) -> Path:
    """A small library: eight clips of two actions."""
    library = tmp_path / "few"
    for action in ("walk", "squat"):
        for file in sorted((demo_library / action).glob("*.bvh"))[:4]:
            (library / action).mkdir(parents=True, exist_ok=True)
            shutil.copy(file, library / action)
    return library


def job(library: Path, catalog: Path, *, tile: int = 3, **options) -> Job:
    return Job([str(library)], str(catalog), PipelineConfig(distances=DistanceConfig(tile=tile)), **options)


def test_a_page_that_finds_no_room_is_told_with_what_is_published(
    few, tmp_path, monkeypatch, silent_progress
):
    usual = Store.write

    def full(store: Store, name: str, content) -> None:
        if name == OVERVIEW:
            raise OSError(errno.ENOSPC, "No space left on device", name)
        usual(store, name, content)

    with monkeypatch.context() as patch:
        patch.setattr(Store, "write", full)
        with pytest.raises(UserError, match=r"snapshot 000001 is published, but its page is not: .*space"):
            run(job(few, tmp_path / "out"), silent_progress)
    assert len(Catalog.open(tmp_path / "out").clips) == 8
    run(job(few, tmp_path / "out"), silent_progress)
    assert (tmp_path / "out" / OVERVIEW).is_file()


def test_every_table_is_there_with_its_rows(demo_catalog, demo_library):
    catalog = Catalog.open(demo_catalog)
    clips = len(list(demo_library.rglob("*.bvh")))
    assert clips >= 60
    expected = {
        "clips": clips,
        "pairs": clips * (clips - 1) // 2,
        "clusters": clips,
        "alignments": clips,
        "quarantine": 0,
    }
    assert {name: len(getattr(catalog, name)) for name in expected} == expected
    frames, aligned = (
        catalog.sql(f"select clip_id, count(*) n from {t} group by 1") for t in ("frames", "aligned")
    )
    assert sorted(frames["n"].to_pylist()) == sorted(catalog.clips.to_arrow()["frames"].to_pylist())
    assert len(aligned) == clips


def test_the_embedded_actions_are_told_apart(demo_catalog):
    # A regression bound well under what is reached (see the README's table), labels hidden.
    cuts = Catalog.open(demo_catalog).cuts.to_pandas()
    assert cuts[cuts.primary].ari.item() > 0.7
    assert cuts[cuts.primary].ari_true.item() > 0.7


def test_names_reach_the_unlabelled_clips(few, tmp_path, silent_progress):
    walks, squats = (
        sorted(path.relative_to(few).as_posix() for path in few.rglob(f"{a}*")) for a in ("walk", "squat")
    )
    walks, squats = walks[1:], squats[1:]  # the folders come first
    rows = [
        f"{path},{action}" for paths, action in ((walks, "stroll"), (squats, "crouch")) for path in paths[:-1]
    ]
    labels = few / "labels.csv"
    labels.write_text("\n".join(["path,action", *rows, "elsewhere/other.bvh,fly", f"{walks[-1]},"]))
    result = run(job(few, tmp_path / "out", labels=labels), silent_progress)
    assert result.labels_outside == ["elsewhere/other.bvh"]
    named = {row["clip_id"]: row for row in result.catalog.clusters.to_arrow().to_pylist()}
    assert [named[path]["label"] for path in walks] == ["stroll"] * 4
    assert [named[path]["label"] for path in squats] == ["crouch"] * 4
    assert [named[path]["label_source"] for path in squats] == ["supplied"] * 3 + ["propagated"]
    assert named[walks[-1]]["confidence"] == pytest.approx(3 / 4)


def test_a_second_run_computes_nothing_and_changes_nothing(few, tmp_path, silent_progress):
    first = run(job(few, tmp_path / "out"), silent_progress)
    before = table_bytes(tmp_path / "out")
    second = run(job(few, tmp_path / "out"), silent_progress)
    assert (first.reused, second.computed) == (0, 0)
    assert second.reused == first.computed
    assert table_bytes(tmp_path / "out") == before
    assert len(second.catalog.runs) == 2
    assert second.catalog.snapshot.snapshot_id == "000002"


@pytest.mark.parametrize(("tile", "workers", "memory"), [(3, 2, None), (8, 1, None), (1, 1, 500_000_000)])
def test_tables_are_the_same_for_any_workers_tiles_and_memory(
    few, tmp_path, silent_progress, tile, workers, memory
):
    run(job(few, tmp_path / "one"), silent_progress)
    run(job(few, tmp_path / "other", tile=tile, workers=workers, memory=memory), silent_progress)
    if tile == 3:
        assert table_bytes(tmp_path / "other") == table_bytes(tmp_path / "one")
    one, other = Catalog.open(tmp_path / "one"), Catalog.open(tmp_path / "other")
    for table in set(PUBLISHED) - {"runs", "inputs"}:
        order = ", ".join({"pairs": ["clip_a", "clip_b"], "cuts": ["method", "metric"]}.get(table, ["all"]))
        query = f'select * from "{table}" order by {order}'
        assert one.sql(query).equals(other.sql(query)), table


def test_an_interrupted_run_leaves_the_old_catalog_and_the_next_finishes(
    few, tmp_path, silent_progress, monkeypatch
):
    out, uninterrupted = tmp_path / "out", tmp_path / "uninterrupted"
    run(job(few, out), silent_progress)
    shutil.copytree(out, uninterrupted)
    before = manifest(out)
    shutil.copy(next(few.rglob("walk*.bvh")), few / "zz_another.bvh")

    def power_cut(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("motionary.workflows.publication.publish", power_cut)
        with pytest.raises(KeyboardInterrupt):
            run(job(few, out), silent_progress)
    assert manifest(out) == before
    assert len(Catalog.open(out).clips) == 8

    resumed = run(job(few, out), silent_progress)
    assert resumed.computed == 0
    run(job(few, uninterrupted), silent_progress)
    assert table_bytes(out) == table_bytes(uninterrupted)


def test_a_half_stored_result_is_computed_again(few, tmp_path, silent_progress):
    run(job(few, tmp_path / "out"), silent_progress)
    before = table_bytes(tmp_path / "out")
    (tmp_path / "out" / manifest(tmp_path / "out")["tables"]["features"][0]).unlink()
    again = run(job(few, tmp_path / "out"), silent_progress)
    assert again.computed == 1
    assert table_bytes(tmp_path / "out") == before


def test_an_opened_catalog_keeps_its_snapshot(few, tmp_path, silent_progress):
    opened = run(job(few, tmp_path / "out"), silent_progress).catalog
    next(few.rglob("squat*.bvh")).unlink()
    later = run(job(few, tmp_path / "out"), silent_progress).catalog
    assert (len(opened.clips), len(later.clips)) == (8, 7)
    assert opened.sql("select count(*) n from clips")["n"].to_pylist() == [8]


def test_what_cannot_be_read_is_quarantined_and_nothing_else_is_missing(few, tmp_path, silent_progress):
    good = next(few.rglob("walk*.bvh")).read_text()
    lines = good.splitlines()
    motion = lines.index("MOTION")
    (few / "cut.bvh").write_text("\n".join(lines[:-3]))
    (few / "empty.bvh").write_text("")
    (few / "letter.bvh").write_text("Dear animator,\nthe take is in the other folder.\n")
    (few / "nan.bvh").write_text(
        "\n".join([*lines[: motion + 4], "nan " + lines[motion + 4].split(" ", 1)[1], *lines[motion + 5 :]])
    )
    brace = next(n for n, line in enumerate(lines) if line.strip() == "}")
    (few / "brace.bvh").write_text("\n".join(lines[:brace] + lines[brace + 1 :]))
    (few / "alone.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\n")
    cart = "ROOT cart\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n}\n"
    (few / "cart.bvh").write_text(f"HIERARCHY\n{cart}MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n")

    catalog = run(job(few, tmp_path / "out"), silent_progress).catalog
    rows = {row["path"]: row for row in catalog.quarantine.to_arrow().to_pylist()}
    assert set(rows) == {
        "cut.bvh",
        "empty.bvh",
        "letter.bvh",
        "nan.bvh",
        "brace.bvh",
        "alone.amc",
        "cart.bvh",
    }
    assert all(row["reason"] and row["mend"] for row in rows.values())
    assert all(row["line"] for path, row in rows.items() if path != "cart.bvh")
    assert rows["nan.bvh"]["line"] == motion + 5
    assert rows["letter.bvh"]["line"] == 1
    assert len(catalog.clips) == 8


def test_a_library_of_nothing_readable_still_tells_what_is_wrong(tmp_path, silent_progress):
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "bad.bvh").write_text("HIERARCHY")
    catalog = run(job(tmp_path / "library", tmp_path / "out"), silent_progress).catalog
    assert (len(catalog.clips), len(catalog.quarantine), len(catalog.clusters)) == (0, 1, 0)


@pytest.mark.parametrize("clips", [1, 2, 3])
def test_very_small_libraries(few, tmp_path, silent_progress, clips):
    library = tmp_path / "small"
    library.mkdir()
    for file in sorted(few.rglob("*.bvh"))[:clips]:
        shutil.copy(file, library)
    catalog = run(job(library, tmp_path / "out"), silent_progress).catalog
    assert len(catalog.clusters) == len(catalog.alignments) == clips
    assert catalog.clusters.to_pandas().is_reference.sum() == len(catalog.references)


def test_a_fault_of_ours_on_one_file_is_shown_and_stops_nothing(few, tmp_path, silent_progress, monkeypatch):
    usual = ingest.frame_features

    def broken(motion, config):
        if "walk" in motion.name:
            raise TypeError("a bug")
        return usual(motion, config)

    monkeypatch.setattr(ingest, "frame_features", broken)
    catalog = run(job(few, tmp_path / "out"), silent_progress).catalog
    assert (len(catalog.clips), len(catalog.quarantine)) == (4, 4)
    assert "unexpected TypeError: a bug (test_main_job.py:" in catalog.quarantine.to_pandas().reason[0]


def test_a_fault_in_the_middle_publishes_nothing(few, tmp_path, silent_progress, monkeypatch):
    def broken(*_):
        raise TypeError("a bug")

    monkeypatch.setattr("motionary.pipeline.stages.cluster.join_labels", broken)
    with pytest.raises(TypeError, match="a bug"):
        run(job(few, tmp_path / "out"), silent_progress)
    assert not (tmp_path / "out" / "CURRENT").exists()


@pytest.mark.parametrize("primary", ["ward", "complete", "average", "fuzzy"])
def test_every_linkage_can_be_published(few, tmp_path, silent_progress, primary):
    config = PipelineConfig(clusters=ClusterConfig(primary=primary, n_clusters=2))
    catalog = run(Job([str(few)], str(tmp_path / "out"), config), silent_progress).catalog
    cuts = catalog.cuts.to_pandas()
    assert cuts[cuts.primary].method.tolist() == [primary]
    assert set(cuts.method) == {"complete", "ward", "fuzzy", primary}
    groups = (
        catalog.clusters.to_pandas()
        .groupby("cluster_id")
        .clip_id.agg(lambda ids: {i.split("/")[0] for i in ids})
    )
    assert sorted(groups) == [{"squat"}, {"walk"}]


def test_aligned_motions_are_as_long_as_their_reference_and_closer_to_it(demo_catalog):
    catalog = Catalog.open(demo_catalog)
    rows = catalog.sql(
        """select a.*, r.frames, c.is_reference from alignments a
           join clusters c using (clip_id) join "references" r on r.cluster_id = a.cluster_id"""
    ).to_pylist()
    for row in rows:
        assert len(row["source_time"]) == row["frames"]
        assert sum(row["eta"]) == 0
        assert np.all(np.diff(row["source_time"]) >= 0)
        if row["is_reference"]:
            assert not any(row["eta"])
            assert row["correlation"] == row["correlation_before"]
    gained = np.mean([row["correlation"] - row["correlation_before"] for row in rows])
    assert gained > 0


def test_any_tool_reads_the_parquet(demo_catalog):
    files = [str(Path(demo_catalog) / file) for file in manifest(demo_catalog)["tables"]["pairs"]]
    expected = len(Catalog.open(demo_catalog).pairs)
    assert duckdb.sql(f"select count(*) from read_parquet({files})").fetchall() == [(expected,)]
    assert sum(len(pd.read_parquet(file)) for file in files) == expected
    assert sum(len(pq.read_table(file)) for file in files) == expected
    assert pq.read_schema(files[0]).field("weighted").metadata[b"unit"] == b"feature"


def test_a_clip_that_changes_under_the_run_is_set_aside(few, tmp_path, silent_progress, monkeypatch):
    usual = ingest.read_motion

    def meanwhile(path, **options):
        motion = usual(path, **options)
        if path.endswith(changed.name):
            changed.write_text(changed.read_text() + "\n")
        return motion

    changed = next(few.rglob("walk*.bvh"))
    monkeypatch.setattr(ingest, "read_motion", meanwhile)
    catalog = run(job(few, tmp_path / "out"), silent_progress).catalog
    (row,) = catalog.quarantine.to_arrow().to_pylist()
    assert row["reason"] == "it is not what it was when the run began"
    assert row["mend"].startswith("run again")
    monkeypatch.undo()
    assert len(run(job(few, tmp_path / "out"), silent_progress).catalog.clips) == 8
