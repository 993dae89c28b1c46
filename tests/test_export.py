"""Motions leave a catalog as files that others read, whole, and without surprises."""

import json
import shutil
import unicodedata
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pybvh
import pytest

from motionary.catalog import Catalog, CatalogError, export
from motionary.catalog.export_files import file_names
from motionary.catalog.export_plan import plan_export
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.catalog.snapshot import Snapshot, publish
from motionary.catalog.store import Store
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import read_motion
from motionary.pipeline.writers import motion_line, write_csv
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

WALK = "walk/walk_tired_alex_01.bvh"
SUBSTEPS = 4
HALVES = {"train": 0.5, "test": 0.5}


@pytest.fixture(scope="module")
def demo(demo_catalog) -> Catalog:
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def demo_aligned(demo, tmp_path_factory) -> Path:
    """Export the embedded library, aligned."""
    folder = tmp_path_factory.mktemp("aligned")
    written = demo.export(folder, aligned=True)
    assert [one.reason for one in written] == [None] * len(demo.clips)
    return folder


@pytest.fixture(scope="module")
def hdm05(shared_data, silent_progress, tmp_path_factory) -> Catalog:
    """Catalog of some takes of every action of HDM05, flips and all."""
    folder = tmp_path_factory.mktemp("hdm05")
    (folder / "library").mkdir()
    for file in (shared_data / "hdm05").glob("*.asf"):
        shutil.copy(file, folder / "library")
    takes = sorted((shared_data / "hdm05").glob("HDM_*_120.[aA][mM][cC]"))
    for file in takes[::6]:
        shutil.copy(file, folder / "library")
    job = Job([str(folder / "library")], str(folder / "catalog"), PipelineConfig())
    return run(job, silent_progress).catalog


def leg_lengths(catalog: Catalog) -> dict[str, float]:
    return {row["clip_id"]: row["leg_length"] for row in catalog.clips.to_arrow().to_pylist()}


def lines_of(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text(encoding="utf-8").split("\n")[:-1]]


def apart(read: Motion, written: Motion) -> float:
    """Return the greatest distance of equal joints."""
    assert sorted(read.skeleton.names) == sorted("_".join(n.split()) for n in written.skeleton.names)
    order = [read.skeleton.index("_".join(name.split())) for name in written.skeleton.names]
    return float(np.abs(read.positions()[:, order] - written.positions()).max())


def check_aligned_bvh(catalog: Catalog, folder: Path) -> None:
    legs = leg_lengths(catalog)
    for clip_id, leg in legs.items():
        written, path = catalog.aligned(clip_id), (folder / clip_id).with_suffix(".bvh")
        read = read_motion(path)
        assert read.notes == ()  # no frame is taken for a rest pose and dropped
        assert (read.frames, read.fps) == (written.frames, pytest.approx(written.fps, rel=1e-6))
        assert apart(read, written) < 1e-3 * leg, clip_id
        other = pybvh.read_bvh_file(path)
        places = other.joint_positions()[:, [other.joint_index[name] for name in written.skeleton.names]]
        assert np.abs(places - written.positions()).max() < 1e-3 * leg, clip_id
        assert other.frame_time == pytest.approx(1 / written.fps, rel=1e-6)


def check_no_jump(catalog: Catalog, folder: Path) -> None:
    """Hold the largest joint speed of every aligned BVH against the warp's slope times the input's."""
    for row in catalog.alignments.to_arrow().to_pylist():
        captured = catalog.motion(row["clip_id"])
        # Between its frames too: joints that turn fast go further on the arc than on its chord.
        count = (captured.frames - 1) * SUBSTEPS
        between = captured.sampled(np.linspace(0, captured.frames - 1, count + 1))
        allowed = np.diff(row["source_time"]).max() * largest_speed(between, captured.fps * SUBSTEPS)
        read = read_motion((folder / row["clip_id"]).with_suffix(".bvh"))
        assert largest_speed(read, read.fps) <= 1.01 * allowed, row["clip_id"]


def largest_speed(motion: Motion, fps: float) -> float:
    return float(np.linalg.norm(np.diff(motion.positions(), axis=0), axis=-1).max() * fps)


