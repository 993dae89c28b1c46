"""The cluster stage: pairs in any parts and order, each once; nothing is left in the temporary folder."""

import errno
import itertools
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from motionary.pipeline.clustering import cut_tree, fuzzy_linkage, modularity_cut, ward_linkage
from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.cluster import cluster
from motionary.pipeline.stages.columns import condensed, condensed_places, mapped_distances
from motionary.pipeline.tables import TABLES

METRICS = ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high")
NONE = pa.table({"clip_id": pa.array([], pa.string()), "label": pa.array([], pa.string())})
CLIPS = 14


def clip_ids(clips):
    return pa.array([f"{'zyx'[i % 3]}/clip {i}" for i in range(clips)]).sort()


def ingested(clips):
    columns = {field.name: pa.nulls(clips, field.type) for field in TABLES["ingested"]}
    return pa.table(columns | {"clip_id": clip_ids(clips)})


def all_pairs(clips, seed=0):
    """Every pair, a row each in the order of the clips, with distances that are often tied."""
    rng = np.random.default_rng(seed)
    a, b = (pa.array(side) for side in zip(*itertools.combinations(range(clips), 2), strict=True))
    distances = [rng.integers(1, 9, len(a)).astype(np.float32) / 3 for _ in METRICS]
    distances[-1] += distances[-2]
    return pa.table(
        {"clip_a": clip_ids(clips).take(a), "clip_b": clip_ids(clips).take(b)}
        | dict(zip(METRICS, distances, strict=True))
    )


def divided(pairs, seed):
    """The same pairs in another order and in parts, some the other way round or as dictionaries."""
    rng = np.random.default_rng(seed)
    turned = pairs.rename_columns(["clip_b", "clip_a", *METRICS]).select(pairs.column_names)
    which = rng.permutation(len(pairs))
    cuts = np.sort(rng.integers(0, len(pairs) + 1, rng.integers(0, 5)))
    parts = [[pairs, turned][place % 2].take(rows) for place, rows in enumerate(np.split(which, cuts))]
    encoded = [part.set_column(0, "clip_a", part["clip_a"].dictionary_encode()) for part in parts]
    return Parts.of(*(encoded if seed % 2 else parts))


@settings(max_examples=25, deadline=None)
@given(clips=st.integers(2, 20), seed=st.integers(0, 2**16))
def test_any_parts_and_any_order_give_the_same_tables(clips, seed):
    pairs, config = all_pairs(clips, seed), ClusterConfig(primary="average")
    whole = cluster(ingested(clips), Parts.of(pairs), NONE, NONE, config)
    parted = cluster(ingested(clips), divided(pairs, seed), NONE, NONE, config)
    assert all(parted[name].equals(table) for name, table in whole.items())


def test_the_dendrograms_are_those_of_the_distances_in_memory():
    pairs = all_pairs(CLIPS)
    tables = cluster(ingested(CLIPS), divided(pairs, 1), NONE, NONE, ClusterConfig())
    places = condensed_places(pairs, clip_ids(CLIPS))
    low, high = (condensed(pairs, name, places) for name in ("fuzzy_low", "fuzzy_high"))
    tau, weighted = ClusterConfig().fuzzy_tau, condensed(pairs, "weighted", places)
    expected = {
        ("ward", "weighted"): (ward_linkage(weighted), weighted),
        ("fuzzy", "fuzzy"): (fuzzy_linkage(low, high, tau), low + tau * (high - low)),
    }
    rows, parts = tables["linkage"].to_pandas(), tables["partitions"].to_pandas()
    for (method, metric), (Z, key) in expected.items():
        own = rows[(rows["method"] == method) & (rows["metric"] == metric)]
        assert_array_equal(own[["left", "right", "height", "size"]], Z)
        labels = parts[(parts["method"] == method) & (parts["metric"] == metric)]["cluster"]
        assert_array_equal(labels, cut_tree(Z, n_clusters=modularity_cut(Z, key).n_clusters))


@settings(max_examples=50, deadline=None)
@given(clips=st.integers(1, 12), seed=st.integers(0, 2**16))
def test_distances_stand_in_condensed_order(clips, seed):
    pairs = all_pairs(clips, seed) if clips > 1 else all_pairs(2).slice(0, 0)
    found = mapped_distances(divided(pairs, seed), ("weighted", "dtw"), clip_ids(clips))
    for distances, name in zip(found, ("weighted", "dtw"), strict=True):
        assert distances.dtype == np.float32
        assert_array_equal(distances, pairs[name].to_numpy())


