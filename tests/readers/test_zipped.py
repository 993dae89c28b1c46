"""Libraries in a zip: what is a clip, what it is called, and what is refused."""

import os
import struct
import time
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from motionary.pipeline.readers import ReadError, Source, read_motion, scan_library, zipped
from motionary.pipeline.readers import library as scanning
from motionary.pipeline.readers.digests import digest_of


@pytest.fixture
def pack(tmp_path: Path) -> Callable[..., Path]:
    """Return a way of packing texts under their names into the zip of a library."""

    def pack_them(members: Mapping[str, str | bytes], name: str = "library/takes.zip") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a name that stands twice is meant
            for one, content in members.items():
                archive.writestr(one.removesuffix("#"), content)
        return path

    return pack_them


@pytest.fixture
def takes(small_bvh: str, small_asf: str, small_amc: str) -> dict[str, str]:
    return {
        "b.bvh": small_bvh,
        "a/x.BVH": small_bvh,
        "a/HDM.asf": small_asf + "\n",
        "a/HDM_bk.ASF": small_asf,
        "a/HDM_bk_1_120.AMC": small_amc,
        "lost.amc": small_amc,
    }


def test_a_zip_is_a_folder_of_clips(pack, takes, small_bvh, write_file) -> None:
    passed_over = dict.fromkeys(
        ["notes.txt", ".hidden.bvh", ".git/c.bvh", "__MACOSX/._b.bvh", "__MACOSX/b.bvh", "inner.zip"],
        small_bvh,
    )
    library = pack(takes | passed_over).parent
    for name, text in takes.items():
        write_file(f"library/plain/{name}", text)
    sources = {source.clip_id: source for source in scan_library(library)}
    names = ["a/HDM_bk_1_120.AMC", "a/x.BVH", "b.bvh", "lost.amc"]
    assert sorted(sources) == sorted(f"{where}/{name}" for where in ("plain", "takes.zip") for name in names)
    for name in names:
        packed, plain = sources[f"takes.zip/{name}"], sources[f"plain/{name}"]
        assert (packed.digest, packed.format, len(packed.files)) == (
            plain.digest,
            plain.format,
            len(plain.files),
        )
        assert packed.root == str(library)
    amc = sources["takes.zip/a/HDM_bk_1_120.AMC"]
    read = read_motion(amc.files[0], skeleton=amc.files[1])
    assert (read.name, read.source, read.fps) == ("HDM_bk_1_120", amc.files[0], 120)
    plain = read_motion(library / "plain/a/HDM_bk_1_120.AMC")
    np.testing.assert_array_equal(read.positions(), plain.positions())
    with pytest.raises(ReadError, match="no ASF belongs to it") as refused:
        read_motion(sources["takes.zip/lost.amc"].files[0])
    assert refused.value.path == str(library / "takes.zip/lost.amc")


def test_a_root_may_be_a_zip(pack, takes) -> None:
    path = pack({"b.bvh": takes["b.bvh"]})
    (source,) = scan_library(path)
    assert source.clip_id == "takes.zip/b.bvh"
    with pytest.raises(ReadError, match=r"a zip is a folder of motions.*takes\.zip/walk\.bvh"):
        read_motion(path)
    with pytest.raises(ReadError, match="holds no such file"):
        read_motion(path / "c.bvh")


def test_a_folder_may_be_called_as_a_zip_is(write_file, small_bvh: str) -> None:
    path = write_file("library/takes.zip/b.bvh", small_bvh)
    (source,) = scan_library(path.parents[1])
    assert source.clip_id == "takes.zip/b.bvh"
    assert read_motion(path).frames == 3


def test_an_error_in_a_member_has_its_line_and_name(pack, small_bvh: str) -> None:
    path = pack({"a/bad.bvh": small_bvh.replace("1 2 3 4 5 6\n0 9 2", "1 2 3 x 5 6\n0 9 2")})
    with pytest.raises(ReadError, match="'x' is not a number") as refused:
        read_motion(path / "a/bad.bvh")
    assert (refused.value.path, refused.value.line) == (str(path / "a/bad.bvh"), 25)


@pytest.mark.parametrize(
    "name",
    [
        "../up.bvh",
        "a/../../up.bvh",
        "/abs.bvh",
        "C:/drive.bvh",
        "a\\b.bvh",
        "..\\up.bvh",
        "a//b.bvh",
        "./b.bvh",
    ],
)
def test_names_that_lead_elsewhere_are_refused(pack, small_bvh: str, name: str, tmp_path: Path) -> None:
    library = pack({name: small_bvh, "fine.bvh": small_bvh}).parent
    before = sorted(tmp_path.rglob("*"))
    fine, odd = sorted(scan_library(library), key=lambda source: source.clip_id != "takes.zip/fine.bvh")
    assert read_motion(fine.files[0]).frames == 3
    assert odd.digest not in ("", fine.digest)
    assert odd.clip_id.removeprefix("takes.zip/").isascii()
    assert "/" not in odd.clip_id.removeprefix("takes.zip/")
    assert os.path.realpath(odd.files[0]).startswith(str(library / "takes.zip"))
    with pytest.raises(ReadError, match="is no plain relative path"):
        read_motion(odd.files[0])
    assert sorted(tmp_path.rglob("*")) == before


