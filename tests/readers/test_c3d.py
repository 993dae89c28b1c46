"""C3D: joints from markers, what they are in tables and files, and files that must be refused."""

import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import uniform
from motionary.pipeline.canonical import (
    CANONICAL_JOINTS,
    Convention,
    canonical_indices,
    find_convention,
)
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import frame_features
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import ReadError, c3d, read_motion
from motionary.pipeline.readers.markers import MARKER_SETS, joints_of, terms_of
from motionary.pipeline.stages.motions import motion_rows, read_motion_rows, skeleton_record
from motionary.pipeline.style import residual, transfer
from motionary.pipeline.synthetic import synthetic_library
from motionary.pipeline.writers import write_bvh, write_npz

OWN = Convention("dots", {joint: f"dot_{joint}" for joint in CANONICAL_JOINTS})
TO_Z_UP = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # x, -z, y


@pytest.fixture(scope="module")
def walk() -> Motion:
    return next(take.motion for take in synthetic_library(0, 1) if "walk" in take.path)


@pytest.fixture
def write_c3d(tmp_path: Path) -> Callable[..., Path]:
    """Return a way of writing places (T, 3) of markers, metres and Z up, in millimetres."""

    def write(
        markers: Mapping[str, np.ndarray],
        name: str = "take.c3d",
        rate: float = 100.0,
        unit: str = "mm",
        up: str | None = "+Z",
    ) -> Path:
        file = ezc3d.c3d()
        places = np.stack([*markers.values()], axis=1)
        file["parameters"]["POINT"]["RATE"]["value"] = [rate]
        file["parameters"]["POINT"]["LABELS"]["value"] = [*markers]
        file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
        if up is not None:
            file.add_parameter("POINT", "Y_SCREEN", [up])
        points = np.ones((4, places.shape[1], len(places)))
        points[:3] = 1000 * np.moveaxis(places, 2, 0).swapaxes(1, 2)
        file["data"]["points"] = points
        file.write(str(tmp_path / name))
        return tmp_path / name

    return write


def joints_of_motion(motion: Motion) -> np.ndarray:
    """Return the canonical joints of a motion in metres, Y up."""
    indices = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
    return motion.positions()[:, indices] * (motion.unit or 0.01)


def dots(motion: Motion) -> dict[str, np.ndarray]:
    """Return a marker on every canonical joint, Z up."""
    joints = joints_of_motion(motion) @ TO_Z_UP.T
    return {f"Anna:dot_{joint}": joints[:, n] for n, joint in enumerate(CANONICAL_JOINTS)}


def standing(frames: int = 20) -> dict[str, np.ndarray]:
    """Return Plug-in Gait markers of a figure that stands, faces -Y in a Z-up world, and is 1.7 m tall."""
    left = {
        "LASI": (0.12, -0.08, 1.0), "LPSI": (0.04, 0.1, 1.0), "LKNE": (0.12, 0, 0.5), "LANK": (0.12, 0, 0.08),
        "LTOE": (0.1, -0.15, 0.05), "LHEE": (0.1, 0.08, 0.05), "LSHO": (0.18, 0, 1.4), "LELB": (0.25, 0, 1.1),
        "LWRA": (0.25, -0.03, 0.85), "LWRB": (0.25, 0.03, 0.85), "LFHD": (0.08, -0.08, 1.65),
        "LBHD": (0.08, 0.08, 1.65),
    }  # fmt: skip
    right = {f"R{name[1:]}": (-x, y, z) for name, (x, y, z) in left.items()}
    middle = {"C7": (0, 0.06, 1.45), "CLAV": (0, -0.06, 1.4), "T10": (0, 0.1, 1.2), "STRN": (0, -0.1, 1.2)}
    return {
        name: np.tile(place, (frames, 1)).astype(float) for name, place in (left | right | middle).items()
    }


def test_markers_on_the_joints_give_the_motion_they_were_made_from(write_c3d, walk: Motion) -> None:
    read = read_motion(write_c3d(dots(walk), rate=walk.fps), conventions=[OWN])
    assert (read.frames, read.fps, read.unit) == (walk.frames, walk.fps, 0.001)
    assert read.skeleton.names == CANONICAL_JOINTS
    assert read.rotations.shape == (walk.frames, 0, 4)
    np.testing.assert_allclose(read.positions() / 1000, joints_of_motion(walk), atol=1e-5)
    config = FeatureConfig()
    np.testing.assert_allclose(
        frame_features(read, config).values, frame_features(walk, config).values, atol=2e-3
    )  # poses between frames are linear here and slerps there
    assert frame_features(read, config).convention == "canonical"
    assert any("cannot be written as BVH" in note for note in read.notes)


