"""What is a clip, what it is called, and what its digest covers."""

import os
from hashlib import blake2b
from pathlib import Path

import pytest

from motionary.pipeline.readers import ReadError, Source, read_motion, scan_library


@pytest.fixture
def library(tmp_path: Path, small_bvh: str, small_asf: str, small_amc: str, write_file) -> Path:
    write_file("library/b.bvh", small_bvh)
    write_file("library/a/x.BVH", small_bvh)
    write_file("library/a/HDM.asf", small_asf + "\n")
    write_file("library/a/HDM_bk.ASF", small_asf)
    write_file("library/a/HDM_bk_1_120.AMC", small_amc)
    write_file("library/lost.amc", small_amc)
    for passed_over in ("notes.txt", ".hidden.bvh", ".git/c.bvh", "a/x.bvh.bak"):
        write_file(f"library/{passed_over}", small_bvh)
    return tmp_path / "library"


def test_one_root(library: Path) -> None:
    sources = scan_library(library)
    assert [source.clip_id for source in sources] == ["a/HDM_bk_1_120.AMC", "a/x.BVH", "b.bvh", "lost.amc"]
    amc, upper, bvh, lost = sources
    assert amc.files == (str(library / "a/HDM_bk_1_120.AMC"), str(library / "a/HDM_bk.ASF"))
    contents = [Path(file).read_bytes() for file in amc.files]
    counted = b"".join(len(one).to_bytes(8, "little") + one for one in contents)
    assert amc.digest == blake2b(counted, digest_size=16).hexdigest()
    assert upper.digest == bvh.digest
    assert (amc.format, bvh.format) == ("asf/amc", "bvh")
    assert bvh == Source("b.bvh", "b.bvh", str(library), (str(library / "b.bvh"),), bvh.digest, "bvh")
    assert lost.files == (str(library / "lost.amc"),)
    with pytest.raises(ReadError, match="no ASF"):
        read_motion(lost.files[0])


def test_digest_follows_the_asf(library: Path) -> None:
    before = scan_library(library)[0].digest
    (library / "a/HDM.asf").write_text("changed, but not this clip's skeleton")
    assert scan_library(library)[0].digest == before
    with (library / "a/HDM_bk.ASF").open("a") as file:
        file.write("\n")
    assert scan_library(library)[0].digest != before


def test_names_do_not_depend_on_what_comes_later(library: Path, small_bvh: str) -> None:
    before = {source.path: source for source in scan_library(library)}
    (library / "a/aa.bvh").write_text(small_bvh)
    after = {source.path: source for source in scan_library(library)}
    assert after.items() >= before.items()


def test_several_roots_are_told_apart_by_their_names(library: Path, write_file, small_bvh: str) -> None:
    single = write_file("single.bvh", small_bvh)
    other = write_file("other/b.bvh", small_bvh).parent
    ids = [source.clip_id for source in scan_library([library, str(other), single])]
    assert ids == sorted(ids)
    assert {"library/b.bvh", "other/b.bvh", "single.bvh", "library/a/x.BVH"} <= set(ids)
    twin = write_file("elsewhere/library/b.bvh", small_bvh).parent
    with pytest.raises(ValueError, match="two roots are called 'library'.*rename"):
        scan_library([library, twin])


def test_a_single_file(library: Path) -> None:
    (source,) = scan_library(library / "a/HDM_bk_1_120.AMC")
    assert source.clip_id == source.path == "HDM_bk_1_120.AMC"
    assert len(source.files) == 2


def test_roots_without_clips(tmp_path: Path, write_file) -> None:
    with pytest.raises(FileNotFoundError, match="check the path"):
        scan_library(tmp_path / "nowhere")
    with pytest.raises(ValueError, match="name a folder"):
        scan_library([])
    with pytest.raises(ValueError, match="no motion files"):
        scan_library(write_file("full/of/notes.txt", "x").parents[1])


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root reads everything")
def test_a_file_that_may_not_be_read_is_still_a_source(library: Path) -> None:
    (library / "b.bvh").chmod(0)
    source = next(source for source in scan_library(library) if source.path == "b.bvh")
    assert source.digest == ""
    with pytest.raises(ReadError, match="cannot be opened"):
        read_motion(source.files[0])


def test_a_link_that_leads_nowhere_is_still_a_source(library: Path) -> None:
    (library / "b.bvh").unlink()
    (library / "b.bvh").symlink_to(library / "gone.bvh")
    source = next(source for source in scan_library(library) if source.path == "b.bvh")
    assert source.digest == ""
    with pytest.raises(ReadError, match="no such file"):
        read_motion(source.files[0])


def test_shared_data_is_a_library(shared_data: Path) -> None:
    sources = scan_library(shared_data)
    assert len(sources) == 270
    assert all(len(source.files) == (2 if source.format == "asf/amc" else 1) for source in sources)
    assert len({source.digest for source in sources}) == 270