def test_names_that_stand_twice_are_refused(pack, small_bvh: str) -> None:
    path = pack({"b.bvh": small_bvh, "b.bvh#": small_bvh + "\n"})
    (source,) = scan_library(path)
    with pytest.raises(ReadError, match="stands more than once"):
        read_motion(source.files[0])


def entry_changed(path: Path, offset: int, form: str, value: int) -> None:
    """Write a field of the first member's entry in the archive's directory."""
    content = bytearray(path.read_bytes())
    struct.pack_into(form, content, content.index(b"PK\x01\x02") + offset, value)
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("offset", "form", "value", "what"),
    [
        (8, "<H", 1, "encrypted"),
        (38, "<I", 0o120777 << 16, "a link"),
        (24, "<I", (1 << 30) + 1, "unpacks from .* MB to 1074 MB"),
        (24, "<I", 1 << 27, "unpacks from"),
        (24, "<I", 5, "cannot be unpacked"),  # gives more than it declares: the checksum tells
        (24, "<I", 1000, "cannot be unpacked .*(CRC|declares 1000)"),
        (16, "<I", 77, "cannot be unpacked .*CRC"),
        (10, "<H", 99, "cannot be unpacked"),
    ],
)
def test_members_that_cannot_be_unpacked_are_told(pack, small_bvh, offset, form, value, what) -> None:
    path = pack({"b.bvh": small_bvh})
    entry_changed(path, offset, form, value)
    (source,) = scan_library(path.parent)
    assert source.digest
    assert digest_of(source.files) == source.digest
    with pytest.raises(ReadError, match=what) as refused:
        read_motion(source.files[0])
    assert refused.value.path == source.files[0]


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "bomb.zip"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("zeros.bvh", "w") as file,
    ):
        for _ in range(17):
            file.write(bytes(1 << 20))

    def unpacked(*_arguments):
        raise AssertionError("it was unpacked")

    monkeypatch.setattr(zipped, "_pieces", unpacked)
    (source,) = scan_library(path)
    with pytest.raises(ReadError, match=r"unpacks from 0\.\d+ MB to 18 MB"):
        read_motion(source.files[0])


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x05\x06" + bytes(17)])
def test_what_is_no_zip_is_one_clip_that_cannot_be_read(write_file, content: bytes) -> None:
    path = write_file("library/takes.zip", content)
    (source,) = scan_library(path.parent)
    assert (source.clip_id, source.format) == ("takes.zip", "zip")
    with pytest.raises(ReadError, match="this is no whole zip"):
        read_motion(path)


def clips_under(folder: Path) -> list[Source]:
    try:
        return scan_library(folder)
    except ValueError:  # no clip is left
        return []


def test_any_damage_is_a_read_error(pack, takes) -> None:
    path = pack(takes)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(150):
        damaged = bytearray(whole)
        for place in rng.integers(len(whole), size=rng.integers(1, 6)):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged[: rng.integers(1, len(whole) + 1)] if rng.random() < 0.3 else damaged)
        for source in clips_under(path.parent):
            try:
                read_motion(*source.files[:1], skeleton=dict(enumerate(source.files)).get(1))
            except ReadError as refused:
                told = refused.what, refused.mend
                assert all(told)


def test_an_empty_zip_is_an_empty_folder(pack) -> None:
    with pytest.raises(ValueError, match="no motion files"):
        scan_library(pack({"readme.txt": "x"}))


def test_an_unchanged_zip_is_not_opened(pack, takes, monkeypatch) -> None:
    path = pack(takes)
    monkeypatch.setattr(scanning, "_SETTLED", 0.0)
    time.sleep(0.01)
    first = scan_library(path.parent)
    digests = {source.states: source.digest for source in first}
    clips = [tuple(str(Path(one).relative_to(path)) for one in source.files) for source in first]
    assert {state.size for source in first for state in source.states} == {path.stat().st_size}

    def opened(*_arguments):
        raise AssertionError("the zip was opened")

    monkeypatch.setattr(zipped, "_directory", opened)
    again = scan_library(path.parent, digests.get, lambda state: clips if state.path == str(path) else ())
    assert again == first


def test_no_room_to_unpack_passes(pack, takes, monkeypatch) -> None:
    path = pack(takes)

    def full(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "mkdir", full)
    with pytest.raises(ReadError, match=r"No space left on device.*TMPDIR") as refused:
        read_motion(path / "b.bvh")
    assert isinstance(refused.value.__cause__, OSError)
