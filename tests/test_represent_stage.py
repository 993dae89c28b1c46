"""References chosen part by part: against a plain computation, for any room and any division into parts."""

import math
from itertools import combinations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest
from scipy.spatial.distance import squareform

from motionary.catalog import Catalog
from motionary.pipeline.alignment import joint_weights, score_references
from motionary.pipeline.config import AlignmentConfig, ClusterConfig, DistanceConfig
from motionary.pipeline.distances import pairwise_distances
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.stages.compare import thresholds_of
from motionary.pipeline.stages.represent import represent
from motionary.pipeline.stages.represent_landmarks import represent_landmarks
from motionary.pipeline.tables import TABLES

LARGE = 2**40


@pytest.fixture(scope="module")
def library(demo_catalog):
    """Return the tables of forty of the demo's clips, in clusters of 24, 13, 2 and 1."""
    catalog = Catalog.open(demo_catalog)
    ids = catalog.clips.to_arrow()["clip_id"].to_pylist()[:40]
    wanted = pa.array(ids)

    def own(name, *columns):
        table = getattr(catalog, name).to_arrow()
        for column in columns:
            table = table.filter(pc.is_in(table[column], wanted))
        return table

    cluster_ids = [5] * 24 + [2] * 13 + [9] * 2 + [3]
    members = pa.table({"clip_id": ids, "cluster_id": cluster_ids[::-1]}, schema=TABLES["members"])
    return {
        "members": members,
        "ingested": own("clips", "clip_id").select(["clip_id", "digest"]),
        "pairs": own("pairs", "clip_a", "clip_b"),
        "features": own("features", "clip_id"),
        "resampled": own("resampled", "clip_id"),
    }


def made(library, pairs=None, features=None, earlier=None, kept=None, room=LARGE, **config):
    earlier = earlier or {name: TABLES[name].empty_table() for name in ("centres", "reference_features")}
    tables = represent(
        library["members"], library["ingested"], earlier["centres"], earlier["reference_features"],
        pairs or Parts.of(library["pairs"]), features or Parts.of(library["features"]), kept or {},
        ClusterConfig(**config), AlignmentConfig(), room,
    )  # fmt: skip
    return {name: table.combine_chunks() for name, table in tables.items()}


def clips_of(library):
    clusters = {}
    for row in library["members"].to_pylist():
        clusters.setdefault(row["cluster_id"], []).append(row["clip_id"])
    return clusters


def divided(table, generator, column="clip_id"):
    """The rows in several parts, whose order is anybody's; those of a clip together."""
    owner = np.array(table[column].to_pylist())
    part_of = {one: generator.integers(5) for one in sorted(set(owner))}
    number = np.array([part_of[one] for one in owner])
    parts = [table.take(np.flatnonzero(number == one)) for one in generator.permutation(5)]
    names = [part.column_names.index(name) for part in parts[:1] for name in ("clip_id", "clip_a", "clip_b")
             if name in part.column_names]  # fmt: skip
    return Parts.of(*(_with_dictionaries(part, names) if i % 2 else part for i, part in enumerate(parts)))


def _with_dictionaries(part, places):
    for place in places:
        part = part.set_column(place, part.column_names[place], part.column(place).dictionary_encode())
    return part


def shuffled(pairs, generator):
    """The pairs in any order and in parts of any size, some clips of pairs exchanged."""
    pairs = pairs.take(generator.permutation(len(pairs)))
    borders = [0, *sorted(generator.integers(0, len(pairs), 6).tolist()), len(pairs)]
    parts = [pairs.slice(start, end - start) for start, end in zip(borders, borders[1:], strict=False)]
    swapped = ["clip_b", "clip_a", *pairs.column_names[2:]]
    return Parts.of(*(part.rename_columns(swapped) if i % 3 == 0 else part for i, part in enumerate(parts)))