def test_one_clip_needs_no_pairs():
    tables = cluster(ingested(1), Parts.of(), NONE, NONE, ClusterConfig())
    assert tables["groups"]["group"].to_pylist() == [0]
    assert len(tables["linkage"]) == 0


@pytest.mark.parametrize("row", [0, 7, 8, 50, 90])
def test_a_missing_pair_is_named(row):
    pairs = all_pairs(CLIPS)
    a, b = pairs["clip_a"][row].as_py(), pairs["clip_b"][row].as_py()
    kept = pa.concat_tables([pairs.slice(0, row), pairs.slice(row + 1)])
    with pytest.raises(ValueError, match=f"91 pairs; there are 90, and that of {a} and {b} is missing"):
        mapped_distances(divided(kept, row), ("dtw",), clip_ids(CLIPS))


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("row", [0, 50, 90])
def test_a_pair_that_stands_twice_is_named(row, parts):
    pairs = all_pairs(CLIPS)
    a, b = pairs["clip_a"][row].as_py(), pairs["clip_b"][row].as_py()
    # As many rows as there are pairs: another one is missing.
    tables = [pairs.slice(1) if row else pairs.slice(0, 90), pairs.slice(row, 1)]
    with pytest.raises(ValueError, match=f"the pair of {a} and {b} stands twice"):
        mapped_distances(
            Parts.of(*(tables if parts == 2 else [pa.concat_tables(tables)])), ("dtw",), clip_ids(CLIPS)
        )


def test_pairs_of_other_clips_are_refused():
    with pytest.raises(ValueError, match="z/clip 9 has pairs and is not among the 13 clips"):
        mapped_distances(Parts.of(all_pairs(CLIPS)), ("dtw",), clip_ids(CLIPS).slice(0, 13))
    pairs = all_pairs(CLIPS)
    with pytest.raises(ValueError, match="the pair of x/clip 11 and x/clip 11 is of one clip"):
        mapped_distances(Parts.of(pairs.set_column(1, "clip_b", pairs["clip_a"])), ("dtw",), clip_ids(CLIPS))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def mapped_files(folder):
    """Files of the folder that this process has mapped, whether or not they have a name."""
    return [line for line in Path("/proc/self/maps").read_text().splitlines() if str(folder) in line]


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="this system does not list what is mapped")
@pytest.mark.parametrize("ends_well", [True, False])
def test_nothing_is_left_in_the_temporary_folder(folder, ends_well):
    pairs, mapped = all_pairs(CLIPS), []

    def load(key, columns):
        mapped.append(len(mapped_files(folder)))
        assert [*folder.iterdir()] == []
        if len(mapped) == 4 and not ends_well:
            raise RuntimeError("the disk is gone")
        return pairs.select(columns)

    if ends_well:
        cluster(ingested(CLIPS), Parts(load, ["all"]), NONE, NONE, ClusterConfig())
    else:
        with pytest.raises(RuntimeError, match="the disk is gone"):
            cluster(ingested(CLIPS), Parts(load, ["all"]), NONE, NONE, ClusterConfig())
    assert mapped == [1, 1, 1, 2]  # A distance at a time, and the two ends of the fuzzy one.
    assert [*folder.iterdir()] == []
    assert mapped_files(folder) == []


def test_a_full_disk_is_named_before_a_page_is_touched(folder, monkeypatch):
    def full(descriptor, start, size):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full)
    with pytest.raises(OSError, match=f"{folder} has no room for 8 GB .* set TMPDIR") as refused:
        mapped_array((10**9,), np.float64)
    assert refused.value.errno == errno.ENOSPC
    assert [*folder.iterdir()] == []


def test_where_files_cannot_be_reserved_they_are_written(folder, monkeypatch):
    monkeypatch.delattr("os.posix_fallocate")
    monkeypatch.setattr("motionary.pipeline.clustering.mapped._BLOCK", 1000)
    made = mapped_array((3, 411), np.float64)
    assert (made.shape, made.dtype) == ((3, 411), np.float64)
    assert not made.any()
    assert [*folder.iterdir()] == []
