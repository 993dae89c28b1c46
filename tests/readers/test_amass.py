"""AMASS: the pose of a take, on a body that the reader makes up; files that must be refused."""

import io
import struct
import tracemalloc
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import find_convention
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import frame_features
from motionary.pipeline.readers import ReadError, read_motion, scan_library
from motionary.pipeline.readers.amass import mean_body, read_amass
from motionary.pipeline.readers.arrays import LARGEST_ARRAY

UPRIGHT = Rotation.from_euler("X", 90, degrees=True).as_rotvec()  # a body that stands in a Z-up world


def take(frames: int = 40, width: int = 156, rate: str = "mocap_framerate") -> dict:
    """Return a body that walks along the floor, turns to its left and bends its left knee."""
    time = np.arange(frames) / 60
    poses = np.zeros((frames, width))
    turned = Rotation.from_rotvec(np.multiply.outer(time, [0, 0, 1])) * Rotation.from_rotvec(UPRIGHT)
    poses[:, :3] = turned.as_rotvec()
    poses[:, 12] = 0.5 * time  # the left knee, joint 4, about X
    trans = np.column_stack([0.0 * time, -time, 0.9 + 0 * time])  # facing -Y is +Z here
    return {"poses": poses, "trans": trans, rate: 60.0, "gender": "female", "betas": np.zeros(16)}


@pytest.fixture
def write_npz(tmp_path: Path):
    def write(name: str = "take_poses.npz", **arrays) -> Path:
        np.savez_compressed(tmp_path / name, **arrays)
        return tmp_path / name

    return write


@pytest.mark.parametrize(("width", "model"), [(72, "SMPL pose"), (156, "SMPL-H pose"), (165, "SMPL-X pose")])
@pytest.mark.parametrize("rate", ["mocap_framerate", "mocap_frame_rate"])
def test_the_three_models(write_npz, width: int, model: str, rate: str) -> None:
    motion = read_motion(write_npz(**take(width=width, rate=rate)))
    assert (motion.frames, motion.fps, motion.unit, len(motion.skeleton.names)) == (40, 60, 1.0, 22)
    assert motion.notes[0].startswith(f"{model} (female): 22 of ")
    assert find_convention(motion.skeleton.names).name == "smpl"
    assert any("mean body of 1.70 m" in note for note in motion.notes)


def test_z_up_becomes_y_up_and_a_body_stands_on_its_feet(write_npz) -> None:
    motion = read_motion(write_npz(**take()))
    np.testing.assert_allclose(motion.root_position[:, 1], 0.9)
    np.testing.assert_allclose(motion.root_position[:, 2], np.arange(40) / 60, atol=1e-12)
    places = motion.positions()
    head, left, toe, ankle = (
        motion.skeleton.index(name) for name in ("Head", "L_Shoulder", "R_Foot", "R_Ankle")
    )
    assert (places[:, head, 1] > 1.4).all()
    assert places[0, left, 0] > 0.2  # its left at +X
    assert places[0, toe, 2] > places[0, ankle, 2] + 0.1  # facing +Z
    heading = frame_features(motion, FeatureConfig()).heading
    assert heading[-1] - heading[0] == pytest.approx(38 / 60, abs=1e-3)  # from +Z towards +X, its left


def test_rotations_are_the_files(write_npz) -> None:
    arrays = take()
    rng = np.random.default_rng(3)
    arrays["poses"][:] = rng.normal(size=arrays["poses"].shape)
    motion = read_motion(write_npz(**arrays))
    for joint in (1, 7, 21):
        expected = Rotation.from_rotvec(arrays["poses"][:, 3 * joint : 3 * joint + 3])
        assert ((expected.inv() * Rotation.from_quat(motion.rotations[:, joint])).magnitude() < 1e-9).all()
    root = Rotation.from_euler("X", -90, degrees=True) * Rotation.from_rotvec(arrays["poses"][:, :3])
    assert ((root.inv() * Rotation.from_quat(motion.rotations[:, 0])).magnitude() < 1e-9).all()


