"""ASF/AMC against a slow reader in plain matrices, against the BVH of the same motion, and damaged."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import ReadError, read_motion
from tests.readers.conftest import SMALL_AMC


def about(axis: str, degrees: float) -> np.ndarray:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array(
        {
            "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[axis]
    )


@pytest.fixture
def pair(small_asf: str, small_amc: str, write_file) -> Path:
    write_file("small.asf", small_asf)
    return write_file("small_01.amc", small_amc)


def test_small_pair_agrees_with_plain_matrices(pair: Path) -> None:
    motion = read_motion(pair)
    assert motion.skeleton.names == ("root", "hip", "femur", "foot", "spine")
    root = about("z", 30) @ about("y", 20) @ about("x", 10)
    frame = about("z", 20)
    femur = frame @ about("z", 30) @ about("y", 20) @ about("x", 10) @ frame.T
    start = np.array([1, 2, 3])
    hip_end = start + root @ [2, 0, 0]
    femur_end = hip_end + root @ femur @ [0, -7, 0]
    expected = [start, start, hip_end, femur_end, start]
    np.testing.assert_allclose(motion.positions()[0], expected, atol=1e-12)
    assert motion.unit == pytest.approx(0.0254 / 0.45)
    assert (motion.fps, motion.frames) == (120, 2)


def test_foot_turns_about_its_own_axes_in_dof_order(pair: Path) -> None:
    motion = read_motion(pair)
    frame = about("z", 20) @ about("y", 7e-16) @ about("x", -90)
    expected = frame @ about("z", 2) @ about("x", 1) @ frame.T
    x, y, z, w = motion.rotations[0, motion.skeleton.index("foot")]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    np.testing.assert_allclose(np.eye(3) + 2 * w * cross + 2 * cross @ cross, expected, atol=1e-12)


def test_bvh_of_the_same_motion(shared_data: Path) -> None:
    amc = read_motion(shared_data / "pairs" / "01_01.amc")
    bvh = read_motion(shared_data / "pairs" / "01_01.bvh")  # without its rest pose in frame 0
    assert amc.frames == bvh.frames == 2751
    same = {"root": "Hips", "lfemur": "LeftUpLeg", "ltibia": "LeftLeg", "lfoot": "LeftFoot",
            "ltoes": "LeftToeBase", "rfemur": "RightUpLeg", "rtibia": "RightLeg", "rfoot": "RightFoot",
            "rtoes": "RightToeBase", "upperback": "Spine", "thorax": "Spine1"}  # fmt: skip
    mine = amc.positions()[:, [amc.skeleton.index(name) for name in same]]
    theirs = bvh.positions()[:, [bvh.skeleton.index(name) for name in same.values()]]
    np.testing.assert_allclose(mine, theirs, atol=1e-3)
    # The BVH leaves out two lengths of the arm's chain, but not its directions.
    upper = [[m.skeleton.index(n) for n in names] for m, names in
             ((amc, ("lhumerus", "lradius")), (bvh, ("LeftArm", "LeftForeArm")))]  # fmt: skip
    arms = [np.diff(m.positions()[:, joints], axis=1) for m, joints in ((amc, upper[0]), (bvh, upper[1]))]
    np.testing.assert_allclose(arms[0], arms[1], atol=1e-3)


def test_dialect_does_not_change_the_motion(small_asf: str, small_amc: str, pair: Path, write_file) -> None:
    plain = read_motion(pair)
    write_file(
        "HDM_bk.ASF", small_asf.replace("\n", "\r\n").replace("direction 1 0 0", "direction 1.0e+000 0 0")
    )
    text = (
        small_amc.replace("X:", "X:\\f\xfcr")
        .replace("root 1 2 3", "root 1.0e+000 2 3\t")
        .replace(":DEGREES\n", "")
    )
    lines = [*text.splitlines(), "", "# end"]
    lines[4:4] = ["spine 5"]
    del lines[5]
    mixed = "".join(line + end for line, end in zip(lines, ["\r\n", "\n"] * len(lines), strict=False))
    other = read_motion(write_file("HDM_bk_sneak_006_120.AMC", mixed.encode("latin-1")))
    np.testing.assert_array_equal(other.rotations, plain.rotations)
    assert other.skeleton == plain.skeleton
    assert other.notes == ("120 frames a second by the file's name",)


def test_radians(small_asf: str, small_amc: str, pair: Path, write_file) -> None:
    plain = read_motion(pair)

    def in_radians(line: str) -> str:
        words = line.split()
        if len(words) < 2 or words[0].startswith("#"):
            return line
        keep = 4 if words[0] == "root" else 1
        return " ".join([*words[:keep], *(repr(math.radians(float(word))) for word in words[keep:])])

    amc = "\n".join(in_radians(line) for line in small_amc.splitlines()).replace(":DEGREES", ":RADIANS")
    other = read_motion(write_file("small_02.amc", amc))
    np.testing.assert_allclose(other.rotations, plain.rotations, atol=1e-12)
    # An angle unit of the ASF holds for its axes, and for an AMC that names none.
    axes = small_asf.replace("deg", "rad").replace("0 0 20", f"0 0 {math.radians(20)!r}")
    write_file("turn.asf", axes.replace("-90 7e-016 20", f"{math.radians(-90)!r} 0 {math.radians(20)!r}"))
    other = read_motion(write_file("turn_01.amc", amc.replace(":RADIANS\n", "")))
    np.testing.assert_allclose(other.rotations, plain.rotations, atol=1e-12)


def test_root_position_orientation_and_order(small_asf: str, write_file) -> None:
    asf = small_asf.replace("order TX TY TZ RX RY RZ", "order RZ RY TY TX TZ RX")
    asf = asf.replace("position 0 0 0", "position 10 20 30").replace(
        "orientation 0 0 0", "orientation 0 90 0"
    )
    write_file("a.asf", asf)
    motion = read_motion(write_file("a_1.amc", "7\nroot 30 20 2 1 3 10\nspine 0\nfoot 0 0\nfemur 0 0 0\n"))
    np.testing.assert_allclose(motion.root_position[0], [11, 22, 33])
    root = about("x", 10) @ about("y", 20) @ about("z", 30) @ about("y", 90)
    np.testing.assert_allclose(motion.positions()[0, 2] - [11, 22, 33], root @ [2, 0, 0], atol=1e-12)


def test_bones_that_no_frame_names_rest(pair: Path, small_amc: str) -> None:
    pair.write_text(small_amc.replace("spine 5\n", "").replace("spine 6\n", "hip\n").replace("hip\n", ""))
    motion = read_motion(pair)
    assert "held at rest: spine" in motion.notes[1]
    np.testing.assert_allclose(motion.rotations[:, 4], [[0, 0, 0, 1]] * 2)


def test_translations_of_bones_are_left_out_and_noted(small_asf: str, small_amc: str, write_file) -> None:
    write_file("a.asf", small_asf.replace("dof rx rz", "dof rx l tx rz"))
    amc = small_amc.replace("foot 1 2", "foot 1 0.5 -4 2")
    motion = read_motion(write_file("a_1.amc", amc))
    assert "'foot' left out, at most 4" in motion.notes[-1]
    write_file("small.asf", small_asf)
    plain = read_motion(write_file("small_1.amc", small_amc))
    np.testing.assert_array_equal(motion.rotations, plain.rotations)


def test_which_asf_belongs_to_an_amc(small_asf: str, small_amc: str, write_file) -> None:
    write_file("HDM.asf", small_asf.replace("length 7", "length 8"))
    write_file("HDM_bk.ASF", small_asf)
    write_file("HDM_bk_sneak_long_other.asf", small_asf.replace("length 7", "length 9"))
    path = write_file("HDM_bk_sneak.amc", small_amc)
    assert read_motion(path).skeleton.offsets[3, 1] == -7
    assert read_motion(path, skeleton=path.with_name("HDM.asf")).skeleton.offsets[3, 1] == -8
    lost = write_file("other.amc", small_amc)
    with pytest.raises(ReadError, match=r"HDM\.asf, HDM_bk\.ASF"):
        read_motion(lost)
    with pytest.raises(ReadError, match="no such file") as caught:
        read_motion(path, skeleton="nowhere.asf")
    assert caught.value.path == "nowhere.asf"


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        ("spine 6", "tail 6", 11, "'tail' is not in the ASF"),
        ("foot 1 2\nfemur 11", "foot 1\nfemur 11", 12, "'foot' has 1 values and 2 degrees"),
        ("spine 6\n", "", 9, "no line for bone 'spine': the file is cut short"),
        ("spine 5\n", "", 4, "the 1. frame has no line for bone 'spine'"),
        ("\n2\n", "\n3\n", 9, "frame 3 follows frame 1"),
        ("spine 6", "spine nan", 11, "'nan' is not finite"),
        ("spine 6", "spine six", 11, "'six' is not a number"),
        ("spine 6", "spine 6\nspine 6", 12, "'spine' stands twice in frame 2"),
        ("femur 11 21 31\n", "femur 11 2", 13, "'femur' has 2 values"),
        (":DEGREES", "hello", 3, "stands before the first frame"),
        ("femur 11 21 31\n", "fem", 13, "'fem' is not in the ASF"),
        (SMALL_AMC, "# nothing\n", 2, "the file has no frames"),
        (SMALL_AMC, "1\nspine 5\n", 1, "no frame has a line for the root"),
        ("spine 6", "spine\0 6", 11, "binary"),
    ],
)
def test_damaged_amc_names_its_line(pair: Path, small_amc: str, old, new, line, what) -> None:
    assert small_amc.count(old) == 1
    pair.write_text(small_amc.replace(old, new))
    with pytest.raises(ReadError) as caught:
        read_motion(pair)
    assert what in caught.value.what
    assert (caught.value.path, caught.value.line) == (str(pair), line)
    assert "cut short" in str(caught.value) or not new.startswith("fem")


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        ("direction 0 -1 0", "direction 0 -1", 26, "'direction' has 2 values"),
        ("dof rx ry rz", "dof rx ry rq", 29, "'rq' is unknown"),
        ("axis 0 0 20 XYZ", "axis 0 0 20 XYY", 28, "'XYY' is no order of axes"),
        ("name femur", "name hip", 23, "two bones are called 'hip'"),
        ("femur foot", "femur toe", 54, "'toe' is not in :bonedata"),
        ("femur foot", "femur hip", 54, "'hip' has two parents"),
        ("    hip femur\n", "", 23, "'femur' does not hang from the root"),
        ("order TX TY TZ RX RY RZ", "", 12, "the root has no order"),
        ("length 0.45", "length 0", 6, "the unit of length is 0"),
        (":hierarchy", ":skin", 56, "no :hierarchy"),
        ("# a comment", "hello", 1, "stands outside every section"),
    ],
)
def test_damaged_asf_is_the_file_at_fault(pair: Path, small_asf: str, old, new, line, what) -> None:
    asf = pair.with_name("small.asf")
    assert small_asf.count(old) == 1
    asf.write_text(small_asf.replace(old, new))
    with pytest.raises(ReadError) as caught:
        read_motion(pair)
    assert what in caught.value.what
    assert (caught.value.path, caught.value.line) == (str(asf), line)


DAMAGE = st.sampled_from(
    [b"\n", b" ", b"nan", b"-", b"\xff", b"\0", b"9" * 30, b"1e-300", b":root\n", b":",
     b"3\n", b"begin\n", b"end\n", b"root", b"hip", b"dof tx\n", b"_", b"#"]
)  # fmt: skip


@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_no_bytes_raise_anything_else(
    tmp_path_factory, small_asf: str, small_amc: str, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp()
    contents = {"m.asf": bytearray(small_asf.encode()), "m_1.amc": bytearray(small_amc.encode())}
    content = contents[data.draw(st.sampled_from(sorted(contents)))]
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content)))
        until = at + data.draw(st.sampled_from([0, 0, 1, 2, 8, 40]))
        content[at:until] = data.draw(DAMAGE | st.binary(max_size=3))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    for name, written in contents.items():
        (folder / name).write_bytes(written)
    try:
        motion = read_motion(folder / "m_1.amc")
    except ReadError:
        return
    assert isinstance(motion, Motion)
