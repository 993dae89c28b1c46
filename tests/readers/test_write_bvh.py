"""What is written reads back, in our reader and in pybvh."""

from pathlib import Path

import numpy as np
import pybvh
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.writers import write_bvh

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


def assert_same(read: Motion, written: Motion) -> None:
    order = [written.skeleton.index(name) for name in read.skeleton.names]
    assert sorted(order) == list(range(len(written.skeleton.names)))
    np.testing.assert_allclose(read.positions(), written.positions()[:, order], atol=1e-4)
    ours, theirs = (
        Rotation.from_quat(q.reshape(-1, 4)) for q in (read.rotations, written.rotations[:, order])
    )
    assert np.degrees((ours.inv() * theirs).magnitude()).max() < 1e-4
    assert read.fps == pytest.approx(written.fps, rel=1e-6)


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    """Random trees and poses, poles of every Euler order among them."""
    joints, frames = draw(st.integers(1, 8)), draw(st.integers(1, 4))
    parents = (-1, *(draw(st.integers(0, j - 1)) for j in range(1, joints)))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rotations = random.normal(size=(frames, joints, 4))
    if draw(st.booleans()):
        quarter_turns = random.integers(-4, 5, size=(frames * joints, 3)) * 90
        rotations = (
            Rotation.from_euler("XYZ", quarter_turns, degrees=True).as_quat().reshape(frames, joints, 4)
        )
        rotations += random.choice([0, 1e-9, 1e-7, 1e-5]) * random.normal(size=rotations.shape)
    skeleton = Skeleton(
        ("Hips", *(f"j{j}" for j in range(1, joints))), parents, random.normal(size=(joints, 3)) * 20
    )
    fps = draw(st.sampled_from([24, 29.97, 30, 59.94, 60, 120, 240, 12.5]))
    return Motion("random", skeleton, fps, random.normal(size=(frames, 3)) * 300, rotations)


@given(motions(), st.sampled_from(ORDERS))
@settings(max_examples=100, deadline=None)
def test_round_trip(tmp_path_factory, motion: Motion, order: str) -> None:
    path = tmp_path_factory.getbasetemp() / "written.bvh"
    write_bvh(motion, path, rotation_order=order)
    assert_same(read_motion(path, keep_first_frame=True), motion)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    "clip", ["bandai/dataset-1_walk_normal_002.bvh", "cmu/007_12.bvh", "pairs/11_01.amc",
             "hdm05/HDM_dg_squat1Reps_026_120.amc"]
)  # fmt: skip
def test_round_trip_of_real_clips(shared_data: Path, tmp_path: Path, clip: str, order: str) -> None:
    motion = read_motion(shared_data / clip).sampled(np.arange(12.0))
    write_bvh(motion, tmp_path / "a.bvh", rotation_order=order)
    back = read_motion(tmp_path / "a.bvh", keep_first_frame=True)
    assert back.skeleton.names[0] == motion.skeleton.names[0]
    assert back.notes == ()
    assert_same(back, motion)


@pytest.mark.filterwarnings("ignore:Rest pose suggests")  # pybvh guesses an up axis; it plays no part here
def test_pybvh_reads_it_too(shared_data: Path, tmp_path: Path) -> None:
    motion = read_motion(shared_data / "bandai" / "dataset-1_walk_normal_002.bvh")
    write_bvh(motion, tmp_path / "a.bvh")
    other = pybvh.read_bvh_file(tmp_path / "a.bvh")
    theirs = other.joint_positions()[:, [other.joint_index[name] for name in motion.skeleton.names]]
    np.testing.assert_allclose(theirs, motion.positions(), atol=1e-4)


def spinning(names: tuple[str, ...] = ("Hips", "a")) -> Motion:
    turns = Rotation.from_euler("Y", np.arange(60)[:, None] * 25, degrees=True).as_quat()
    rotations = np.tile([0.0, 0, 0, 1], (60, 2, 1))
    rotations[:, 1] = turns
    return Motion("spin", Skeleton(names, (-1, 0), np.ones((2, 3))), 30, np.zeros((60, 3)), rotations)


def test_angles_do_not_jump(tmp_path: Path) -> None:
    write_bvh(spinning(), tmp_path / "a.bvh", rotation_order="YXZ")
    text = (tmp_path / "a.bvh").read_text()
    assert text.splitlines()[-1].split()[6] == "1475.000000"
    assert "-0.000000" not in text


def test_names_and_orders_that_cannot_be_written(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    write_bvh(spinning(("My Hips", "left leg")), path)
    assert read_motion(path).skeleton.names == ("My_Hips", "left_leg")
    before = path.read_bytes()
    for names, what in (
        (("a b", "a_b"), "two joints"),
        (("a", "{b"), "cannot stand"),
        (("a", " "), "cannot stand"),
    ):
        with pytest.raises(ValueError, match=what):
            write_bvh(spinning(names), path)
    for order in ("XYX", "xy", ""):
        with pytest.raises(ValueError, match="rotation_order"):
            write_bvh(spinning(), path, rotation_order=order)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.bvh"]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.bvh"
    path.write_text("old")

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="no space"):
        write_bvh(spinning(), path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bvh"]