@pytest.mark.parametrize("metric", ["weighted", "dtw", "b_dtw"])
def test_references_are_those_of_the_clusters_one_by_one(library, metric):
    tables = made(library, metric=metric)
    digests = dict(zip(*(library["ingested"][one].to_pylist() for one in ("clip_id", "digest")), strict=True))
    distance = {
        frozenset((row["clip_a"], row["clip_b"])): row[metric] for row in library["pairs"].to_pylist()
    }
    features = library["features"]
    centres = {row["cluster_id"]: row for row in tables["centres"].to_pylist()}
    rows = {row["clip_id"]: row for row in tables["represented"].to_pylist()}
    assert [*rows] == library["members"]["clip_id"].to_pylist()
    assert [*centres] == [2, 3, 5, 9]
    for cluster_id, ids in clips_of(library).items():
        in_order = sorted(ids, key=digests.get)
        poses = [
            np.array(features.filter(pc.equal(features["clip_id"], one))["feature"].to_pylist(), np.float32)
            for one in in_order
        ]
        scores = score_references([one[:, :57] for one in poses], joint_weights(AlignmentConfig().weights))
        centre = centres[cluster_id]
        reference = in_order[scores.index]
        assert centre["clip_id"] == reference
        assert centre["digest"] == digests[reference]
        assert (centre["size"], centre["frames"]) == (len(ids), len(poses[scores.index]))
        assert centre["similarity_index"] == scores.similarity[scores.index]
        own = pc.equal(tables["reference_features"]["cluster_id"], cluster_id)
        shown = np.array(tables["reference_features"].filter(own)["feature"].to_pylist(), np.float32)
        np.testing.assert_array_equal(shown, poses[scores.index])
        for one in ids:
            expected = 0.0 if one == reference else distance[frozenset((one, reference))]
            assert rows[one]["distance_to_reference"] == expected
            assert rows[one]["is_reference"] == (one == reference)


@pytest.mark.parametrize("room", [0, 400_000, LARGE])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_neither_room_nor_parts_change_a_bit(library, room, seed):
    generator = np.random.default_rng(seed)
    pairs = shuffled(library["pairs"], generator)
    features = divided(library["features"], generator)
    assert made(library, pairs, features, room=room) == made(library)


def test_features_are_read_for_as_many_clusters_as_there_is_room_for(library):
    def reads(room):
        loads = []

        def load(key, columns):
            loads.append(columns)
            return library["features"].select(columns)

        made(library, features=Parts(load, ["all"]), room=room)
        return loads.count(["clip_id", "feature"]) - 1  # the references' own frames

    assert reads(0) == 4
    assert reads(LARGE) == 1
    assert 1 < reads(400_000) < 4


def test_pairs_between_clusters_need_not_be_there(library):
    clusters = clips_of(library)
    inside = {frozenset(pair) for ids in clusters.values() for pair in combinations(ids, 2)}
    mask = [frozenset((row["clip_a"], row["clip_b"])) in inside for row in library["pairs"].to_pylist()]
    few = library["pairs"].filter(pa.array(mask))
    assert len(few) == math.comb(24, 2) + math.comb(13, 2) + 1
    assert made(library, Parts.of(few)) == made(library)


@pytest.mark.parametrize("times", [0, 2])
def test_a_pair_inside_a_cluster_that_is_not_there_once_is_named(library, times):
    a, b = clips_of(library)[2][3:5]
    pairs = library["pairs"]
    one = pc.and_(pc.equal(pairs["clip_a"], a), pc.equal(pairs["clip_b"], b))
    others = pairs.filter(pc.invert(one))
    assert len(others) == len(pairs) - 1
    with pytest.raises(ValueError, match=f"{a} and {b} are of cluster 2 and stand {times} times"):
        made(library, Parts.of(others, *[pairs.filter(one)] * times))


def test_a_clip_without_frames_is_named(library):
    gone = clips_of(library)[5][7]
    features = library["features"].filter(pc.not_equal(library["features"]["clip_id"], gone))
    with pytest.raises(ValueError, match=f"{gone} has no frames"):
        made(library, features=Parts.of(features))


