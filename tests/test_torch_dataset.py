"""Selections as torch datasets; where torch is not installed, with a stub of the little that is called."""

import importlib.util
import pickle
import sys
from collections import Counter
from dataclasses import replace
from importlib.machinery import ModuleSpec
from itertools import pairwise
from types import ModuleType, SimpleNamespace

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.adapters.clip_parts import ClipParts
from motionary.catalog.adapters.nearby_shuffle import NearbyShuffle
from motionary.catalog.adapters.torch import NO_LABEL, MotionDataset, padded
from motionary.catalog.store import Store
from motionary.catalog.table import CatalogTable
from motionary.pipeline.canonical import canonical_indices, find_convention
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import at_rate, frame_features
from motionary.pipeline.stages.columns import matrix
from motionary.pipeline.stages.motions import read_motion_rows
from motionary.pipeline.tables import TABLES

torch = importlib.import_module("torch") if importlib.util.find_spec("torch") else None
needs_torch = pytest.mark.skipif(torch is None, reason="torch is not installed")


@pytest.fixture(autouse=True)
def stub_of_torch(monkeypatch):
    if torch is None:
        stub = ModuleType("torch")
        stub.__spec__ = ModuleSpec("torch", None)
        stub.tensor = np.array
        monkeypatch.setitem(sys.modules, "torch", stub)


@pytest.fixture(scope="module")
def catalog(demo_catalog):
    return Catalog.open(demo_catalog)


@pytest.fixture(scope="module")
def few(catalog):
    """Choose clips of both frame rates, of several parts and clusters."""
    return catalog.sample(12, seed=3)


def shown(catalog, clip_id, representation, aligned, frame_rate=None):
    """Read a clip by what the catalog answers one clip at a time."""
    motion = catalog.aligned(clip_id) if aligned else catalog.motion(clip_id)
    if representation == "features":
        return {"features": frame_features(motion, FeatureConfig()).values}
    if frame_rate is not None:
        motion = at_rate(motion, frame_rate)
    if representation == "rotations":
        return {"rotations": motion.rotations, "root_position": motion.root_position}
    clips = catalog.clips.to_pandas().set_index("clip_id")
    joints = canonical_indices(motion.skeleton, find_convention(motion.skeleton.names))
    return {"positions": motion.positions()[:, joints] / clips.leg_length[clip_id]}


def assert_shows(item, arrays, stretch=slice(None)):
    assert set(item) == {*arrays, "clip", "start", "frames", "label", "cluster"}
    for name, values in arrays.items():
        found = np.asarray(item[name])
        assert found.dtype == np.float32
        assert len(found) == item["frames"]
        assert_allclose(found, values[stretch], rtol=1e-5, atol=2e-5)


@pytest.mark.parametrize("aligned", [False, True])
@pytest.mark.parametrize("representation", ["positions", "rotations", "features"])
def test_whole_clips(catalog, few, representation, aligned):
    dataset = MotionDataset(few, representation, aligned=aligned)
    assert len(dataset) == len(few) == 12
    for item, clip_id in zip(dataset, few.clip_ids, strict=True):
        assert dataset.clip_ids[item["clip"]] == clip_id
        assert item["start"] == 0
        assert_shows(item, shown(catalog, clip_id, representation, aligned))


@pytest.mark.parametrize("aligned", [False, True])
@pytest.mark.parametrize("representation", ["positions", "rotations", "features"])
def test_windows_are_stretches_of_the_clips(catalog, few, representation, aligned):
    rate = None if representation == "features" or aligned else 25.0
    if representation == "rotations":  # which those of two rigs have not in common
        few = few.filter(convention="mixamo")
    dataset = MotionDataset(few, representation, aligned=aligned, frame_rate=rate, window=20, stride=7)
    expected = []
    for place, clip_id in enumerate(few.clip_ids):
        arrays = shown(catalog, clip_id, representation, aligned, rate)
        frames = len(next(iter(arrays.values())))
        expected += [(place, start, arrays) for start in range(0, frames, 7) if start + 20 <= frames]
    assert len(dataset) == len(expected) > 12
    for item, (place, start, arrays) in zip(dataset, expected, strict=True):
        assert (item["clip"], item["start"], item["frames"]) == (place, start, 20)
        assert_shows(item, arrays, slice(start, start + 20))


def test_windows_lie_end_to_end_unless_told_and_short_clips_are_named(catalog, few):
    dataset = MotionDataset(few, "features", window=40)
    for before, item in pairwise(dataset):
        assert item["start"] in (0, before["start"] + 40)
    lengths = {clip_id: len(values) for clip_id, values in few.features()}
    assert dataset.left_out == [one for one in few.clip_ids if lengths[one] < 40]
    longest = max(lengths.values())
    assert MotionDataset(few, "features", window=longest).left_out != []
    nothing = MotionDataset(few, "features", window=longest + 1)
    assert (len(nothing), nothing.left_out) == (0, list(few.clip_ids))


