"""Every way a BVH is damaged names its line and its mend; no bytes raise anything but ReadError."""

import pickle
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import ReadError, read_motion


@pytest.mark.parametrize(
    ("old", "new", "line", "what"),
    [
        ("HIERARCHY", "Dear reader,", 1, "begins with"),
        ("ROOT Hips\n{", "ROOT Hips", 3, "a { is missing"),
        ("ROOT Hips", "ROOT", 2, "ROOT without a name"),
        ("  }\n}\nMOTION", "  }\nMOTION", 20, "1 block(s) are still open"),
        ("}\nMOTION", "}\n}\nMOTION", 21, "closes nothing"),
        ("ROOT Hips\n{", "{\nROOT Hips\n{", 2, "opens no joint"),
        ("OFFSET 1 -4 0", "OFFSET 1 -4", 8, "OFFSET has 2 values"),
        ("    OFFSET 1 -4 0\n", "", 13, "'Leg' has no OFFSET"),
        ("OFFSET 1 -4 0", "OFFSET 1 -4 nan", 8, "not finite"),
        ("CHANNELS 3 Zrotation", "CHANNELS 4 Zrotation", 9, "CHANNELS says '4' and names 3"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Wrotation", 9, "'Wrotation' is unknown"),
        ("JOINT Spine", "ROOT Spine", 15, "a second ROOT"),
        ("JOINT Spine", "BONE Spine", 15, "not part of a hierarchy"),
        ("      OFFSET 0 -4 0\n", "      CHANNELS 1 Xrotation\n", 12, "CHANNELS in an End Site"),
        ("MOTION", "", 22, "expected MOTION"),
        ("Frames: 3", "Frames: 0", 22, "no frames"),
        ("Frames: 3", "Frames: many", 22, "expected `Frames: N`"),
        ("Frames: 3", "Frames: 5", 26, "declares 5 frames and holds 3"),
        ("Frames: 3", "Frames: 2", 26, "declares 2 frames and holds 3"),
        ("Frame Time: 0.0333333", "Frame Time: 0", 23, "impossible"),
        ("Frame Time: 0.0333333", "Frame Time: -0.1", 23, "impossible"),
        ("Frame Time: 0.0333333", "Frame Time: inf", 23, "not finite"),
        ("Frame Time: 0.0333333", "Frame Time: 1000000", 23, "impossible"),
        ("Frames: 3", "Frames: 1000000000", 26, "declares 1000000000 frames and holds 3"),
        ("11 21 31", "11 \0 31", 25, "binary"),
        ("Frame Time: 0.0333333\n", "", 23, "expected `Frame Time: S`"),
        ("11 21 31", "11 nan 31", 25, "'nan' is not finite"),
        ("11 21 31", "11 1e999 31", 25, "not finite"),
        ("11 21 31", "11 1e30 31", 25, "too large"),
        ("11 21 31", "11 2_1 31", 25, "'2_1' is not a number"),
        ("11 21 31", "11 21,5 31", 25, "'21,5' is not a number"),
        ("11 21 31", "11 31", 25, "frame 1 has 11 values and the hierarchy 12"),
        ("12 22 32 1 2 3 4 5 6\n", "12 22 3", 26, "frame 2 has 6 values"),
    ],
)
def test_damage_names_its_line(small_bvh: str, write_file, old: str, new: str, line: int, what: str) -> None:
    assert small_bvh.count(old) >= 1
    path = write_file("a.bvh", small_bvh.replace(old, new, 1))
    with pytest.raises(ReadError) as caught:
        read_motion(path)
    error = caught.value
    assert what in error.what
    assert (error.path, error.line) == (str(path), line)
    assert error.mend
    assert "\n" not in str(error)


def test_cut_short_says_so(small_bvh: str, write_file) -> None:
    with pytest.raises(ReadError, match="cut short"):
        read_motion(write_file("a.bvh", small_bvh[:-9]))


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "empty"),
        (b" \r\n\t", "empty"),
        (b"\xef\xbb\xbf", "empty"),
        (bytes(range(256)), "binary"),
        ("HIERARCHY".encode("utf-16"), "binary or UTF-16"),
        (b"\x89PNG\r\n\x1a\n", "begins with"),
        (b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\n", "no MOTION section"),
        (b"HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n\n", "no ROOT"),
        (
            b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n\n",
            "no joint has a channel",
        ),
    ],
)
def test_what_is_no_bvh(write_file, content: bytes, what: str) -> None:
    with pytest.raises(ReadError, match=what):
        read_motion(write_file("a.bvh", content))


def test_paths_that_lead_nowhere(tmp_path: Path) -> None:
    (tmp_path / "folder.bvh").mkdir()
    (tmp_path / "a.fbx").write_text("x")
    for name, what in (
        ("none.bvh", "no such file"),
        ("folder.bvh", "cannot be opened"),
        ("a.fbx", ".fbx are"),
    ):
        with pytest.raises(ReadError, match=what) as caught:
            read_motion(tmp_path / name)
        assert caught.value.line is None
    with pytest.raises(ReadError, match=re.escape(".amc, .bvh")):
        read_motion(tmp_path / "a.fbx")


def test_error_crosses_processes() -> None:
    error = pickle.loads(pickle.dumps(ReadError(Path("a/b.bvh"), 7, "torn", "sew it")))
    assert (error.path, error.line, error.what, error.mend) == (str(Path("a/b.bvh")), 7, "torn", "sew it")
    assert str(error).endswith("b.bvh:7: torn; sew it")
    assert str(ReadError("b.bvh", None, "torn", "sew it")) == "b.bvh: torn; sew it"


DAMAGE = st.sampled_from(
    [b"{", b"}", b"\n", b" ", b"nan", b"-", b"e", b"\xff", b"\0", b"9" * 30, b"JOINT", b"End",
     b"MOTION", b"#", b"1e-300", b"\xc2\x85", b"OFFSET 1 2 3\n", b":", b"_"]
)  # fmt: skip


@given(data=st.data())
@settings(max_examples=400, deadline=None)
def test_no_bytes_raise_anything_else(tmp_path_factory, small_bvh: str, data: st.DataObject) -> None:
    content = bytearray(small_bvh.encode())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content)))
        until = at + data.draw(st.sampled_from([0, 0, 1, 2, 8, 40]))
        content[at:until] = data.draw(DAMAGE | st.binary(max_size=3))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    path = tmp_path_factory.getbasetemp() / "damaged.bvh"
    path.write_bytes(content)
    try:
        outcome: Motion | ReadError = read_motion(path)
    except ReadError as error:
        outcome = error
    lines = content.count(b"\n") + content.count(b"\r") + 1
    assert isinstance(outcome, Motion) or outcome.line is None or 1 <= outcome.line <= lines