def test_the_mean_body_is_symmetrical_and_of_human_proportions() -> None:
    body = mean_body()
    rest = np.zeros((len(body.names), 3))
    for joint in range(1, len(body.names)):
        rest[joint] = rest[body.parents[joint]] + body.offsets[joint]
    for joint, name in enumerate(body.names):
        if name.startswith("L_"):
            other = rest[body.index("R_" + name[2:])]
            np.testing.assert_allclose(rest[joint] * [-1, 1, 1], other, atol=1e-12)
    sole = rest[body.index("L_Ankle"), 1] - 0.039 * 1.70
    heights = {name: (rest[body.index(name), 1] - sole) / 1.70 for name in body.names}
    # Winter, fig. 4.1, in shares of stature
    wanted = {"L_Hip": 0.530, "L_Knee": 0.285, "L_Ankle": 0.039, "L_Shoulder": 0.818}
    assert {name: heights[name] for name in wanted} == pytest.approx(wanted)


def without(*names: str, **others) -> dict:
    return {name: value for name, value in (take() | others).items() if name not in names}


@pytest.mark.parametrize(
    ("arrays", "what"),
    [
        (without("poses"), "no array 'poses'; its arrays are"),
        (without("trans"), "no array 'trans'"),
        (without("mocap_framerate"), "neither 'mocap_framerate' nor 'mocap_frame_rate'"),
        (take(width=63), r"'poses' has shape \(40, 63\)"),
        (without(poses=np.zeros(156)), "'poses' has shape"),
        (without(trans=np.zeros((39, 3))), r"'trans' has shape \(39, 3\) and 'poses' 40 rows"),
        (without(trans=np.full((40, 3), np.nan)), "'trans' holds values that are no numbers"),
        (without(trans=np.full((40, 3), 1e200)), "or larger than"),
        (without(trans=np.full((40, 3), "1")), "'trans' holds values that are no numbers"),
        (without(mocap_framerate=0.0), "rate of 0 frames a second is impossible"),
        (without(mocap_framerate=np.inf), "no numbers"),
        (without(mocap_framerate=np.ones(2)), "'mocap_framerate' has shape"),
        (take(frames=0), "no frames"),
        (without(poses=np.zeros((7300, 156)), trans=np.zeros((7300, 3)), mocap_framerate=0.5), "4.06 hours"),
        (without(poses=np.array([{}] * 3)), "'poses' holds Python objects"),
    ],
)
def test_what_is_no_motion_is_told(write_npz, arrays: dict, what: str) -> None:
    with pytest.raises(ReadError, match=what) as refused:
        read_motion(write_npz(**arrays))
    assert refused.value.mend


def test_a_pickled_gender_is_passed_over(write_npz) -> None:
    motion = read_motion(write_npz(**(take() | {"gender": np.array(["male", None], dtype=object)})))
    assert motion.notes[0].startswith("SMPL-H pose: 22 of 52")


