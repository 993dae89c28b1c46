"""BVH against a slow reader that shares nothing with it, against pybvh, and in the dialects that exist."""

import math
import re
from pathlib import Path

import numpy as np
import pybvh
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.readers import read_motion


def naive_positions(text: str, replace: bool) -> tuple[list[str], list[list[list[float]]]]:
    """World positions by frame and joint, from 4x4 matrices multiplied in plain Python."""
    tokens = text.replace("\r", "\n").split()
    start = tokens.index("MOTION")
    joints, stack, at = [], [], 1
    while at < start:
        word = tokens[at]
        if word in ("ROOT", "JOINT"):
            joints.append({"name": tokens[at + 1], "parent": stack[-1] if stack else None, "channels": []})
            pending, at = len(joints) - 1, at + 2
        elif word == "End":
            pending, at = None, at + 2
        elif word == "{":
            stack.append(pending)
            at += 1
        elif word == "}":
            stack.pop()
            at += 1
        elif word == "OFFSET":
            if stack[-1] is not None:
                joints[stack[-1]]["offset"] = [float(w) for w in tokens[at + 1 : at + 4]]
            at += 4
        else:
            count = int(tokens[at + 1])
            joints[stack[-1]]["channels"] = tokens[at + 2 : at + 2 + count]
            at += 2 + count
    frames = int(tokens[start + 2])
    numbers = [float(w) for w in tokens[start + 6 :]]
    width = len(numbers) // frames
    return [j["name"] for j in joints], [
        _naive_frame(joints, numbers[f * width : (f + 1) * width], replace) for f in range(frames)
    ]


def _naive_frame(joints: list[dict], values: list[float], replace: bool) -> list[list[float]]:
    worlds: list[list[list[float]]] = []
    at = 0
    for joint in joints:
        place = list(joint["offset"])
        turn = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]
        for name in joint["channels"]:
            value, axis = values[at], "XYZ".index(name[0])
            at += 1
            if name.endswith("position"):
                place[axis] = value + (0 if replace else place[axis])
            else:
                turn = _times(turn, _about(axis, math.radians(value)))
        local = [[*turn[r], place[r]] for r in range(3)] + [[0, 0, 0, 1.0]]
        parent = joint["parent"]
        worlds.append(local if parent is None else _times(worlds[parent], local))
    return [[world[r][3] for r in range(3)] for world in worlds]