@pytest.mark.filterwarnings("ignore:Rest pose suggests")  # pybvh guesses an up axis; it plays no part here
def test_an_aligned_bvh_reads_back_in_both_readers(demo, demo_aligned):
    check_aligned_bvh(demo, demo_aligned)


def test_an_aligned_bvh_plays_without_a_jump(demo, demo_aligned):
    check_no_jump(demo, demo_aligned)


@pytest.mark.filterwarnings("ignore:Rest pose suggests")
def test_real_clips_read_back_and_play_without_a_jump(hdm05, tmp_path):
    assert len(hdm05.export(tmp_path, aligned=True)) == len(hdm05.clips) >= 18
    check_aligned_bvh(hdm05, tmp_path)
    check_no_jump(hdm05, tmp_path)


def test_real_clips_as_captured_are_the_library_again(hdm05, tmp_path):
    legs = leg_lengths(hdm05)
    (library,) = hdm05.runs.to_arrow()["library"][-1].as_py()
    for one in hdm05.export(tmp_path):
        there, here = read_motion(Path(library) / one.clip_id), read_motion(one.path)
        assert (here.frames, here.fps) == (there.frames, pytest.approx(there.fps, rel=1e-6))
        assert apart(here, there) < 1e-3 * legs[one.clip_id]


def test_an_npz_is_documented_arrays_without_pickle(demo, tmp_path):
    (one,) = demo.export(tmp_path, "npz", clips=[WALK], aligned=True)
    assert one.path == tmp_path / "walk" / "walk_tired_alex_01.npz"
    motion = demo.aligned(WALK)
    with np.load(one.path, allow_pickle=False) as arrays:
        shapes = {name: arrays[name].shape for name in arrays}
        frames, joints = motion.frames, len(motion.skeleton.names)
        assert shapes == {
            "positions": (frames, joints, 3), "rotations": (frames, joints, 4), "root_position": (frames, 3),
            "joint_names": (joints,), "parents": (joints,), "offsets": (joints, 3),
            "fps": (), "unit": (), "name": (), "label": (),
        }  # fmt: skip
        np.testing.assert_allclose(arrays["positions"], motion.positions(), rtol=1e-5, atol=1e-4)
        np.testing.assert_allclose(arrays["rotations"], motion.rotations, atol=1e-6)
        assert tuple(arrays["joint_names"]) == motion.skeleton.names
        assert tuple(arrays["parents"]) == motion.skeleton.parents
        assert (arrays["fps"], arrays["name"], arrays["label"]) == (30, WALK, "walk")
        assert np.isnan(arrays["unit"])


def test_a_csv_is_a_row_a_frame(demo, tmp_path):
    (one,) = demo.export(tmp_path, "csv", clips=[WALK], aligned=True)
    assert one.path == tmp_path / "walk" / "walk_tired_alex_01.csv"
    motion, table = demo.aligned(WALK), pd.read_csv(one.path)
    assert list(table.columns[:5]) == [
        "frame",
        "seconds",
        *(f"{a}.{motion.skeleton.names[0]}" for a in "xyz"),
    ]
    np.testing.assert_array_equal(table["frame"], np.arange(motion.frames))
    np.testing.assert_allclose(table["seconds"], np.arange(motion.frames) / 30)
    for axes, values in (("xyz", motion.positions()), (("qx", "qy", "qz", "qw"), motion.rotations)):
        names = [f"{axis}.{joint}" for joint in motion.skeleton.names for axis in axes]
        numbers = table[names].to_numpy(np.float32).reshape(values.shape)
        np.testing.assert_array_equal(numbers, values.astype(np.float32))
    assert table.shape[1] == 2 + 7 * len(motion.skeleton.names)


def test_a_motion_of_markers_is_written_without_rotations(demo, tmp_path):
    motion = demo.motion(WALK)
    places = motion.positions() - motion.root_position[:, None]
    markers = replace(motion, rotations=np.empty((motion.frames, 0, 4)), places=places)
    write_csv(markers, tmp_path / "markers.csv")
    table = pd.read_csv(tmp_path / "markers.csv")
    assert list(table.columns[2:]) == [f"{axis}.{name}" for name in motion.skeleton.names for axis in "xyz"]
    np.testing.assert_allclose(table.iloc[:, -3:], motion.positions()[:, -1], rtol=1e-6, atol=1e-6)
    line = json.loads(motion_line(markers, {"split": "train"}))
    assert (line["rotations"], line["split"]) == (None, "train")
    np.testing.assert_allclose(line["positions"], motion.positions(), atol=1e-6)


