"""New motions find their clusters as a slow search does, and what cannot be read stops nothing."""

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.assign import ASSIGNMENTS, assign
from motionary.catalog.membership import Clusters, degree_of_membership, place
from motionary.catalog.store import Store
from motionary.pipeline.config import ClusterConfig, PipelineConfig
from motionary.pipeline.distances import cost_matrix, dtw_curve, dtw_distance, weighted_distance
from motionary.pipeline.distances.nearest import pack_library
from motionary.pipeline.features import motion_features
from motionary.pipeline.readers import read_motion
from motionary.pipeline.synthetic import write_library

WALK = "walk/walk_tired_alex_01.bvh"


@pytest.fixture(scope="module")
def demo(demo_catalog) -> Catalog:
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def other_library(tmp_path_factory) -> Path:
    """Write takes that the embedded catalog does not hold."""
    folder = tmp_path_factory.mktemp("other")
    write_library(folder, seed=1)
    return folder


def clusters_of(catalog: Catalog) -> dict[str, dict]:
    return {row["clip_id"]: row for row in catalog.clusters.to_arrow().to_pylist()}


def test_the_same_as_a_slow_search(demo, other_library):
    files = sorted(other_library.glob("*/*.bvh"))[::16]
    features = {clip_id: rows for clip_id, rows in demo.everything().features(merged=True)}
    members = clusters_of(demo)
    references = {row["cluster_id"]: row["clip_id"] for row in members.values() if row["is_reference"]}
    for file, row in zip(files, assign(demo, files).to_pylist(), strict=True):
        query = motion_features(read_motion(file))
        curves = {one: dtw_curve(cost_matrix(query, other)) for one, other in features.items()}
        distance = {one: weighted_distance(curve) for one, curve in curves.items()}
        nearest = min(distance, key=distance.__getitem__)
        cluster = members[nearest]["cluster_id"]
        others = [one for one in distance if members[one]["cluster_id"] != cluster]
        second = min(others, key=distance.__getitem__)
        reference = references[cluster]
        low, high = curves[reference].min(), curves[reference].max()
        keys = np.array([(curves[one].min() + curves[one].max()) / 2 for one in references.values()])
        degree = ((low + high) / 2) ** -2 / (keys**-2).sum()

        assert row["file"] == str(file)
        assert row["nearest_clip"] == nearest
        assert row["distance"] == pytest.approx(distance[nearest], rel=1e-6)
        assert row["distance_to_reference"] == pytest.approx(distance[reference], rel=1e-6)
        assert row["second_cluster"] == members[second]["cluster_id"]
        assert row["second_distance"] == pytest.approx(distance[second], rel=1e-6)
        assert (row["fuzzy_low"], row["fuzzy_high"]) == pytest.approx((low, high))
        assert row["degree"] == pytest.approx(degree)
        own = [one for one in members.values() if one["cluster_id"] == cluster]
        if row["distance_to_reference"] <= 1.5 * max(one["distance_to_reference"] for one in own):
            name = demo.sql('select label from "references" where cluster_id = ?', [cluster])["label"][
                0
            ].as_py()
            share = sum(one["label"] == name for one in own) / (len(own) + 1)
            assert (row["status"], row["cluster_id"], row["label"]) == ("assigned", cluster, name)
            assert row["confidence"] == pytest.approx(share)


def test_most_takes_of_other_people_get_their_name(demo, other_library):
    found = assign(demo, other_library).to_pylist()
    assert len(found) == 80
    right = [row["label"] == Path(row["file"]).parent.name for row in found]
    assert np.mean(right) > 0.9


def test_a_copy_lies_at_its_clip_and_in_its_cluster(demo, demo_library):
    members = clusters_of(demo)
    for row in assign(demo, demo_library).to_pylist():
        clip_id = Path(row["file"]).relative_to(demo_library).as_posix()
        assert (row["status"], row["distance"]) == ("assigned", 0)
        assert row["cluster_id"] == members[clip_id]["cluster_id"]
        assert row["distance_to_reference"] == members[clip_id]["distance_to_reference"]
        if members[clip_id]["is_reference"]:
            assert row["degree"] == 1