def test_windows_of_clips_of_several_rates_want_one(few):
    with pytest.raises(ValueError, match="with 30, 60 frames a second; give frame_rate"):
        MotionDataset(few, window=20)
    assert len(MotionDataset(few, window=20, frame_rate=30)) > 0


def test_an_item_from_the_end_and_one_that_is_not_there(few):
    dataset = MotionDataset(few)
    assert dataset[-1]["clip"] == 11
    with pytest.raises(IndexError):
        dataset[12]
    assert len(MotionDataset(few.sample(0))) == 0


def test_labels_have_a_vocabulary(catalog, few):
    known = few.to_pandas().set_index("clip_id")
    dataset = MotionDataset(few, "features")
    assert list(dataset.labels) == sorted(set(known.label.dropna()))
    for item in dataset:
        clip_id = dataset.clip_ids[item["clip"]]
        assert dataset.labels[item["label"]] == known.label[clip_id]
        assert item["cluster"] == known.cluster_id[clip_id]
    vocabulary = sorted(set(known["style"]), reverse=True)
    styles = MotionDataset(few, "features", label_column="style", labels=vocabulary)
    assert list(styles.labels) == vocabulary
    assert [styles.labels[item["label"]] for item in styles] == list(known["style"])
    without = MotionDataset(few, "features", label_column="licence")
    assert (without.labels, {item["label"] for item in without}) == ((), {NO_LABEL})


def test_a_label_outside_the_vocabulary_and_a_column_that_is_not_there(few):
    with pytest.raises(
        ValueError, match=r"clip '.*' is called '.*', which is not among the labels given: walk"
    ):
        MotionDataset(few, labels=["walk"])
    with pytest.raises(CatalogError, match="no column 'lable'; did you mean .*label"):
        MotionDataset(few, label_column="lable")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"representation": "quaternions"}, "representation is 'quaternions'; it must be one of positions"),
        ({"window": 0}, "window is 0"),
        ({"window": 3, "stride": 0}, "stride is 0"),
        ({"stride": 3}, "stride .3. is given without window"),
        ({"frame_rate": 0}, "frame_rate is 0"),
        ({"frame_rate": 30, "representation": "features"}, "have the common rate; leave it out"),
        ({"kept_parts": 0}, "kept_parts is 0"),
    ],
)
def test_an_option_out_of_its_range(few, options, message):
    with pytest.raises(ValueError, match=message):
        MotionDataset(few, **options)


@pytest.fixture
def reads(monkeypatch):
    """Count how often each part is read."""
    counts = Counter()
    usual = ClipParts._read

    def counted(parts, file):
        counts[file] += 1
        return usual(parts, file)

    monkeypatch.setattr(ClipParts, "_read", counted)
    return counts