def test_no_column_of_a_csv_begins_like_a_formula(demo, tmp_path):
    motion = demo.motion(WALK)
    names = ("=1+1", "+a", "-b", "@c", 'a,"b"\n', *motion.skeleton.names[5:])
    odd = replace(motion, skeleton=replace(motion.skeleton, names=names))
    write_csv(odd, tmp_path / "odd.csv")
    table = pd.read_csv(tmp_path / "odd.csv")
    assert list(table.columns[2:18:3]) == ["x.=1+1", "x.+a", "x.-b", "x.@c", 'x.a,"b"\n', f"x.{names[5]}"]


def test_jsonl_is_a_line_a_clip(demo, tmp_path):
    written = demo.export(tmp_path, "jsonl", where="action = 'walk'")
    lines = lines_of(tmp_path / "frames.jsonl")
    assert {one.path for one in written} == {tmp_path / "frames.jsonl"}
    assert [line["clip_id"] for line in lines] == [one.clip_id for one in written]
    assert {line["action"] for line in lines} == {"walk"}
    line = next(line for line in lines if line["clip_id"] == WALK)
    motion = demo.motion(WALK)
    assert (line["fps"], line["subject"], line["label"]) == (motion.fps, "alex", "walk")
    assert line["joints"] == list(motion.skeleton.names)
    assert line["parents"] == list(motion.skeleton.parents)
    np.testing.assert_allclose(line["positions"], motion.positions(), atol=1e-6)
    np.testing.assert_allclose(line["rotations"], motion.rotations, atol=1e-6)
    np.testing.assert_allclose(line["offsets"], motion.skeleton.offsets, atol=1e-6)


@pytest.mark.parametrize("format_", ["bvh", "parquet", "jsonl"])
def test_a_split_is_a_folder_a_part(demo, tmp_path, format_):
    shares = {"train": 0.6, "val": 0.2, "test": 0.2}
    written = demo.export(tmp_path, format_, split=shares, group="subject")
    clips = {line["clip_id"]: line for line in lines_of(tmp_path / "clips.jsonl")}
    assert set(clips) == {one.clip_id for one in written} == set(demo.clips.to_arrow()["clip_id"].to_pylist())
    parts_of_subject = defaultdict(set)
    for one in written:
        clip = clips[one.clip_id]
        assert one.path == tmp_path / clip["file"]
        assert one.path.is_file()
        assert one.path.relative_to(tmp_path).parts[0] == clip["split"]
        parts_of_subject[clip["subject"]].add(clip["split"])
    assert all(len(parts) == 1 for parts in parts_of_subject.values())
    assert Counter(clip["split"] for clip in clips.values()) == {"train": 51, "val": 14, "test": 15}
    for part in shares:
        mine = {clip_id for clip_id, clip in clips.items() if clip["split"] == part}
        if format_ == "parquet":
            rows = pq.read_table(tmp_path / part / "frames.parquet")
            assert set(rows["clip_id"].to_pylist()) == mine
            assert set(rows["split"].to_pylist()) == {part}
        elif format_ == "jsonl":
            assert {line["clip_id"] for line in lines_of(tmp_path / part / "frames.jsonl")} == mine
    if format_ == "parquet":
        table = pq.read_table(tmp_path / "clips.parquet")
        assert dict(zip(table["clip_id"].to_pylist(), table["split"].to_pylist(), strict=True)) == {
            clip_id: clip["split"] for clip_id, clip in clips.items()
        }


def test_a_split_leaves_what_is_there(demo, tmp_path):
    (tmp_path / "README.md").write_text("mine")
    for how in ({"split": HALVES}, {"card": True}):
        with pytest.raises(CatalogError, match="README.md would be replaced"):
            demo.export(tmp_path, "npz", **how)
    assert [file.name for file in tmp_path.rglob("*")] == ["README.md"]


