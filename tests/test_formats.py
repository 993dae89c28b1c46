"""The main job on a library of every format: a zip, AMASS and C3D beside BVH, from reading to export."""

import csv
import zipfile
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.catalog import Catalog
from motionary.catalog.verify import verify
from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention, canonical_indices, find_convention
from motionary.pipeline.config import FeatureConfig, PipelineConfig
from motionary.pipeline.readers import library as scanning
from motionary.pipeline.readers import read_motion, zipped
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

DOTS = Convention("dots", {joint: f"dot_{joint}" for joint in CANONICAL_JOINTS})
CONFIG = PipelineConfig(features=FeatureConfig(conventions=(DOTS,)))
ACTIONS = ("jump", "squat", "walk")


def write_as_c3d(take: Path, path: Path) -> None:
    motion = read_motion(take)
    joints = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
    places = motion.positions()[:, joints] @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]).T
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [motion.fps]
    file["parameters"]["POINT"]["LABELS"]["value"] = [DOTS.joints[joint] for joint in CANONICAL_JOINTS]
    points = np.ones((4, len(joints), motion.frames))
    points[:3] = np.moveaxis(places, 2, 0).swapaxes(1, 2)
    file["data"]["points"] = points
    file.write(str(path))


def write_as_amass(path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(60) / 60
    poses = np.zeros((60, 156))
    poses[:, :3] = Rotation.from_euler("X", 90, degrees=True).as_rotvec()
    poses[:, 3:66] = 0.3 * np.sin(2 * np.pi * np.outer(time, rng.uniform(0.5, 2, 63)))
    trans = np.column_stack([0 * time, -time, 0.9 + 0 * time])
    np.savez_compressed(path, poses=poses, trans=trans, mocap_framerate=60.0, gender="male")


@pytest.fixture(scope="module")
def library(demo_library: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four takes of each of three actions in a zip, two more as C3D, two of AMASS, and what is refused."""
    folder = tmp_path_factory.mktemp("formats") / "library"
    (folder / "amass").mkdir(parents=True)
    rows = []
    with zipfile.ZipFile(folder / "takes.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for action in ACTIONS:
            takes = sorted((demo_library / action).glob("*.bvh"))
            for take in takes[:4]:
                archive.write(take, f"{action}/{take.name}")
                rows.append({"path": f"takes.zip/{action}/{take.name}", "action": action})
            for take in takes[4:6]:
                write_as_c3d(take, folder / f"{take.stem}.c3d")
        archive.write(takes[0], "../outside.bvh")
    for seed in (1, 2):
        write_as_amass(folder / f"amass/{seed}_poses.npz", seed)
    np.savez(folder / "amass/shape.npz", betas=np.zeros(16))
    np.savez(folder / "weights.npz", weights=np.zeros(3))
    (folder / "cut.zip").write_bytes((folder / "takes.zip").read_bytes()[:-500])
    with (folder / "labels.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, ["path", "action"])
        writer.writeheader()
        writer.writerows(rows)
    return folder


@pytest.fixture(scope="module")
def ran(library: Path, silent_progress):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scanning, "_SETTLED", 0.0)
        url = str(library.parent / "catalog")
        with run(Job([str(library)], url, CONFIG, library / "labels.csv"), silent_progress).catalog:
            yield url


def test_every_format_comes_into_the_catalog(ran: str) -> None:
    with Catalog.open(ran) as catalog:
        counts = catalog.sql("select format, count(*) as clips from clips group by 1 order by 1").to_pylist()
        assert counts == [
            {"format": "amass", "clips": 2},
            {"format": "bvh", "clips": 12},
            {"format": "c3d", "clips": 6},
        ]
        refused = {row["path"]: row for row in catalog.quarantine.to_arrow().to_pylist()}
        assert refused.keys() == {"cut.zip", "takes.zip/..%2Foutside.bvh", "weights.npz"}
        assert (
            "'../outside.bvh', is no plain relative path" in refused["takes.zip/..%2Foutside.bvh"]["reason"]
        )
        assert "no whole zip" in refused["cut.zip"]["reason"]
        assert not any(row["retry"] for row in refused.values())
    assert [check for check in verify(ran) if not check.passed] == []


def test_markers_are_clustered_with_the_takes_they_were_made_from(ran: str) -> None:
    with Catalog.open(ran) as catalog:
        rows = catalog.sql(
            "select clip_id, label, format from clusters join clips using (clip_id) where format != 'amass'"
        ).to_pylist()
        assert {row["clip_id"].split("/")[-1].split("_")[0] == row["label"] for row in rows} == {True}
        kinds = catalog.sql(
            "select distinct kind from styles join clips using (clip_id) where format = 'c3d'"
        ).to_pylist()
        assert kinds == [{"kind": "pose"}]


def test_markers_come_back_from_the_catalog_as_places(ran: str, library: Path) -> None:
    with Catalog.open(ran) as catalog:
        clip_id = catalog.sql("select clip_id from clips where format = 'c3d' limit 1").to_pylist()[0][
            "clip_id"
        ]
        motion, aligned = catalog.motion(clip_id), catalog.aligned(clip_id)
    read = read_motion(library / clip_id, conventions=[DOTS])
    np.testing.assert_allclose(motion.positions(), read.positions(), atol=1e-3)
    assert aligned.places is not None
    assert aligned.fps == 30


def test_an_export_as_bvh_names_the_markers_and_goes_on(ran: str, tmp_path: Path, motionary) -> None:
    code, _, err = motionary("export", ran, tmp_path / "bvh", "--format", "bvh")
    assert code == 3
    assert err.count("was captured as markers: it has places of joints and no rotations") == 6
    assert len([*(tmp_path / "bvh").rglob("*.bvh")]) == 14
    code, _, err = motionary("export", ran, tmp_path / "npz", "--format", "npz")
    assert (code, len([*(tmp_path / "npz").rglob("*.npz")])) == (0, 20), err


def test_an_unchanged_zip_is_not_opened_and_an_unpacked_one_computes_nothing(
    ran: str, library: Path, silent_progress, monkeypatch
) -> None:
    monkeypatch.setattr(scanning, "_SETTLED", 0.0)

    def opened(path, *_state):
        assert "cut.zip" in path, "the zip was opened"
        return usual(path, *_state)

    usual = zipped._directory
    with monkeypatch.context() as patch:
        patch.setattr(zipped, "_directory", opened)
        again = run(Job([str(library)], ran, CONFIG, library / "labels.csv"), silent_progress)
        assert again.computed == 0
        again.catalog.close()
    with zipfile.ZipFile(library / "takes.zip") as archive:
        for name in archive.namelist():
            if not name.startswith(".."):
                archive.extract(name, library / "unpacked")
    (library / "takes.zip").unlink()
    work: list[str] = []
    patched = "motionary.pipeline.stages.ingest.read_motion"
    monkeypatch.setattr(patched, lambda path, **options: work.append(path) or read_motion(path, **options))
    again = run(Job([str(library)], ran, CONFIG), silent_progress)
    with again.catalog as catalog:
        assert work == []
        assert len(catalog.clips) == 20