def test_what_can_be_given(demo, demo_library, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "takes" / "deep").mkdir(parents=True)
    content = (demo_library / WALK).read_bytes()
    for name in ("takes/b.bvh", "takes/deep/a.bvh", "takes/[odd].bvh"):
        (tmp_path / name).write_bytes(content)
    (tmp_path / "takes" / "notes.txt").write_text("no motion")
    with zipfile.ZipFile("takes.zip", "w") as archive:
        archive.writestr("one/c.bvh", content)
    motion = replace(read_motion(demo_library / WALK), name="mine")
    asked = ["takes.zip", "takes/**/*", Path("takes"), "takes/[odd].bvh", motion, "takes.zip/one/c.bvh"]
    found = assign(demo, asked)
    inside = ["takes/[odd].bvh", "takes/b.bvh", "takes/deep/a.bvh"]
    expected = ["takes.zip/one/c.bvh", *inside, *inside, "takes/[odd].bvh", "mine", "takes.zip/one/c.bvh"]
    assert found["file"].to_pylist() == expected
    assert set(found["nearest_clip"].to_pylist()) == {WALK}
    assert assign(demo, "takes/b.bvh")["label"].to_pylist() == ["walk"]
    assert assign(demo, motion)["label"].to_pylist() == ["walk"]
    assert assign(demo, []).schema == ASSIGNMENTS


def test_a_bad_file_stops_no_other(demo, demo_library, tmp_path):
    good = demo_library / WALK
    broken = tmp_path / "broken.bvh"
    broken.write_bytes(good.read_bytes()[:-200])
    (tmp_path / "empty").mkdir()
    (tmp_path / "letter.txt").write_text("dear")
    (tmp_path / "not.zip").write_text("not one")
    asked = [
        good,
        broken,
        tmp_path / "gone.bvh",
        good,
        tmp_path / "empty",
        tmp_path / "letter.txt",
        tmp_path / "not.zip",
        str(tmp_path / "*.amc"),
        tmp_path / ("long" * 100 + ".bvh"),
        tmp_path / "odd\udcff.bvh",
        good,
    ]
    calls = []
    found = assign(demo, asked, advance=lambda: calls.append(1)).to_pylist()
    assert [row["status"] == "assigned" for row in found] == [one is good for one in asked]
    assert len(calls) == len(asked)
    bad = [row for row in found if row["status"] == "unreadable"]
    assert all(row["reason"] and row["mend"] and row["cluster_id"] is None for row in bad)
    assert bad[0]["line"] > 0
    assert bad[1]["reason"] == "there is no such file"
    assert bad[-1]["file"].endswith("odd\\xff.bvh")


def test_nothing_is_written(demo_catalog, demo_library):
    def content():
        files = [
            path for path in Path(demo_catalog).rglob("*") if path.is_file() and "leases" not in path.parts
        ]
        return {path: path.stat().st_mtime_ns for path in files}

    before = content()
    with Catalog.open(demo_catalog) as catalog:
        assign(catalog, demo_library / WALK)
    assert content() == before


def test_an_empty_catalog_says_so(tmp_path, publish_rows, demo_library):
    settings = {"read": {}, "features": {"conventions": []}, "distances": {}, "clusters": {}, "alignment": {}}
    publish_rows(Store(str(tmp_path)), runs=[{"settings": json.dumps(settings)}])
    with pytest.raises(CatalogError, match="has no clips"):
        assign(Catalog.open(tmp_path), demo_library / WALK)


def still(*value: float) -> np.ndarray:
    """A clip of one frame: its distance to another is the weights' sum times that of the frames."""
    return np.array([value], dtype=np.float32)


SCALE = weighted_distance(np.ones(8))
CLIPS = [still(0), still(1), still(10), still(14), still(30)]


def clusters(**fields) -> Clusters:
    usual = dict(
        ids=[3, 5, 9],
        names=["walk", None, "run"],
        confidence=[0.5, 0.0, 0.25],
        reach=[1.5 * SCALE, 6 * SCALE, 0.0],
        name_reach=[1.2 * SCALE, -1.0, 0.0],
        nearest_reach=3 * SCALE,
        references=[CLIPS[0], CLIPS[2], CLIPS[4]],
        clip_ids=list("abcde"),
        cluster_of=np.array([0, 0, 1, 1, 2]),
        library=pack_library(CLIPS),
        config=PipelineConfig(),
    )
    return Clusters(**(usual | fields))