def test_the_command_splits_and_says_what_came_of_it(motionary, demo_catalog, tmp_path):
    code, out, err = motionary(
        "export", demo_catalog, tmp_path / "out", "--format", "csv", "--where", "action in ('walk', 'run')",
        "--split", "train=.75,test=.25", "--group", "subject", "--seed", 3,
    )  # fmt: skip
    assert code == 0
    card = json.loads((tmp_path / "out" / "card.json").read_text())
    counts = {part["part"]: part["clips"] for part in card["split"]["parts"]}
    assert counts == {"train": 16, "test": 4}
    assert "train 16 (80.0%, asked 0.75), test 4 (20.0%, asked 0.25)" in out
    assert "part test has 20% of the clips instead of 25%: whole groups allow no nearer" in err
    assert card["split"]["seed"] == 3
    assert len(list((tmp_path / "out" / "train").rglob("*.csv"))) == 16


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--split", "train=.8"), "two parts"),
        (("--split", "train=.8,test=.3"), "add up"),
        (("--split", "train:.8,test:.2"), "NAME=SHARE"),
        (("--group", "subject"), "for a --split"),
    ],
)
def test_a_split_that_is_none_is_wrong_usage(motionary, demo_catalog, tmp_path, options, message):
    code, _, err = motionary("export", demo_catalog, tmp_path / "out", *options)
    assert code == 2
    assert message in " ".join(err.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_parquet_is_the_table_and_what_its_rows_are_of(demo, tmp_path):
    demo.export(tmp_path, "parquet", cluster="walk", aligned=True)
    rows, clips = (pq.read_table(tmp_path / f"{name}.parquet") for name in ("aligned", "clips"))
    members = demo.sql(
        """select clip_id from clusters where cluster_id in
           (select cluster_id from "references" where label = 'walk') order by clip_id"""
    )["clip_id"].to_pylist()
    assert clips["clip_id"].to_pylist() == members
    assert rows.column_names == [*SCHEMAS["aligned"].names, "cluster_id", "label"]
    assert rows.schema.field("root_position").metadata[b"unit"] == b"source units"
    here = rows.filter(pc.equal(rows["clip_id"], members[0]))
    there = demo.aligned_frames.to_arrow()
    there = there.filter(pc.equal(there["clip_id"], members[0]))
    assert here.select(there.column_names).to_pylist() == there.to_pylist()
    assert set(clips["frame_rate"].to_pylist()) == {30.0}
    assert clips["skeleton"][0].as_py()["joints"]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["aligned.parquet", "clips.parquet"]


def test_supplied_labels_called_as_columns_of_the_export_do_not_harm_it(demo_catalog, tmp_path, monkeypatch):
    catalog = Catalog.open(demo_catalog)
    clips = catalog.clips.to_arrow()
    for name in ("label", "frame_rate", "reference_id"):
        clips = clips.append_column(name, pa.repeat("supplied", len(clips)))
    monkeypatch.setattr(catalog, "clips", SimpleNamespace(to_arrow=lambda: clips))
    catalog.export(tmp_path, "parquet", clips=[WALK], aligned=True)
    (row,) = pq.read_table(tmp_path / "clips.parquet").to_pylist()
    assert (row["label"], row["frame_rate"], row["action"]) == ("walk", 30.0, "walk")


def test_a_cluster_is_chosen_by_number_or_by_name(demo, tmp_path):
    names = {row["cluster_id"]: row["label"] for row in demo.references.to_arrow().to_pylist()}
    members = demo.clusters.to_pandas()
    number = next(number for number, name in names.items() if name == "throw")
    by_number = plan_export(demo, tmp_path, cluster=number)
    assert list(by_number.paths) == sorted(members[members.cluster_id == number].clip_id)
    assert plan_export(demo, tmp_path, cluster=str(number)).paths == by_number.paths
    throws = [number for number, name in names.items() if name == "throw"]
    by_name = plan_export(demo, tmp_path, cluster="throw")
    assert list(by_name.paths) == sorted(members[members.cluster_id.isin(throws)].clip_id)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cluster": "wlak"}, "no cluster 'wlak' in .*; did you mean walk"),
        ({"cluster": 0}, "no cluster '0' in .*; it has 1 to"),
        ({"clips": [WALK, WALK.replace("01", "09")]}, "no clip 'walk/walk_tired_alex_09.bvh'.*did you mean"),
        ({"clips": []}, "none of them is chosen"),
        ({"clips": [WALK], "cluster": 1}, "by one of them"),
        ({"where": "seconds > 1000"}, "none of them is chosen"),
        ({"clips": [WALK], "where": "action = 'run'"}, "none of them is chosen"),
        ({"where": "sceonds > 1"}, "sceonds"),
        ({"group": "subject"}, "grouped by subject for a split, and none is asked for"),
        ({"split": HALVES, "group": "subjct"}, "no column 'subjct'.*did you mean subject"),
        ({"split": HALVES, "group": "licence"}, "no clip has a value in column 'licence'"),
        ({"split": HALVES, "clips": [WALK]}, "make 1 group .*too few for the 2 parts train, test"),
        ({"split": HALVES | {"val": 0.5}}, "add up to 1.5 instead of 1"),
        ({"format": "fbx"}, "'fbx'; a motion is exported as bvh, npz, csv, parquet or jsonl"),
    ],
)
def test_what_cannot_be_chosen(demo, tmp_path, options, message):
    with pytest.raises(CatalogError, match=message):
        demo.export(tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_files_that_are_there_stay_unless_told(demo, tmp_path):
    (one,) = demo.export(tmp_path, clips=[WALK])
    one.path.write_text("mine")
    for clips in ([WALK], None):
        with pytest.raises(CatalogError, match=f"{one.path} would be replaced; name another folder"):
            demo.export(tmp_path, clips=clips)
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == [one.path]
    assert one.path.read_text() == "mine"
    demo.export(tmp_path, clips=[WALK], overwrite=True)
    assert read_motion(one.path).frames == demo.motion(WALK).frames
    (other,) = demo.export(tmp_path, "npz", clips=[WALK])  # beside other files is no trouble
    assert other.path.exists()


def test_nothing_is_written_into_the_library(demo, demo_library):
    for folder in (demo_library, demo_library / "new"):
        with pytest.raises(CatalogError, match="lies in the library .*name a folder outside"):
            demo.export(folder, overwrite=True)
    assert not (demo_library / "new").exists()


def test_two_clips_never_get_one_file():
    ids = ["a/x.bvh", "a/x.amc", "b/x.bvh", "X.amc", "x.bvh", "y.amc.bvh", "y.amc", "y.bvh", "no suffix"]
    names = file_names(ids, ".bvh")
    assert names["b/x.bvh"] == "b/x.bvh"
    assert (names["a/x.bvh"], names["a/x.amc"]) == ("a/x.bvh.bvh", "a/x.amc.bvh")
    assert (names["X.amc"], names["x.bvh"]) == ("X.amc.bvh", "x.bvh.bvh")
    assert names["no suffix"] == "no suffix.bvh"
    assert len({name.casefold() for name in names.values()}) == len(ids)
    alike = file_names(["X.bvh", "x.bvh"], ".bvh")  # both may lie in one folder, but not everywhere
    assert len({name.casefold() for name in alike.values()}) == 2
    for outside in ("../x.bvh", "/x.bvh"):
        with pytest.raises(CatalogError, match="outside the folder"):
            file_names([outside], ".bvh")


def test_a_name_does_not_depend_on_what_else_is_chosen(demo, tmp_path):
    alone = plan_export(demo, tmp_path, clips=[WALK]).paths
    assert plan_export(demo, tmp_path).paths[WALK] == alone[WALK]


def test_a_line_that_cannot_be_written_does_not_stop_the_others(demo, tmp_path, monkeypatch):
    usual = export.motion_line

    def choosy(motion, about):
        if motion.name == WALK:
            raise ValueError("a number that JSON does not know")
        return usual(motion, about)

    monkeypatch.setattr(export, "motion_line", choosy)
    written = demo.export(tmp_path, "jsonl", split=HALVES)
    assert [(one.clip_id, one.reason) for one in written if one.reason] == [
        (WALK, "a number that JSON does not know")
    ]
    lines = [line for part in HALVES for line in lines_of(tmp_path / part / "frames.jsonl")]
    assert len(lines) == len(demo.clips) - 1
    card = json.loads((tmp_path / "card.json").read_text())
    assert card["not_written"] == {WALK: "a number that JSON does not know"}
    assert card["clips"] == len(lines_of(tmp_path / "clips.jsonl")) == len(lines)


def test_a_clip_that_cannot_be_written_does_not_stop_the_others(demo, tmp_path, monkeypatch):
    usual = export.write_bvh

    def choosy(motion, path):
        if motion.name == WALK:
            raise ValueError("joint name '{' cannot stand in a BVH")
        usual(motion, path)

    monkeypatch.setattr(export, "write_bvh", choosy)
    (tmp_path / "jump").write_text("a file is in the way of a folder")
    written = demo.export(tmp_path)
    failed = {one.clip_id: one.reason for one in written if one.reason}
    assert failed.pop(WALK) == "joint name '{' cannot stand in a BVH"
    assert failed
    assert all(clip_id.startswith("jump/") for clip_id in failed)
    for one in written:
        assert one.path.is_file() == (one.reason is None)


@pytest.mark.parametrize("format_", ["bvh", "npz", "csv", "parquet", "jsonl"])
def test_a_full_disk_stops_it_and_leaves_what_was_there(demo, tmp_path, monkeypatch, format_):
    demo.export(tmp_path, format_, clips=[WALK])
    there = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert there
    for file in there:
        file.write_text("old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(CatalogError, match="cannot be written: No space left on device"):
        demo.export(tmp_path, format_, clips=[WALK], overwrite=True)
    assert [file for file in tmp_path.rglob("*") if file.is_file()] == there
    assert {file.read_text() for file in there} == {"old"}


def test_a_folder_that_cannot_be_made(demo, tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(CatalogError, match=f"{folder} cannot be written"):
            demo.export(folder)


@pytest.mark.parametrize("format_", ["npz", "parquet", "jsonl"])
def test_one_part_of_the_catalog_at_a_time(demo, tmp_path, monkeypatch, format_):
    parts = demo.files("frames")
    assert len(parts) > 1
    read = []
    usual = pq.read_table
    monkeypatch.setattr(pq, "read_table", lambda path, **how: read.append(path) or usual(path, **how))
    plan = plan_export(demo, tmp_path, format_)
    read.clear()
    outcomes = export.write_export(plan)
    next(outcomes)
    assert len(read) == 1
    assert len(list(outcomes)) == len(demo.clips) - 1
    assert len(read) == len(parts)


def catalog_without(tmp_path: Path, *tables: str) -> Catalog:
    store = Store(str(tmp_path))
    facts = store.save("none", {name: SCHEMAS[name].empty_table() for name in PUBLISHED})
    files = {name: [store.part_name(name, "none")] for name in PUBLISHED}
    parts = {files[name][0]: facts[name] for name in PUBLISHED}
    publish(store, Snapshot("000001", "2020-01-01T00:00:00+00:00", files, parts), after=None)
    catalog = Catalog.open(str(tmp_path))
    kept = {name: files[name] for name in PUBLISHED if name not in tables}
    return Catalog(store, Snapshot(catalog.snapshot.snapshot_id, "", kept))


def test_an_empty_catalog_and_an_old_one(tmp_path):
    with pytest.raises(CatalogError, match="holds no clips"):
        catalog_without(tmp_path).export(tmp_path / "out")
    old = catalog_without(tmp_path / "old", "aligned")
    with pytest.raises(CatalogError, match="no table 'aligned'; an older motionary published it"):
        old.export(tmp_path / "out", aligned=True)
    with pytest.raises(CatalogError, match="no table 'aligned'"):
        _ = old.aligned_frames
    assert not (tmp_path / "out").exists()


def test_names_are_told_apart_as_file_systems_see_them():
    names = file_names(["d.bvh/x.bvh", "d.amc", "cafe\u0301.bvh", "caf\u00e9.amc", "alone.bvh"], ".bvh")
    assert names["d.bvh/x.bvh"] == "d.bvh/x.bvh"
    assert names["d.amc"] == "d.amc.bvh"  # d.bvh is a folder
    assert names["alone.bvh"] == "alone.bvh"
    assert len({unicodedata.normalize("NFC", name) for name in names.values()}) == 5


@pytest.mark.parametrize(("folder", "problem"), [("", "has no name"), ("inside", "in the catalog .* itself")])
def test_an_export_goes_neither_nowhere_nor_into_the_catalog(demo_catalog, folder, problem):
    with pytest.raises(CatalogError, match=problem):
        Catalog.open(demo_catalog).export(f"{demo_catalog}/{folder}" if folder else "", "npz")
    assert not Path(demo_catalog, "inside").exists()