def stilled(library, clip_id):
    """The features, with a clip that does not move."""
    features = library["features"]
    vectors = np.array(features["feature"].to_pylist(), np.float32)
    own = np.array(features["clip_id"].to_pylist()) == clip_id
    vectors[own] = vectors[own][0]
    field = TABLES["features"].field("feature")
    place = features.column_names.index("feature")
    return features.set_column(place, field, pa.array([*vectors], field.type))


def test_where_a_clip_stands_still_the_medoid_is_chosen(library):
    features = stilled(library, clips_of(library)[5][0])
    tables = made(library, features=Parts.of(features))
    ids = clips_of(library)[5]
    sums = dict.fromkeys(ids, 0.0)
    for row in library["pairs"].to_pylist():
        if row["clip_a"] in sums and row["clip_b"] in sums:
            sums[row["clip_a"]] += row["weighted"]
            sums[row["clip_b"]] += row["weighted"]
    centres = {row["cluster_id"]: row for row in tables["centres"].to_pylist()}
    assert centres[5]["clip_id"] == min(ids, key=sums.get)
    assert centres[5]["similarity_index"] is None
    assert centres[2]["similarity_index"] is not None
    again = made(library, shuffled(library["pairs"], np.random.default_rng(4)), Parts.of(features), room=0)
    assert again == tables


def drawn(library, distances):
    """The pairs, their weighted distances by thresholds that are drawn."""
    frames = [matrix(part["feature"]) for part in per_clip(library["resampled"]).values()]
    ids = [*per_clip(library["resampled"])]
    found = squareform(pairwise_distances(frames, n_jobs=1, thresholds=thresholds_of(distances)).weighted)
    pairs = library["pairs"]
    a, b = (np.array([ids.index(one) for one in pairs[name].to_pylist()]) for name in ("clip_a", "clip_b"))
    place = pairs.column_names.index("weighted")
    field = pairs.schema.field(place)
    return pairs.set_column(place, field, pa.array(found[a, b].astype(np.float32), field.type))


@pytest.mark.parametrize("thresholds", ["midpoints", "random"])
@pytest.mark.parametrize("metric", ["weighted", "dtw"])
def test_distances_that_are_computed_there_choose_the_same(library, metric, thresholds):
    features = stilled(library, clips_of(library)[5][0])  # whose cluster gets a medoid
    distances = DistanceConfig(thresholds=thresholds)
    pairs = drawn(library, distances) if thresholds == "random" else library["pairs"]
    wanted = made(library, Parts.of(pairs), Parts.of(features), metric=metric)
    empty = [TABLES[name].empty_table() for name in ("centres", "reference_features")]
    resampled = divided(library["resampled"], np.random.default_rng(0))
    found = represent_landmarks(
        library["members"], library["ingested"], *empty, resampled, Parts.of(features), {},
        distances, ClusterConfig(metric=metric), AlignmentConfig(), 0,
    )  # fmt: skip
    assert {name: table.combine_chunks() for name, table in found.items()} == wanted


def test_a_kept_cluster_keeps_its_reference(library):
    before = made(library)
    for clusters in ([5], [2, 9], [2, 3, 5, 9]):
        names = {one["cluster_id"]: one["clip_id"] for one in before["centres"].to_pylist()}
        kept = {one: names[one] for one in clusters}
        ids = [one for cluster, ids in clips_of(library).items() if cluster not in kept for one in ids]
        only = pc.is_in(library["features"]["clip_id"], pa.array(ids, pa.string()))
        features = Parts.of(library["features"].filter(only))
        assert made(library, features=features, earlier=before, kept=kept) == before


def test_no_clip_at_all():
    none = {name: schema.empty_table() for name, schema in TABLES.items()}
    tables = made(none, Parts.of(), Parts.of())
    assert {name: len(table) for name, table in tables.items()} == dict.fromkeys(tables, 0)
    assert all(table.schema == TABLES[name] for name, table in tables.items())