def _about(axis: int, angle: float) -> list[list[float]]:
    c, s = math.cos(angle), math.sin(angle)
    return [
        [[1, 0, 0], [0, c, -s], [0, s, c]],
        [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    ][axis]


def _times(a: list[list[float]], b: list[list[float]]) -> list[list[float]]:
    return [[sum(a[r][k] * b[k][c] for k in range(len(b))) for c in range(len(b[0]))] for r in range(len(a))]


@st.composite
def bvh_texts(draw: st.DrawFn) -> str:
    """Any tree whose root branches, any channel order at each joint, angles of many turns."""
    count = draw(st.integers(3, 7))
    parents = [None, 0, 0, *(draw(st.integers(0, j - 1)) for j in range(3, count))]
    number = st.floats(-50, 50).map(lambda x: round(x, 4))
    angle = st.floats(-5000, 5000).map(lambda x: round(x, 4))
    rotations = ["Xrotation", "Yrotation", "Zrotation"]
    orders = [draw(st.permutations(rotations)) for _ in range(count)]
    if draw(st.booleans()):
        orders[-1] = ["Zrotation", "Xrotation", "Zrotation"]
    positions = draw(st.permutations(["Xposition", "Yposition", "Zposition"]))
    orders[0] = [*orders[0], *positions] if draw(st.booleans()) else [*positions, *orders[0]]
    frames = draw(st.integers(1, 3))

    def block(joint: int) -> str:
        offset = " ".join(str(draw(number)) for _ in range(3)) if joint else "0 0 0"
        inner = "".join(block(child) for child in range(count) if parents[child] == joint)
        ends = "End Site { OFFSET 1 2 3 }\n" * draw(st.integers(0, 2))
        head = f"{'JOINT' if joint else 'ROOT'} j{joint}\n{{\nOFFSET {offset}\n"
        return f"{head}CHANNELS {len(orders[joint])} {' '.join(orders[joint])}\n{inner}{ends}}}\n"

    hierarchy = block(0)
    columns = [
        name for joint in map(int, re.findall(r"(?:ROOT|JOINT) j(\d+)", hierarchy)) for name in orders[joint]
    ]
    rows = "\n".join(
        " ".join(str(draw(number if name.endswith("position") else angle)) for name in columns)
        for _ in range(frames)
    )
    return f"HIERARCHY\n{hierarchy}MOTION\nFrames: {frames}\nFrame Time: .0083333\n{rows}\n"


@given(bvh_texts())
@settings(max_examples=60, deadline=None)
def test_any_hierarchy_and_channel_order_agrees_with_plain_matrices(tmp_path_factory, text: str) -> None:
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    path.write_text(text)
    motion = read_motion(path, keep_first_frame=True)
    names, expected = naive_positions(text, replace=False)
    assert list(motion.skeleton.names) == names
    np.testing.assert_allclose(motion.positions(), expected, atol=1e-9)
    assert motion.fps == 120


@pytest.mark.parametrize(
    "name",
    ["dataset-1_walk_normal_002", "dataset-1_run_normal_001", "dataset-2_raise-up-right-hand_active_010"],
)
def test_bandai_positions_replace_offsets(shared_data: Path, name: str) -> None:
    path = shared_data / "bandai" / f"{name}.bvh"
    motion = read_motion(path)
    names, expected = naive_positions(path.read_text(), replace=True)
    np.testing.assert_allclose(motion.positions(), np.array(expected)[:, 1:], atol=2e-3)
    assert motion.skeleton.names == tuple(names[1:])
    assert motion.skeleton.names[0] == "Hips"
    assert "joint_Root" in motion.notes[0]
    feet = motion.positions()[:, [motion.skeleton.index(f"Toes_{side}") for side in "LR"], 1]
    assert -8 < feet.min() < 8  # centimetres: the floor


@pytest.mark.parametrize("name", ["002_01", "007_03"])  # with RL_BoneRoot, and without it
def test_iclone_agrees_with_pybvh_and_stands_on_the_floor(shared_data: Path, name: str) -> None:
    path = shared_data / "cmu" / f"{name}.bvh"
    motion = read_motion(path, keep_first_frame=True)
    other = pybvh.read_bvh_file(path)
    # pybvh leaves out the root's OFFSET, which this export adds to the root's channels.
    offset = [float(word) for word in re.search(r"OFFSET (\S+) (\S+) (\S+)", path.read_text()).groups()]
    theirs = other.joint_positions() + offset
    theirs = theirs[:, [other.joint_index[joint] for joint in motion.skeleton.names]]
    np.testing.assert_allclose(motion.positions(), theirs, atol=1e-6)
    assert motion.skeleton.names[0] == "CC_Base_Hip"
    assert 0 < np.median(motion.positions()[:, :, 1].min(axis=1)) < 12


def test_cmu_bvh_agrees_with_pybvh(shared_data: Path) -> None:
    path = shared_data / "pairs" / "01_01.bvh"
    motion = read_motion(path, keep_first_frame=True)
    other = pybvh.read_bvh_file(path)
    np.testing.assert_allclose(motion.positions()[::50], other.joint_positions()[::50], atol=1e-6)
    assert list(motion.skeleton.names) == other.joint_names


def test_dialect_does_not_change_the_motion(small_bvh: str, write_file) -> None:
    plain = read_motion(write_file("plain.bvh", small_bvh))
    lines = small_bvh.splitlines()
    lines.insert(1, "# exported by hand \xfc")
    lines.insert(-1, "")
    lines.insert(-1, "// the last frame")
    mixed = "".join(line + end for line, end in zip(lines, ["\r\n", "\n", "\r"] * len(lines), strict=False))
    mixed = mixed.replace("JOINT Leg\n{", "joint Leg {").replace("Xposition", "XPOSITION")
    mixed = mixed.replace("0.0333333", ".0333333 ").replace("0 9 2 12", "+0 9e+000 2.000E-000 12\t")
    assert not mixed.encode("latin-1").isascii()
    for data in (mixed.encode("latin-1"), b"\xef\xbb\xbf" + mixed.encode()):
        other = read_motion(write_file("other.bvh", data))
        assert other.skeleton == plain.skeleton
        assert other.fps == plain.fps == 30
        np.testing.assert_array_equal(other.rotations, plain.rotations)
        np.testing.assert_array_equal(other.root_position, plain.root_position)


def one_moving_joint(offset: str, first: str) -> str:
    return f"""HIERARCHY
ROOT Hips
{{
OFFSET {offset}
CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
JOINT A {{
OFFSET 0 -90 0
CHANNELS 3 Zrotation Yrotation Xrotation
}}
}}
MOTION
Frames: 2
Frame Time: 0.01
{first} 0 0 0 0 0 0
{first} 0 0 0 0 0 0
"""


@pytest.mark.parametrize(
    ("offset", "first", "rule", "expected"),
    [
        ("0 0 0", "5 95 3", None, [5, 95, 3]),
        ("0 105 0", "5 -2 300", None, [5, 103, 300]),  # iClone: relative to the rest position
        ("0 100 0", "5 95 300", None, [5, 95, 300]),  # MotionBuilder: absolute
        ("-20 90 400", "-20 90 400", None, [-20, 90, 400]),  # the OFFSET is the first position
        ("0 105 0", "5 -2 300", "replace", [5, -2, 300]),
        ("0 100 0", "5 95 300", "add", [5, 195, 300]),
    ],
)
def test_position_rule_of_a_single_moving_joint(write_file, offset, first, rule, expected) -> None:
    motion = read_motion(write_file("a.bvh", one_moving_joint(offset, first)), position_rule=rule)
    np.testing.assert_allclose(motion.root_position, [expected, expected])
    assert bool(motion.notes) == (offset != "0 0 0")  # a judged OFFSET is noted


def test_moving_offsets_become_their_median_and_the_deviation_is_noted(write_file) -> None:
    text = one_moving_joint("0 0 0", "0 95 0").replace(
        "CHANNELS 3 ", "CHANNELS 6 Xposition Yposition Zposition "
    )
    text = text.replace("Frames: 2", "Frames: 3").rsplit("\n0 95", 2)[0]
    rows = "".join(f"0 95 0 0 0 0 {x} -88 0 0 0 0\n" for x in (1, 2, 7))
    motion = read_motion(write_file("a.bvh", f"{text}\n{rows}"))
    np.testing.assert_allclose(motion.skeleton.offsets[1], [2, -88, 0])
    assert "at most 5 ('A')" in motion.notes[-1]


def tree_text(*edges: tuple[str, list[str]]) -> str:
    children = dict(edges)

    def block(name: str, keyword: str) -> str:
        inner = "".join(block(child, "JOINT") for child in children.get(name, []))
        return f"{keyword} {name}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Zrotation\n{inner}}}\n"

    hierarchy = block(edges[0][0], "ROOT")
    row = "90 " * hierarchy.count("CHANNELS")
    return f"HIERARCHY\n{hierarchy}MOTION\nFrames: 1\nFrame Time: 0.01\n{row}\n"


@pytest.mark.parametrize(
    ("edges", "names"),
    [
        ([("Reference", ["mixamorig:Hips"]), ("mixamorig:Hips", ["Spine"])], ["mixamorig:Hips", "Spine"]),
        ([("a", ["b"]), ("b", ["c"]), ("c", ["d", "e"])], ["c", "d", "e"]),
        ([("a", ["b"]), ("b", ["c"])], ["a", "b", "c"]),  # never branches: keeps its root
        ([("a", ["LHip"]), ("LHip", ["Knee"])], ["a", "LHip", "Knee"]),
        (
            [("a", ["CC_Base_Hip"]), ("CC_Base_Hip", ["CC_Base_Pelvis", "W"])],
            ["CC_Base_Hip", "CC_Base_Pelvis", "W"],
        ),
        (
            [
                ("root", ["pelvis", "ik_foot_root"]),
                ("pelvis", ["l", "r"]),
                ("ik_foot_root", ["ik_foot_l", "ik_foot_r"]),
            ],
            ["pelvis", "l", "r"],
        ),
    ],
)
def test_which_joint_is_the_pelvis(write_file, edges, names) -> None:
    motion = read_motion(write_file("a.bvh", tree_text(*edges)))
    assert list(motion.skeleton.names) == names


def test_what_stands_above_the_pelvis_is_composed_into_it(write_file) -> None:
    text = tree_text(("a", ["b"]), ("b", ["c"]), ("c", ["d", "e"]))
    motion = read_motion(write_file("a.bvh", text))
    names, expected = naive_positions(text, replace=False)
    np.testing.assert_allclose(motion.positions(), np.array(expected)[:, 2:], atol=1e-12)
    assert motion.notes == ("composed into the pelvis 'c': a, b",)


def test_equal_joint_names_are_numbered_and_noted(small_bvh: str, write_file) -> None:
    motion = read_motion(write_file("a.bvh", small_bvh.replace("JOINT Spine", "JOINT Leg")))
    assert motion.skeleton.names == ("Hips", "Leg", "Leg_2")
    assert "'Leg'" in motion.notes[0]


@pytest.mark.parametrize(
    ("written", "fps"),
    [("0.0333333", 30), (".0083333", 120), ("0.016667", 60), ("0.033333", 30), ("0.01", 100),
     ("4.16667e-02", 24), ("0.0333667", 1 / 0.0333667), ("2", 0.5)],
)  # fmt: skip
def test_frame_time_is_a_rounded_number(small_bvh: str, write_file, written: str, fps: float) -> None:
    motion = read_motion(write_file("a.bvh", small_bvh.replace("0.0333333", written)))
    assert motion.fps == pytest.approx(fps, abs=1e-12)


def test_options_of_every_format(small_bvh: str, write_file) -> None:
    path = write_file("a.bvh", small_bvh)
    plain = read_motion(path)
    turned = read_motion(path, unit=0.01, fps=25, up="z")
    x, y, z = np.moveaxis(plain.positions(), -1, 0)
    np.testing.assert_allclose(turned.positions(), np.stack([x, z, -y], axis=-1), atol=1e-12)
    assert (plain.unit, turned.unit, turned.fps) == (None, 0.01, 25)
    assert len(turned.notes) == 2
    for option in ({"unit": 0}, {"fps": float("nan")}, {"position_rule": "sum"}, {"up": "x"}):
        with pytest.raises(ValueError, match=next(iter(option))):
            read_motion(path, **option)