@pytest.fixture
def stored(tmp_path):
    """Store features of twelve clips in four parts; return what stands for their catalog, and the values."""
    store = Store(str(tmp_path))
    values = {f"clip {one:02}": np.full((5, 2), one, dtype=np.float32) for one in range(12)}
    for part in range(4):
        rows = [
            {"clip_id": name, "frame": frame, "feature": values[name][frame]}
            | dict.fromkeys(("root_x", "root_z", "root_height", "heading"), 0.0)
            for name in [*values][3 * part : 3 * part + 3]
            for frame in range(5)
        ]
        store.save(f"part{part}", {"features": pa.Table.from_pylist(rows, TABLES["features"])})
    catalog = SimpleNamespace(
        store=store,
        lease=None,
        files=lambda table: [store.part_name(table, f"part{part}") for part in range(4)],
        keep=lambda key, make: {name: place // 3 for place, name in enumerate(values)},
    )
    return catalog, values


def test_a_clip_reads_its_part_and_no_other(stored, reads):
    catalog, values = stored
    parts = ClipParts(catalog, "features", values, ["feature"], kept_parts=1)
    assert not reads
    for name in ("clip 07", "clip 08", "clip 06", "clip 07"):
        assert_array_equal(matrix(parts[name]["feature"]), values[name])
    assert reads == {"tables/features/part2.parquet": 1}


def test_no_more_parts_stay_than_told_those_used_last(stored, reads):
    catalog, values = stored
    parts = ClipParts(catalog, "features", values, ["feature"], kept_parts=2)
    for place in (0, 3, 1, 6, 2, 4):  # the third part puts the second out, which has waited longest
        name = f"clip {place:02}"
        assert_array_equal(matrix(parts[name]["feature"]), values[name])
    assert [reads[f"tables/features/part{part}.parquet"] for part in range(4)] == [1, 2, 1, 0]


def test_a_damaged_part_is_named(stored):
    catalog, values = stored
    catalog.store.write("tables/features/part1.parquet", b"nothing")
    parts = ClipParts(catalog, "features", values, ["feature"], kept_parts=2)
    with pytest.raises(CatalogError, match=r"part1.parquet is damaged or gone"):
        parts["clip 03"]
    assert len(parts["clip 02"]) == 5


def test_a_nearby_shuffle_opens_every_part_once():
    parts = np.repeat(np.arange(9), [3, 5, 1, 4, 4, 2, 6, 3, 4])
    dataset = type("Dataset", (), {"parts": parts, "kept_parts": 3, "__len__": lambda _: len(parts)})()
    shuffle = NearbyShuffle(dataset, seed=5)
    orders = [list(shuffle), list(shuffle)]
    assert len(shuffle) == 32
    assert all(sorted(order) == list(range(32)) for order in orders)
    assert orders[0] != orders[1]
    assert list(NearbyShuffle(dataset, seed=5)) == orders[0] != list(NearbyShuffle(dataset, seed=6))
    for order in orders:
        kept: list[int] = []
        opened: list[int] = []
        for part in parts[order].tolist():
            if part not in kept:
                opened.append(part)
                kept = [*kept, part][-3:]
        assert sorted(opened) == list(range(9))
        assert (np.diff(parts[order]) != 0).sum() > 9  # those kept together are mixed


def test_it_travels_without_what_it_keeps(catalog, few):
    dataset = MotionDataset(few, window=20, stride=10, frame_rate=30)
    fresh = len(pickle.dumps(dataset))
    items = list(dataset)
    sent = pickle.dumps(dataset)
    assert len(sent) == fresh
    for here, there in zip(items, pickle.loads(sent), strict=True):
        assert_array_equal(np.asarray(here.pop("positions")), np.asarray(there.pop("positions")))
        assert here == there


def test_without_torch_it_says_so(few, monkeypatch):
    monkeypatch.setattr("motionary.catalog.adapters.torch.find_spec", lambda name: None)
    with pytest.raises(
        CatalogError, match="needs torch, which is not installed; install .*: pip install torch"
    ):
        MotionDataset(few)


def test_a_clip_that_is_not_aligned(few, monkeypatch):
    usual = CatalogTable.to_arrow
    monkeypatch.setattr(
        CatalogTable, "to_arrow", lambda table: usual(table)[: 0 if table.name == "alignments" else None]
    )
    with pytest.raises(CatalogError, match="is not aligned; leave out `aligned`, or choose other clips"):
        MotionDataset(few, aligned=True)


def test_markers_have_positions_and_no_rotations(few, monkeypatch):
    def of_markers(clip, rows, fps):
        motion = read_motion_rows(clip, rows, fps)
        places = motion.positions() - motion.root_position[:, None]
        return replace(motion, rotations=np.empty((motion.frames, 0, 4)), places=places)

    usual = [np.asarray(item["positions"]) for item in MotionDataset(few, frame_rate=25)]
    monkeypatch.setattr("motionary.catalog.adapters.clip_arrays.read_motion_rows", of_markers)
    for item, positions in zip(MotionDataset(few, frame_rate=25), usual, strict=True):
        assert_allclose(item["positions"], positions, atol=0.05)  # between frames a line is no arc
    with pytest.raises(CatalogError, match="was captured as markers and has no rotations"):
        MotionDataset(few, "rotations")[0]


@needs_torch
@pytest.mark.parametrize("workers", [0, 2])
def test_a_data_loader_batches_windows(few, workers):
    dataset = MotionDataset(few, window=20, frame_rate=30)
    assert isinstance(dataset, torch.utils.data.Dataset)
    context = "spawn" if workers else None
    loader = torch.utils.data.DataLoader(
        dataset, 8, sampler=NearbyShuffle(dataset), num_workers=workers, multiprocessing_context=context
    )
    seen = []
    for batch in loader:
        assert batch["positions"].shape[1:] == (20, 19, 3)
        for row, (clip, start) in enumerate(
            zip(batch["clip"].tolist(), batch["start"].tolist(), strict=True)
        ):
            seen.append((clip, start, batch["positions"][row].numpy().tobytes()))
    direct = [(one["clip"], one["start"], one["positions"].numpy().tobytes()) for one in dataset]
    assert sorted(seen) == sorted(direct)


@needs_torch
def test_whole_clips_are_padded(few):
    dataset = MotionDataset(few, "features")
    (batch,) = torch.utils.data.DataLoader(dataset, len(dataset), collate_fn=padded)
    longest = max(item["frames"] for item in dataset)
    assert batch["features"].shape == (12, longest, 59)
    assert batch["label"].dtype == torch.int64
    for row, item in enumerate(dataset):
        frames = int(batch["frames"][row])
        assert torch.equal(batch["features"][row, :frames], item["features"])
        assert not batch["features"][row, frames:].any()
        assert int(batch["cluster"][row]) == item["cluster"]


def test_windows_of_rotations_want_one_rig(catalog):
    joints = {
        tuple(one["joints"]): clip
        for clip, one in zip(
            *(catalog.clips.to_arrow()[name].to_pylist() for name in ("clip_id", "skeleton")), strict=True
        )
    }
    both = catalog.filter(clip_id=[*joints.values()])
    assert len(both) > 1
    with pytest.raises(ValueError, match=r"rigs with \d+, \d+ joints; choose clips of one rig"):
        MotionDataset(both, "rotations", window=10, frame_rate=30.0)
