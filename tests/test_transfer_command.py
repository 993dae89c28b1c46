"""`motionary export` and `motionary transfer`: what they print, where, and with which exit code."""

import re
from pathlib import Path

import numpy as np
import pytest

from motionary.catalog import Catalog
from motionary.pipeline.readers import read_motion
from motionary.pipeline.style import fastest_joint, foot_sliding, transfer
from motionary.workflows.transfer import StyleTransfer


@pytest.fixture(scope="module")
def one_rig(demo_catalog) -> tuple[str, str, str]:
    """Find two clips of one cluster, neither its reference but of the same rig, and that reference."""
    rows = Catalog.open(demo_catalog).sql(
        """select one.clip_id one, other.clip_id other, reference.clip_id reference
           from clusters one join clusters other using (cluster_id)
           join "references" reference using (cluster_id)
           join clips c1 on c1.clip_id = one.clip_id join clips c2 on c2.clip_id = other.clip_id
           join clips c3 on c3.clip_id = reference.clip_id
           where one.label = 'walk' and one.clip_id < other.clip_id
             and reference.clip_id not in (one.clip_id, other.clip_id)
             and c1.convention = c3.convention and c2.convention = c3.convention
           order by all"""
    )
    return tuple(rows.to_pylist()[0].values())


def two(demo_catalog: str, condition: str) -> tuple[str, str]:
    """Find a pair of walks and others by a condition on their clusters and conventions."""
    rows = Catalog.open(demo_catalog).sql(
        f"""select one.clip_id one, other.clip_id other
            from clusters one, clusters other, clips c1, clips c2
            where c1.clip_id = one.clip_id and c2.clip_id = other.clip_id and one.label = 'walk'
              and {condition} order by all"""
    )
    return tuple(rows.to_pylist()[0].values())


def test_transfer_writes_a_playable_bvh_and_prints_how_feet_slide(motionary, demo_catalog, one_rig, tmp_path):
    style, onto, reference = one_rig
    out = tmp_path / "new" / "out.bvh"
    code, printed, log = motionary("transfer", demo_catalog, out, "--style", style, "--onto", onto)
    assert (code, log) == (0, "")
    catalog = Catalog.open(demo_catalog)
    sources = catalog.aligned(style), catalog.aligned(onto)
    made = transfer(sources[0], catalog.aligned(reference), sources[1])
    read = read_motion(out)
    order = [read.skeleton.index(name) for name in made.skeleton.names]
    np.testing.assert_allclose(read.positions()[:, order], made.positions(), atol=1e-3)
    assert f"wrote {out}: {made.frames} frames, in the time of {reference}" in printed
    rows = re.findall(r"^(style|onto|result) +([\d.]+) +([\d.]+)$", printed, flags=re.MULTILINE)
    assert [role for role, _, _ in rows] == ["style", "onto", "result"]
    motions = (*sources, made)
    assert [float(speed) for _, speed, _ in rows] == pytest.approx(
        [foot_sliding(motion) for motion in motions], abs=0.006
    )
    assert [float(speed) for _, _, speed in rows] == pytest.approx(
        [fastest_joint(motion) for motion in motions], abs=0.06
    )
    assert "a leg taken to be 0.90 m" in printed
    assert [file.name for file in out.parent.iterdir()] == ["out.bvh"]


def test_transfer_replaces_its_file_only_when_it_succeeds(motionary, demo_catalog, one_rig, tmp_path):
    style, onto, _ = one_rig
    out = tmp_path / "out.bvh"
    out.write_text("old")
    code, _, _ = motionary("transfer", demo_catalog, out, "--style", "gone.bvh", "--onto", onto)
    assert (code, out.read_text()) == (1, "old")
    code, _, _ = motionary("transfer", demo_catalog, out, "--style", style, "--onto", onto)
    assert code == 0
    assert out.read_text().startswith("HIERARCHY")


def one_line(answer: tuple[int, str, str]) -> str:
    code, printed, log = answer
    assert (code, printed) == (1, "")
    assert log.startswith("motionary: ")
    assert log.count("\n") == 1
    return log


def test_clips_of_two_clusters_are_told_both(motionary, demo_catalog, tmp_path):
    style, onto = two(demo_catalog, "other.label = 'run'")
    answer = motionary("transfer", demo_catalog, tmp_path / "out.bvh", "--style", style, "--onto", onto)
    log = one_line(answer)
    assert re.search(rf"{style} is in cluster \d+ \(walk\), {onto} is in cluster \d+ \(run\)", log)
    assert not (tmp_path / "out.bvh").exists()


