"""Paths that nobody planned for: links, loops, pipes, odd names, in the library and of the catalog."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from motionary.catalog import Catalog
from motionary.catalog.verify import verify
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.readers import ReadError, read_motion, scan_library
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from tests.torture.world import spread

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="names and links of POSIX")

ODD_NAMES = [
    b"-rf.bvh", b"=cmd|' C calc'!A0.bvh", b"'; drop table clips; --.bvh", b'"quoted".bvh', b"new\nline.bvh",
    b"tab\there.bvh", b"[1]*?{a,b}.bvh", b"100%s %d.bvh", "\U0001f483 caf\u00e9.bvh".encode(),
    b"not-utf8-\xff\xfe.bvh", b"case.bvh", b"CASE.BVH", b"a/take.bvh", b"b/take.bvh", b"x..bvh",
    b"back\\slash.bvh", b"#1 %2f x.bvh", b" .bvh",
]  # fmt: skip


@pytest.fixture
def take(demo_library: Path) -> Path:
    return demo_library / spread(demo_library)[0]


def ids(library: Path) -> list[str]:
    return [source.clip_id for source in scan_library(library)]


def test_links(tmp_path: Path, take: Path) -> None:
    library, outside = tmp_path / "library", tmp_path / "outside"
    library.mkdir()
    outside.mkdir()
    shutil.copy(take, outside / "a.bvh")
    (library / "a.bvh").symlink_to(outside / "a.bvh")  # a link to a file is that file
    (library / "folder").symlink_to(outside)  # one to a folder is not followed, nor one that goes round
    (library / "round").symlink_to(library)
    (library / "self.bvh").symlink_to("self.bvh")
    (library / "nowhere.bvh").symlink_to(outside / "none.bvh")
    (library / "linked.bvh").symlink_to(outside)
    assert ids(library) == ["a.bvh", "nowhere.bvh", "self.bvh"]
    linked, nowhere, itself = scan_library(library)
    assert read_motion(linked.files[0]).frames == read_motion(take).frames
    assert linked.digest == scan_library(outside)[0].digest
    for source, what in ((nowhere, "no such file"), (itself, "cannot be opened")):
        assert source.digest == ""
        with pytest.raises(ReadError, match=what):
            read_motion(source.files[0])
    (tmp_path / "link").symlink_to(library)  # a root may be a link: who names it means what it leads to
    assert ids(tmp_path / "link") == ids(library)


def test_roots_with_dots(tmp_path: Path, take: Path) -> None:
    (tmp_path / "library" / "sub").mkdir(parents=True)
    shutil.copy(take, tmp_path / "library" / "a.bvh")
    for root in ("library/sub/..", "library/.", "./library//", "library/sub/../../library"):
        assert ids(tmp_path / root) == ["a.bvh"]


@pytest.mark.timeout(30)
def test_pipes_and_devices_are_not_waited_for(tmp_path: Path, take: Path) -> None:
    os.mkfifo(tmp_path / "pipe.bvh")
    (tmp_path / "zero.bvh").symlink_to("/dev/zero")
    shutil.copy(take, tmp_path / "a.bvh")
    os.mkfifo(tmp_path / "skeleton.asf")
    (tmp_path / "skeleton_01.amc").write_text("1\nroot 1 2 3 4 5 6\n")
    sources = {source.clip_id: source for source in scan_library(tmp_path)}
    assert sorted(sources) == ["a.bvh", "pipe.bvh", "skeleton_01.amc", "zero.bvh"]
    for name in ("pipe.bvh", "zero.bvh", "skeleton_01.amc"):
        assert sources[name].digest == ""
        with pytest.raises(ReadError, match="a pipe, a socket or a device"):
            read_motion(sources[name].files[0])


def test_a_run_over_odd_names(tmp_path: Path, demo_library: Path, silent_progress) -> None:
    library = tmp_path / "odd 'library' [1]*"
    takes = spread(demo_library)
    for name, one in zip(ODD_NAMES, takes, strict=False):
        path = Path(os.fsdecode(os.fsencode(library) + b"/" + name))
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(demo_library / one, path)
    os.mkfifo(library / "pipe.bvh")
    (library / "gone.bvh").symlink_to("nowhere")
    catalog = tmp_path / 'it\'s a "catalog" [1]*?{x}; -- #'
    result = run(Job([str(library)], str(catalog), PipelineConfig()), silent_progress)
    with result.catalog as opened:
        clip_ids = opened.clips.to_arrow()["clip_id"].to_pylist()
        assert len(clip_ids) == len(set(clip_ids)) == len(ODD_NAMES)
        assert {"case.bvh", "CASE.BVH", "a/take.bvh", "b/take.bvh", "not-utf8-\\xff\\xfe.bvh"} < set(clip_ids)
        assert sorted(opened.quarantine.to_arrow()["path"].to_pylist()) == ["gone.bvh", "pipe.bvh"]
    assert [check for check in verify(str(catalog)) if not check.passed] == []
    with Catalog.open(str(catalog)) as opened:
        for clip_id in clip_ids:
            rows = opened.sql("select fps from clips where clip_id = ?", [clip_id])
            assert len(rows) == 1
            assert opened.motion(clip_id).frames > 1


def test_names_that_would_be_one_clip_are_told(tmp_path: Path, take: Path) -> None:
    for name in (b"x\xff.bvh", b"x\\xff.bvh"):
        shutil.copy(take, os.fsdecode(os.fsencode(tmp_path) + b"/" + name))
    with pytest.raises(ValueError, match=r"two files would be clip.*rename"):
        scan_library(tmp_path)