def test_plug_in_gait_stands_and_faces_forward(write_c3d) -> None:
    read = read_motion(write_c3d(standing()))
    place = dict(zip(read.skeleton.names, read.positions()[3] / 1000, strict=True))
    np.testing.assert_allclose(place["pelvis"], [0, 1.0, -0.01], atol=1e-6)
    np.testing.assert_allclose(place["left_hip"], [(3 * 0.16 + 0.12) / 7, 6.5 / 7, -0.06 / 7], atol=1e-6)
    np.testing.assert_allclose(place["head"], [0, 1.65, 0], atol=1e-6)
    np.testing.assert_allclose(place["left_wrist"], [0.25, 0.85, 0], atol=1e-6)
    assert place["left_toe"][2] > place["left_ankle"][2]  # facing +Z, its left at +X
    assert read.notes[0] == "joints from markers by the set 'plug-in-gait'"
    thigh = 1000 * np.linalg.norm(place["left_hip"] - place["left_knee"])
    np.testing.assert_allclose(read.skeleton.offsets[12], [0, thigh, 0], atol=1e-3)


@pytest.mark.parametrize("one", MARKER_SETS, ids=lambda one: one.name)
def test_every_set_is_found_by_its_own_markers_and_mirrors_them(one: Convention, tmp_path: Path) -> None:
    names = sorted(set().union(*map(terms_of, one.joints.values())))
    rng = np.random.default_rng(1)
    places = {name.upper(): rng.normal(size=3) for name in names}
    for name, place in places.items():  # a symmetrical figure
        if name.startswith("L"):
            places["R" + name[1:]] = place * [-1, 1, 1]
        elif not name.startswith("R"):
            place[0] = 0
    points = np.array([[*places.values()]])
    joints, notes = joints_of(tmp_path, [*places], points, 30.0)
    assert repr(one.name) in notes[0]
    by_name = dict(zip(CANONICAL_JOINTS, joints[0], strict=True))
    for joint in (name for name in CANONICAL_JOINTS if not name.startswith("right_")):
        other = by_name[joint.replace("left_", "right_")]
        np.testing.assert_allclose(by_name[joint] * [-1, 1, 1], other, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(counts=st.lists(st.tuples(st.sampled_from("ABCD"), st.integers(1, 9)), min_size=1, max_size=6))
def test_a_joint_is_the_mean_of_its_markers(counts: list[tuple[str, int]]) -> None:
    text = " + ".join(f"{count} {name}" if count > 1 else name for name, count in counts)
    places = {name: np.random.default_rng(ord(name)).normal(size=(2, 3)) for name in "ABCD"}
    own = Convention("own", dict.fromkeys(CANONICAL_JOINTS, text))
    points = np.stack([*places.values()], axis=1)
    joints, _ = joints_of(Path("x"), ["s:a", "B", "c", "D"], points, 30.0, [own])
    every = [places[name] for name, count in counts for _ in range(count)]
    np.testing.assert_allclose(joints[:, 5], np.mean(every, axis=0), atol=1e-12)


@pytest.mark.parametrize(
    ("up", "turned"),
    [
        (None, [1, 3, -2]), ("+Z", [1, 3, -2]), ("z", [1, 3, -2]), ("-Z", [1, -3, 2]), ("+Y", [1, 2, 3]),
        ("-Y", [1, -2, -3]), ("+X", [-2, 1, 3]), ("-X", [2, -1, 3]), ("odd", [1, 3, -2]),
    ],
)  # fmt: skip
def test_the_axis_that_points_up(write_c3d, up: str | None, turned: list[int]) -> None:
    markers = {f"dot_{joint}": np.array([[1.0, 2.0, 3.0]]) for joint in CANONICAL_JOINTS}
    read = read_motion(write_c3d(markers, up=up), conventions=[OWN])
    np.testing.assert_allclose(read.positions()[0, 4], np.multiply(1000, turned), rtol=1e-6)


def test_short_gaps_are_filled_in_and_told(write_c3d) -> None:
    markers = standing(200)
    markers["LKNE"][:, 1] = np.linspace(0, 1, 200)
    whole = read_motion(write_c3d(markers)).positions()
    markers["LKNE"][60:110] = np.nan  # half a second
    markers["RTOE"][:30] = 0.0  # how some programs write what they do not see
    read = read_motion(write_c3d(markers))
    np.testing.assert_allclose(read.positions(), whole, atol=1e-3)
    assert "80 unseen places of markers filled in, over at most 0.5 s" in read.notes
    markers["LKNE"][110] = np.nan
    with pytest.raises(ReadError, match=r"marker 'LKNE' is unseen for 0\.51 s from frame 60"):
        read_motion(write_c3d(markers))


def test_a_marker_that_is_not_needed_may_be_missing(write_c3d) -> None:
    markers = standing()
    markers["LHEE"][:] = np.nan
    assert read_motion(write_c3d(markers)).frames == 20


def test_other_marker_sets_are_told_their_names(write_c3d) -> None:
    markers = standing()
    markers["knee of the left"] = markers.pop("LKNE")
    with pytest.raises(
        ReadError, match=r"nearest, 'plug-in-gait', misses LKNE; .*'knee of the left'.*\[conventions"
    ):
        read_motion(write_c3d(markers))


def test_two_subjects_are_told_apart(write_c3d) -> None:
    markers = {f"A:{name}": places for name, places in standing().items()}
    both = markers | {f"B:{name}": places for name, places in standing().items()}
    assert read_motion(write_c3d(markers)).frames == 20
    with pytest.raises(ReadError, match="more than once: 'A:C7', 'B:C7'; export each subject alone"):
        read_motion(write_c3d(both))


def test_it_passes_through_tables_and_time_as_it_is(write_c3d, walk: Motion) -> None:
    read = read_motion(write_c3d(dots(walk), rate=walk.fps), conventions=[OWN])
    rows = motion_rows("take.c3d", read)
    clip = {
        "clip_id": "take.c3d",
        "skeleton": skeleton_record(read.skeleton),
        "unit": 0.001,
        "path": "take.c3d",
    }
    again = read_motion_rows(clip | {"notes": list(read.notes)}, rows, read.fps)
    np.testing.assert_allclose(again.positions(), read.positions(), atol=1e-3)  # float32, millimetres
    np.testing.assert_array_equal(again.skeleton.offsets, read.skeleton.offsets)
    halves = read.sampled(np.arange(read.frames - 1) + 0.5).positions()
    np.testing.assert_allclose(halves, (read.positions()[1:] + read.positions()[:-1]) / 2, atol=1e-9)
    warped = uniform(read.root_position, read.root_position[:40]).apply_motion(read)
    assert (warped.frames, warped.places is not None) == (40, True)


def test_style_is_the_difference_of_poses(write_c3d, walk: Motion) -> None:
    read = read_motion(write_c3d(dots(walk), rate=walk.fps), conventions=[OWN])
    moved = replace(read, places=read.places * 1.1)
    assert residual(read, read).kind == residual(walk, read).kind == residual(read, walk).kind == "pose"
    assert sum(residual(read, read).joint_energy.values()) == 0
    assert sum(residual(moved, read).joint_energy.values()) > 0
    with pytest.raises(ValueError, match="captured as markers: it has places of joints and no rotations"):
        residual(moved, read, kind="rotations")
    with pytest.raises(ValueError, match="captured as markers"):
        transfer(read, read, read)


def test_it_is_written_as_npz_and_not_as_bvh(write_c3d, tmp_path: Path) -> None:
    read = read_motion(write_c3d(standing()))
    with pytest.raises(ValueError, match="'take' was captured as markers.*write it as NPZ or Parquet"):
        write_bvh(read, tmp_path / "x.bvh")
    assert not (tmp_path / "x.bvh").exists()
    write_npz(read, tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as arrays:
        np.testing.assert_allclose(arrays["positions"], read.positions(), rtol=1e-6)
        assert arrays["rotations"].shape == (20, 0, 4)


def test_a_motion_of_markers_is_checked() -> None:
    read = Motion("m", _skeleton(), 30, np.zeros((4, 3)), np.empty((4, 0, 4)), places=np.zeros((4, 19, 3)))
    with pytest.raises(ValueError, match=r"needs \(4, 19, 3\)"):
        replace(read, places=np.zeros((4, 18, 3)))
    with pytest.raises(ValueError, match="beside itself"):
        replace(read, places=np.ones((4, 19, 3)))
    with pytest.raises(ValueError, match=r"needs \(T, 3\) and \(T, 0, 4\)"):
        replace(read, rotations=np.ones((4, 19, 4)))


def _skeleton():
    return c3d._skeleton(np.zeros((1, 19, 3)))


def test_damaged_files_are_refused_and_cost_no_worker(write_c3d) -> None:
    path = write_c3d(standing())
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(12):
        damaged = bytearray(whole)
        for place in rng.integers(2, 1600, size=4):
            damaged[place] = rng.choice([0, 127, 128, 255])
        path.write_bytes(damaged)
        try:
            read_motion(path)
        except ReadError as refused:
            told = refused.what, refused.mend
            assert all(told)
    for content, what in (
        (b"", "no C3D"),
        (b"\x02\x51" * 600, "no C3D"),
        (whole[:700], "ezc3d cannot read it"),
    ):
        path.write_bytes(content)
        with pytest.raises(ReadError, match=what):
            read_motion(path)


def test_a_reader_that_dies_or_hangs_is_told(write_c3d, monkeypatch) -> None:
    path = write_c3d(standing())
    usual = subprocess.run

    def dies(command, **options):
        return usual([command[0], "-c", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"], **options)

    def hangs(command, **options):
        return usual([command[0], "-c", "import time; time.sleep(60)"], **(options | {"timeout": 0.2}))

    monkeypatch.setattr(subprocess, "run", dies)
    with pytest.raises(ReadError, match="it ended by signal 11"):
        read_motion(path)
    monkeypatch.setattr(subprocess, "run", hangs)
    with pytest.raises(ReadError, match="did not finish it") as refused:
        read_motion(path)
    assert isinstance(refused.value.__cause__, OSError)  # so that the next run tries again


def test_without_ezc3d_it_says_what_to_install(write_c3d, monkeypatch) -> None:
    path = write_c3d(standing())
    monkeypatch.setattr(c3d.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ReadError, match=r"pip install 'motionary\[c3d\]'") as refused:
        read_motion(path)
    assert isinstance(refused.value.__cause__, ImportError)