@pytest.mark.parametrize(
    ("at", "status", "cluster", "label", "confidence", "nearest"),
    [
        (0.9, "assigned", 3, "walk", 0.5, "b"),
        (1.4, "assigned", 3, None, 0.0, "b"),  # beyond the reach of the name
        (1.6, "unassigned", None, None, 0.0, "b"),  # beyond the reach of the cluster
        (15.9, "assigned", 5, None, 0.0, "d"),  # of a cluster without a name
        (16.5, "unassigned", None, None, 0.0, "d"),
        (30.0, "assigned", 9, "run", 0.25, "e"),
        (30.1, "unassigned", None, None, 0.0, "e"),  # a cluster of one clip takes copies of it
    ],
)
def test_reach_of_cluster_and_name(at, status, cluster, label, confidence, nearest):
    found = place(clusters(), still(at))
    assert (found.status, found.cluster_id, found.label, found.confidence) == (
        status,
        cluster,
        label,
        confidence,
    )
    assert found.nearest_clip == nearest
    assert (found.reason is None) == (status == "assigned")


def test_unlike_any_clip():
    far = clusters(reach=[100.0] * 3)
    assert place(far, still(-2.9)).status == "assigned"
    beyond = place(far, still(-3.1))
    assert beyond.status == "unassigned"
    assert "unlike any clip" in beyond.reason


def test_a_single_cluster_has_no_second():
    alone = clusters(cluster_of=np.zeros(5, dtype=np.int64), references=CLIPS[:1])
    found = place(alone, still(0.5))
    assert (found.second_cluster, found.second_distance, found.degree) == (None, None, 1.0)
    assert found.nearest_clip == "a"  # as near as b


@pytest.mark.parametrize(("primary", "tau"), [("ward", 0.5), ("fuzzy", 0.2)])
def test_the_distance_is_the_primary_one(primary, tau):
    rng = np.random.default_rng(0)
    clips = [rng.normal(size=(frames, 3)).astype(np.float32) for frames in (5, 9, 7, 6, 8)]
    config = PipelineConfig(clusters=ClusterConfig(primary=primary, metric="dtw", fuzzy_tau=tau))
    some = clusters(library=pack_library(clips), references=clips[::2], config=config)
    query = rng.normal(size=(6, 3)).astype(np.float32)
    costs = [cost_matrix(query, clip) for clip in clips]
    curves = [dtw_curve(cost) for cost in costs]
    expected = {
        "ward": [dtw_distance(cost) for cost in costs],
        "fuzzy": [(1 - tau) * curve.min() + tau * curve.max() for curve in curves],
    }[primary]
    found = place(some, query)
    assert found.distance == pytest.approx(min(expected), rel=1e-6)
    assert found.nearest_clip == "abcde"[int(np.argmin(expected))]


@given(hnp.arrays(np.float64, st.integers(1, 6), elements=st.floats(0, 10, width=16)))
def test_degrees_add_up_to_one(distances):
    degrees = [degree_of_membership(distances, k) for k in range(len(distances))]
    assert sum(degrees) == pytest.approx(1)
    assert np.argmax(degrees) == np.argmin(distances)


def test_the_command(motionary, demo_catalog, demo_library, tmp_path):
    code, out, err = motionary("assign", demo_catalog, demo_library / WALK, demo_library / "jump")
    assert code == 0
    assert out.split()[:2] == ["file", "status"]
    assert out.split().count("assigned") == 11
    assert "11 files: 11 assigned, 0 unassigned, 0 unreadable" in err

    gone = tmp_path / "gone.bvh"
    code, out, err = motionary("assign", demo_catalog, gone, demo_library / WALK, "--format", "json")
    assert code == 3
    assert [row["status"] for row in json.loads(out)] == ["unreadable", "assigned"]
    assert list(json.loads(out)[0]) == ASSIGNMENTS.names
    assert f"{gone}: there is no such file; check the path" in err

    code, out, _ = motionary("assign", demo_catalog, gone, "--format", "csv")
    assert (code, out.splitlines()[0].replace('"', "").split(",")) == (3, ASSIGNMENTS.names)
    code, out, _ = motionary("assign", demo_catalog, demo_library / WALK, "--format", "parquet", binary=True)
    assert pq.read_table(io.BytesIO(out)).schema.equals(ASSIGNMENTS)


def test_real_clips_are_named_by_made_up_ones(demo, shared_data):
    walks = assign(demo, sorted(shared_data.glob("bandai/dataset-1_walk_*"))).to_pydict()
    assert set(walks["label"]) <= {"walk", None}
    assert walks["status"].count("assigned") >= len(walks["status"]) / 2
    bows = assign(demo, str(shared_data / "bandai/dataset-1_bow_*")).to_pydict()
    assert bows["status"].count("assigned") <= len(bows["status"]) / 10