def test_clips_of_two_rigs_are_told_both(motionary, demo_catalog, tmp_path):
    style, onto = two(
        demo_catalog,
        "one.cluster_id = other.cluster_id and c1.convention != c2.convention and other.is_reference",
    )
    answer = motionary("transfer", demo_catalog, tmp_path / "out.bvh", "--style", style, "--onto", onto)
    log = one_line(answer)
    assert style in log
    assert onto in log
    assert "different skeletons" in log


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("transfer", "{catalog}", "out.fbx", "--style", "a", "--onto", "b"),
            "'.fbx'; the result is written",
        ),
        (
            ("transfer", "{catalog}", "{out}.bvh", "--style", "walk/walk", "--onto", "b"),
            "no clip 'walk/walk'",
        ),
        (("transfer", "{catalog}", "{library}/x.bvh", "--style", "a", "--onto", "b"), "lies in the library"),
        (("export", "{catalog}", "{out}", "--cluster", "wlak"), "did you mean walk"),
        (("export", "{catalog}", "{out}", "--clip", "gone.bvh"), "no clip 'gone.bvh'"),
        (("export", "{catalog}", "{library}"), "lies in the library"),
        (("export", "nowhere", "{out}"), "nowhere is not a catalog"),
    ],
)
def test_a_mistake_is_one_clear_line(motionary, demo_catalog, demo_library, tmp_path, arguments, message):
    places = {"catalog": demo_catalog, "library": demo_library, "out": tmp_path / "out"}
    assert message in one_line(motionary(*(one.format(**places) for one in arguments)))
    assert not list(tmp_path.iterdir())


def test_a_result_that_cannot_be_written(motionary, demo_catalog, one_rig, tmp_path):
    style, onto, _ = one_rig
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "out.bvh"
    log = one_line(motionary("transfer", demo_catalog, out, "--style", style, "--onto", onto))
    assert f"{out} cannot be written: " in log


@pytest.mark.parametrize("command", ["export", "transfer"])
def test_help(motionary, command):
    code, printed, _ = motionary(command, "--help")
    assert code == 0
    assert f"Usage: motionary {command}" in printed


def test_export_logs_on_stderr_and_says_what_it_wrote(motionary, demo_catalog, tmp_path):
    code, printed, log = motionary("export", demo_catalog, tmp_path, "--cluster", "squat", "--aligned")
    written = sorted(tmp_path.rglob("*.bvh"))
    assert code == 0
    assert printed == (
        f"wrote {len(written)} clips as BVH, in the time of their clusters' references, to {tmp_path}\n"
    )
    assert log.splitlines()[-1] == f"export: {len(written)} of {len(written)}"
    _, printed, _ = motionary("export", demo_catalog, tmp_path, "--format", "parquet")
    assert printed == f"wrote 80 clips, as captured, to {tmp_path} (frames.parquet, clips.parquet)\n"


def test_export_of_chosen_clips(motionary, demo_catalog, one_rig, tmp_path):
    clips = one_rig[:2]
    options = [option for clip in clips for option in ("--clip", clip)]
    code, printed, _ = motionary("export", demo_catalog, tmp_path, *options, "--format", "npz")
    assert code == 0
    assert printed == f"wrote 2 clips as NPZ, as captured, to {tmp_path}\n"
    assert sorted(tmp_path.rglob("*.npz")) == [(tmp_path / clip).with_suffix(".npz") for clip in clips]
    code, _, log = motionary("export", demo_catalog, tmp_path, *options, "--cluster", "walk")
    assert code == 2
    assert "not both" in log


def test_a_clip_that_fails_is_told_and_the_exit_code_is_3(motionary, demo_catalog, one_rig, tmp_path):
    style, onto, _ = one_rig
    in_the_way = Path(tmp_path / style)
    in_the_way.mkdir(parents=True)
    options = ["--clip", style, "--clip", onto, "--overwrite"]
    code, printed, log = motionary("export", demo_catalog, tmp_path, *options)
    assert code == 3
    assert printed == f"wrote 1 clip as BVH, as captured, to {tmp_path}\n"
    assert log.splitlines()[-1] == f"motionary: {style} is not exported: {in_the_way}: Is a directory"
    assert (tmp_path / onto).is_file()


@pytest.mark.parametrize(("result", "is_jerky"), [(5.9, False), (6.1, True)])
def test_a_result_with_a_flip_in_it_is_told(result, is_jerky):
    fastest = {"style": 2.0, "onto": 3.0, "result": result}
    assert StyleTransfer(None, "a.bvh", {}, fastest).is_jerky == is_jerky
