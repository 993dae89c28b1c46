"""What is asked about: a clip and its file are the same example, and what is neither is named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.example import example_from_motion, example_of, library_features
from motionary.pipeline.config import FeatureConfig, PipelineConfig
from motionary.pipeline.readers import ReadError, read_motion
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


@pytest.fixture(scope="module")
def paper_catalog(demo_library, tmp_path_factory, silent_progress) -> str:
    """A catalog of other settings, and of many small batches."""
    url = str(tmp_path_factory.mktemp("paper") / "catalog")
    features = FeatureConfig(kind="paper", frame_rate=25.0, epsilon=0.15)
    config = replace(PipelineConfig(), features=features)
    run(Job([str(demo_library / "walk")], url, config), silent_progress)
    return url


def assert_same(one, other):
    for name in ("features", "first_frame", "last_frame", "pose"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    assert one.features.dtype == other.features.dtype == np.float32
    assert one.seconds == other.seconds


def test_a_clip_and_its_file_are_the_same_example(catalog, demo_library):
    for clip_id in catalog.clips.to_arrow()["clip_id"].to_pylist()[::9]:
        clip, file = example_of(catalog, clip_id), example_of(catalog, demo_library / clip_id)
        assert (clip.clip_id, clip.name) == (clip_id, clip_id)
        assert (file.clip_id, file.name) == (None, str(demo_library / clip_id))
        assert_same(clip, file)
        assert len(clip.pose) == clip.last_frame[-1] + 1
        assert len(clip.features) == len(clip.first_frame) < len(clip.pose)


def test_a_file_is_read_by_the_settings_of_the_run(paper_catalog, demo_library):
    with Catalog.open(paper_catalog) as catalog:
        clip_id = catalog.clips.to_arrow()["clip_id"][0].as_py()
        clip = example_of(catalog, clip_id)
        assert clip.features.shape[1] == 54
        assert clip.pose.shape[1] == 59
        assert_same(clip, example_of(catalog, demo_library / "walk" / clip_id))
        motion = read_motion(demo_library / "walk" / clip_id)
        assert_same(clip, example_from_motion(catalog, motion, "anything"))


def test_library_features_are_those_of_the_clips_and_kept(catalog):
    library = library_features(catalog)
    assert library.clip_ids == sorted(catalog.clips.to_arrow()["clip_id"].to_pylist())
    for place in (0, 17, len(library.clip_ids) - 1):
        clip = example_of(catalog, library.clip_ids[place])
        np.testing.assert_array_equal(clip.features, library.clips[place])
    assert library_features(catalog) is library


def test_a_clip_is_meant_before_a_file_of_that_name(catalog, demo_library, tmp_path, monkeypatch):
    clip_id = catalog.clips.to_arrow()["clip_id"][0].as_py()
    (tmp_path / clip_id).parent.mkdir(parents=True)
    (tmp_path / clip_id).write_text("no motion")
    monkeypatch.chdir(tmp_path)
    assert example_of(catalog, clip_id).clip_id == clip_id
    (tmp_path / "other.bvh").write_text("no motion")
    with pytest.raises(ReadError):
        example_of(catalog, "other.bvh")


def test_what_is_neither_a_clip_nor_a_file(catalog, demo_library):
    clip_id = catalog.clips.to_arrow()["clip_id"][0].as_py()
    with pytest.raises(CatalogError, match=f"neither a clip of .* nor a file; did you mean .*{clip_id}"):
        example_of(catalog, clip_id.replace("_", "-"))
    with pytest.raises(CatalogError, match=r"is a folder; name a clip"):
        example_of(catalog, demo_library)


def test_a_clip_in_quarantine_says_why(demo_library, tmp_path, silent_progress):
    library, url = tmp_path / "library", tmp_path / "catalog"
    shutil.copytree(demo_library / "walk", library)
    (library / "broken.bvh").write_text("HIERARCHY\n")
    run(Job([str(library)], str(url), PipelineConfig()), silent_progress)
    with (
        Catalog.open(url) as catalog,
        pytest.raises(CatalogError, match=r"broken\.bvh is in quarantine: .+; .+"),
    ):
        example_of(catalog, "broken.bvh")


def test_an_example_stands_for_itself_whatever_it_is_called(catalog, demo_library):
    """As a dropped file that is called like a clip."""
    name = "walk/walk_tired_alex_01.bvh"
    example = example_from_motion(catalog, read_motion(demo_library / "run/run_tired_bea_01.bvh"), name)
    near = catalog.similar(example, 1)
    assert (near.name, near.table["clip_id"].to_pylist()) == (name, ["run/run_tired_bea_01.bvh"])
    why = catalog.explain(example, "run/run_tired_bea_01.bvh")
    assert (why.a.name, why.a.clip_id, why.distances["dtw"]) == (name, None, 0.0)