def npy(shape: tuple[int, ...], content: bytes = b"", kind: str = "<f8") -> bytes:
    """Return an array file whose header may lie."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content


@pytest.mark.parametrize(
    ("poses", "what"),
    [
        (npy((10**12, 156)), r"declares 1\.25e\+09 MB of numbers, more than"),
        (npy((2**62, 2**62)), "declares .* MB of numbers, more than"),
        (npy((10, 156), bytes(100)), "declares 12480 bytes and holds 100"),
        (npy((-1, 156)), "declares|no whole NPZ"),
        (npy((10, 156))[:20], "no whole NPZ"),
        (b"\x93NUMPY\x09\x00", "no whole NPZ"),
        (b"", "no whole NPZ"),
        (npy((1,)).replace(b"'<f8'", b"((((("), "no whole NPZ"),
    ],
)
def test_a_header_that_lies_is_not_believed(tmp_path: Path, poses: bytes, what: str) -> None:
    path = tmp_path / "bomb.npz"
    trans = io.BytesIO()
    np.save(trans, np.zeros((10, 3)))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("poses.npy", poses)
        archive.writestr("trans.npy", trans.getvalue())
        archive.writestr("mocap_framerate.npy", trans.getvalue())
    with pytest.raises(ReadError, match=what):
        read_motion(path)


@pytest.mark.parametrize("rows", [LARGEST_ARRAY // (8 * 72) + 1, 1 << 40])
@pytest.mark.parametrize("kind", ["<f8", "|i1"])
def test_an_array_is_measured_by_what_its_numbers_take(tmp_path: Path, rows: int, kind: str) -> None:
    path = tmp_path / "large.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("poses.npy", npy((rows, 72), kind=kind))
        archive.writestr("trans.npy", npy((rows, 3), kind=kind))
    with pytest.raises(ReadError, match=r"'poses' declares .* MB of numbers, more than the 537 MB read"):
        read_motion(path)


def test_zeros_that_unpack_to_much_more_than_a_take_are_refused_unread(tmp_path: Path, monkeypatch) -> None:
    path, rows = tmp_path / "bomb.npz", 1 << 18
    arrays = {"poses": np.zeros((rows, 72), np.int8), "trans": np.zeros((rows, 3)), "mocap_framerate": 1e4}
    np.savez_compressed(path, **arrays)
    assert path.stat().st_size < 1 << 16
    monkeypatch.setattr(zipfile.ZipFile, "open", None)  # the archive's directory tells enough
    with pytest.raises(ReadError, match=r"'poses': it unpacks from 0\.\d+ MB to 19 MB"):
        read_motion(path)
    monkeypatch.undo()
    np.savez(path, **arrays)
    assert read_motion(path).frames == rows


def test_too_long_a_take_is_refused_by_its_headers(write_npz, monkeypatch) -> None:
    path = write_npz(**without(poses=np.zeros((7300, 156)), trans=np.zeros((7300, 3)), mocap_framerate=0.5))
    read, sizes = np.lib.format.read_array, []

    def counted(file, **options) -> np.ndarray:
        array = read(file, **options)
        sizes.append(array.size)
        return array

    monkeypatch.setattr(np.lib.format, "read_array", counted)
    with pytest.raises(ReadError, match="4.06 hours"):
        read_motion(path)
    assert set(sizes) == {1}  # the rate and the gender


def test_what_is_read_of_a_header_does_not_grow_with_what_it_declares(tmp_path: Path) -> None:
    path, length = tmp_path / "header.npz", 1 << 24  # a header of spaces
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 72), }".ljust(length)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("poses.npy", b"\x93NUMPY\x02\x00" + struct.pack("<I", length) + header + bytes(576))
        archive.writestr("trans.npy", npy((1, 3), bytes(24)))
    del header
    tracemalloc.start()
    try:
        with pytest.raises(ReadError, match="no whole NPZ .*header"):
            read_motion(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 22
    finally:
        tracemalloc.stop()


def test_the_way_to_a_motion_takes_little_more_memory_than_file_and_motion(tmp_path: Path) -> None:
    path, frames = tmp_path / "take.npz", 1 << 14
    poses, trans = np.ones((frames, 165), np.int8), np.zeros((frames, 3), np.int8)
    np.savez(path, poses=poses, trans=trans, mocap_framerate=120.0)
    tracemalloc.start()
    try:
        motion = read_amass(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    needed = poses.nbytes + trans.nbytes + motion.rotations.nbytes + motion.root_position.nbytes
    assert peak < 2.25 * needed, (
        peak / needed
    )  # a motion is checked in a copy; float64 of all poses takes more


def test_a_long_gender_is_not_read(write_npz) -> None:
    with pytest.raises(ReadError, match=r"'gender' declares 0\.\d+ MB of numbers, more than the 0\.0655 MB"):
        read_motion(write_npz(**without(gender=np.full(1 << 16, "x"))))


def test_any_damage_is_a_read_error(write_npz) -> None:
    path = write_npz(**take(frames=5))
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(300):
        damaged = bytearray(whole)
        for place in rng.integers(len(whole), size=rng.integers(1, 6)):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged[: rng.integers(1, len(whole) + 1)] if rng.random() < 0.3 else damaged)
        with suppress(ReadError):
            read_motion(path)


def test_bodies_shapes_in_a_library_are_no_clips(write_npz, tmp_path: Path) -> None:
    write_npz("walk_poses.npz", **take())
    for name in ("shape.npz", "neutral_stagei.npz", "male_stagei.npz"):
        write_npz(name, betas=np.zeros(16))
    (source,) = scan_library(tmp_path)
    assert (source.clip_id, source.format) == ("walk_poses.npz", "amass")
