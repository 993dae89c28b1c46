"""Clips as xarray datasets in movement's layout."""

import sys

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.adapters.xarray import clip_datasets
from motionary.pipeline.canonical import CANONICAL_JOINTS, canonical_indices, find_convention


@pytest.fixture(scope="module")
def catalog(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def few(catalog):
    return catalog.sample(5, seed=1)


def assert_is_a_poses_dataset(dataset):
    """Check what movement 0.17 makes and its validator asks for: names, order, types of a poses dataset."""
    assert dataset.position.dims == ("time", "space", "keypoint", "individual")
    assert dataset.confidence.dims == ("time", "keypoint", "individual")
    assert list(dataset.space.values) == ["x", "y", "z"]
    assert len(set(dataset.keypoint.values)) == dataset.sizes["keypoint"]
    assert dataset.sizes["individual"] == 1
    assert dataset.confidence.dtype == np.float32
    assert np.isnan(dataset.confidence).all()
    assert dataset.time.dtype == np.float64
    assert_array_equal(dataset.time, np.arange(dataset.sizes["time"], dtype=np.float64) / dataset.fps)
    assert {"time_unit": "seconds", "ds_type": "poses", "source_software": "motionary"}.items() <= (
        dataset.attrs.items()
    )


@pytest.mark.parametrize("aligned", [False, True])
def test_a_clip_is_a_poses_dataset_of_its_joints(catalog, few, aligned):
    datasets = list(clip_datasets(few, aligned=aligned))
    assert sorted(dataset.clip_id for dataset in datasets) == list(few.clip_ids)
    for dataset in datasets:
        assert_is_a_poses_dataset(dataset)
        motion = (catalog.aligned if aligned else catalog.motion)(dataset.clip_id)
        assert dataset.fps == motion.fps
        assert dataset.source_file == motion.source
        assert list(dataset.keypoint.values) == list(motion.skeleton.names)
        place = motion.positions()
        for joint, name in enumerate(motion.skeleton.names):
            for axis, space in enumerate("xyz"):
                found = dataset.position.sel(keypoint=name, space=space)[:, 0]
                assert_array_equal(found, place[:, joint, axis])


def test_canonical_joints_are_the_same_keypoints_for_every_rig(catalog, few):
    rigs = {tuple(dataset.keypoint.values) for dataset in clip_datasets(few)}
    assert len(rigs) > 1
    for dataset in clip_datasets(few, canonical=True):
        assert tuple(dataset.keypoint.values) == CANONICAL_JOINTS
        motion = catalog.motion(dataset.clip_id)
        joints = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
        assert_array_equal(
            dataset.position[..., 0].transpose("time", "keypoint", "space"), motion.positions()[:, joints]
        )


def test_attributes_tell_what_is_known(few):
    known = few.to_pandas().set_index("clip_id")
    for dataset in clip_datasets(few):
        row = known.loc[dataset.clip_id]
        assert (dataset.label, dataset.cluster_id) == (row.label, row.cluster_id)
        assert (dataset.attrs["style"], dataset.subject) == (row["style"], row.subject)
        assert list(dataset.individual.values) == [row.subject]
        assert "licence" not in dataset.attrs  # nobody gave one
        assert ("unit" in dataset.attrs) == (row.unit == row.unit)


def test_an_individual_without_a_name(few, monkeypatch):
    unnamed = few.to_arrow().drop_columns("subject")
    monkeypatch.setattr(type(few), "to_arrow", lambda selection: unnamed)
    assert {str(dataset.individual.values[0]) for dataset in clip_datasets(few)} == {"id_0"}


def test_a_dataset_can_be_written_as_netcdf(few, tmp_path):
    dataset = next(clip_datasets(few))
    dataset.to_netcdf(tmp_path / "clip.nc", engine="scipy")
    with xr.open_dataset(tmp_path / "clip.nc", engine="scipy") as back:
        xr.testing.assert_equal(back.position, dataset.position)
        assert back.attrs["clip_id"] == dataset.clip_id


def test_without_xarray_it_says_so(few, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(CatalogError, match=r"need xarray.*install motionary\[xarray\]"):
        next(clip_datasets(few))
