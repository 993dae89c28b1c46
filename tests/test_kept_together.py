"""Clips of one recording or subject are found, by what the clips are and not by what they are called."""

import numpy as np
import pyarrow as pa
import pytest

from motionary.catalog import Catalog
from motionary.catalog.kept_together import kept_together
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.readers import read_motion
from motionary.pipeline.writers import write_bvh
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job


@pytest.fixture(scope="module")
def cut_up(demo_library, silent_progress, tmp_path_factory) -> Catalog:
    """Catalog of three takes: one cut in three that share the frames of the cuts, one copied, one alone."""
    library = tmp_path_factory.mktemp("cut") / "library"
    library.mkdir()
    walk_file, run_file, wave_file = (
        sorted((demo_library / action).glob("*.bvh"))[0] for action in ("walk", "run", "wave")
    )
    walk = read_motion(walk_file)
    cuts = (0, walk.frames // 3, 2 * walk.frames // 3, walk.frames - 1)
    for number, (start, end) in enumerate(zip(cuts, cuts[1:], strict=False)):
        write_bvh(walk.sampled(np.arange(start, end + 1)), library / f"{'zay'[number]}.bvh")
    for name in ("copy_1.bvh", "copy_2.bvh"):
        (library / name).write_bytes(run_file.read_bytes())
    (library / "alone.bvh").write_bytes(wave_file.read_bytes())
    labels = library.parent / "labels.csv"
    labels.write_text(
        "clip_id,action,subject\nz.bvh,walk,1\na.bvh,walk,\ncopy_1.bvh,run,2\nalone.bvh,wave,\n"
    )
    job = Job([str(library)], str(library.parent / "catalog"), PipelineConfig(), labels)
    return run(job, silent_progress).catalog


def found(catalog: Catalog, *columns: str, **how: bool) -> set[frozenset[str]]:
    clips = catalog.clips.to_arrow()
    together = kept_together(catalog, clips, columns, **how)
    groups: dict[str, set[str]] = {}
    for clip_id, group in zip(clips["clip_id"].to_pylist(), together.groups, strict=True):
        groups.setdefault(group, set()).add(clip_id.removesuffix(".bvh"))
    return {frozenset(group) for group in groups.values()}


def sets(*groups: str) -> set[frozenset[str]]:
    return {frozenset(group.split()) for group in groups}


def test_cuts_of_one_take_and_copies_are_kept_together(cut_up):
    assert found(cut_up) == sets("z a y", "copy_1 copy_2", "alone")


def test_frames_can_be_left_out(cut_up):
    assert found(cut_up, shared_frames=False) == sets("z", "a", "y", "copy_1 copy_2", "alone")


def test_clips_of_one_subject_are_kept_together_and_so_are_those_of_none(cut_up):
    # z and a are of one recording, a and alone of nobody, and nobody's copy_2 is the copy of 2's copy_1.
    assert found(cut_up, "subject") == sets("z a y alone copy_1 copy_2")
    assert found(cut_up, "subject", shared_frames=False) == sets("z", "a y alone copy_1 copy_2")
    together = kept_together(cut_up, cut_up.clips.to_arrow(), ["subject"])
    assert (together.without, together.recordings) == (4, 3)


def test_a_groups_name_outlives_the_names_of_files(cut_up):
    clips = cut_up.clips.to_arrow()
    place = clips.schema.get_field_index("clip_id")
    renamed = clips.set_column(place, "clip_id", pa.array([f"n{one}" for one in range(len(clips))]))
    before = kept_together(cut_up, clips, shared_frames=False).groups
    assert kept_together(cut_up, renamed, shared_frames=False).groups == before


def test_no_two_embedded_takes_are_of_one_recording(demo_catalog):
    catalog = Catalog.open(demo_catalog)
    assert kept_together(catalog, catalog.clips.to_arrow()).recordings == len(catalog.clips)


def test_repetitions_of_hdm05_that_share_a_frame_are_one_recording(shared_data, silent_progress, tmp_path):
    library = tmp_path / "library"
    library.mkdir()
    takes = [shared_data / "hdm05" / f"HDM_bd_{name}_120.amc" for name in (
        "squat1Reps_001", "squat1Reps_002", "squat1Reps_003", "squat1Reps_004", "squat1Reps_005",
        "kickLFront1Reps_001", "kickLFront1Reps_002", "kickLFront1Reps_003",
    )]  # fmt: skip
    for file in (*takes, shared_data / "hdm05" / "HDM_bd.asf"):
        (library / file.name).write_bytes(file.read_bytes())
    catalog = run(Job([str(library)], str(tmp_path / "catalog"), PipelineConfig()), silent_progress).catalog
    together = kept_together(catalog, catalog.clips.to_arrow())
    # In clip_id order: kicks 1 and 2 share a frame, and squats 1 to 4; kick 3 and squat 5 are others.
    numbers = list(dict.fromkeys(together.groups))
    assert [numbers.index(one) for one in together.groups] == [0, 0, 1, 2, 2, 2, 2, 3]
