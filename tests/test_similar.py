"""`similar`: what sorting all distances gives, from stored pairs and from files; mutual proximity; joints."""

import csv
import io
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import squareform
from scipy.stats import gamma

from motionary.catalog import Catalog, CatalogError, mutual
from motionary.catalog.example import example_of, library_features
from motionary.catalog.joint_columns import joint_columns
from motionary.catalog.mutual import usual_distances
from motionary.catalog.own_pairs import side_count
from motionary.catalog.ranked_distance import ranked_distance
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.config import ClusterConfig, DistanceConfig, FeatureConfig, PipelineConfig
from motionary.pipeline.distances import compare_clips
from motionary.pipeline.readers import read_motion
from motionary.pipeline.stages.columns import condensed, condensed_places
from motionary.pipeline.writers import write_bvh
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from tests.catalogs import copied

METRICS = ("dtw", "b_dtw", "weighted", "fuzzy")


@pytest.fixture(scope="module")
def fuzzy_catalog(demo_library, tmp_path_factory, silent_progress) -> str:
    """A catalog of other settings, and of many small batches."""
    url = str(tmp_path_factory.mktemp("fuzzy") / "catalog")
    config = replace(
        PipelineConfig(),
        features=FeatureConfig(kind="paper"),
        distances=DistanceConfig(thresholds="random", seed=3, tile=2),
        clusters=ClusterConfig(primary="fuzzy", fuzzy_tau=0.25),
    )
    roots = [str(demo_library / action) for action in ("walk", "run", "wave")]
    run(Job(roots, url, config), silent_progress)
    return url


@pytest.fixture(params=["default", "fuzzy"])
def catalog(request, demo_catalog, fuzzy_catalog):
    with Catalog.open(demo_catalog if request.param == "default" else fuzzy_catalog) as opened:
        yield opened


def clip_ids_of(catalog):
    return sorted(catalog.clips.to_arrow()["clip_id"].to_pylist())


def square(catalog, metric):
    """All distances as table `pairs` holds them, as they are ranked, (N, N)."""
    pairs, ids = catalog.pairs.to_arrow(), catalog.clips.to_arrow()["clip_id"]
    places, tau = condensed_places(pairs, ids), catalog.config.clusters.fuzzy_tau
    if metric != "fuzzy":
        return squareform(condensed(pairs, metric, places)).astype(np.float32)
    low, high = (squareform(condensed(pairs, column, places)) for column in ("fuzzy_low", "fuzzy_high"))
    return ((1 - tau) * low + tau * high).astype(np.float32)


def nearest_by_sorting(distances, clip_ids, k, itself=None):
    order = sorted(range(len(clip_ids)), key=lambda place: (distances[place], clip_ids[place]))
    return [(clip_ids[place], distances[place]) for place in order if clip_ids[place] != itself][:k]


def answered(found):
    return [*zip(found.table["clip_id"].to_pylist(), found.table["distance"].to_numpy(), strict=True)]


@pytest.mark.parametrize("metric", METRICS)
def test_a_clip_and_its_file_find_what_sorting_all_distances_finds(catalog, demo_library, metric):
    clip_ids, distances = clip_ids_of(catalog), square(catalog, metric)
    for place in (0, 11, 20, len(clip_ids) - 1):
        clip_id = clip_ids[place]
        stored = catalog.similar(clip_id, 7, metric=metric)
        assert answered(stored) == nearest_by_sorting(distances[place], clip_ids, 7, clip_id)
        assert (stored.from_pairs, stored.compared, stored.pruned) == (True, 0, 0)
        computed = catalog.similar(demo_library / clip_id, 8, metric=metric)
        assert answered(computed) == nearest_by_sorting(distances[place], clip_ids, 8)
        assert answered(computed)[0] == (clip_id, 0)
        assert not computed.from_pairs
        assert computed.compared + computed.pruned == len(clip_ids)
        assert computed.pruned > 0


def test_the_metric_is_that_of_the_published_clusters(demo_catalog, fuzzy_catalog):
    for url, metric in ((demo_catalog, "weighted"), (fuzzy_catalog, "fuzzy")):
        with Catalog.open(url) as catalog:
            clip_id = clip_ids_of(catalog)[3]
            found = catalog.similar(clip_id)
            assert found.metric == metric
            assert answered(found) == answered(catalog.similar(clip_id, metric=metric))


def test_rows_tell_of_each_clip_what_the_catalog_does(catalog):
    found = catalog.similar(clip_ids_of(catalog)[5], 4)
    takes = catalog.sql("select clip_id, cluster_id, label, seconds from takes").to_pylist()
    known = {row["clip_id"]: row for row in takes}
    for rank, row in enumerate(found.table.to_pylist(), 1):
        assert row["rank"] == rank
        assert {name: row[name] for name in known[row["clip_id"]]} == known[row["clip_id"]]
    assert all(field.metadata[b"meaning"] for field in found.table.schema)
    assert len(found.to_pandas()) == len(found) == 4
    assert "4 clips like" in found._repr_html_()


def test_no_more_clips_than_there_are(catalog):
    clip_ids = clip_ids_of(catalog)
    assert len(catalog.similar(clip_ids[0], 1000)) == len(clip_ids) - 1
    assert len(catalog.similar(clip_ids[0], 1000, joints="legs")) == len(clip_ids) - 1


def slow_mutual(distances, others):
    """Mutual proximity of every two clips, one after another."""
    clips = range(len(distances))

    def further(clip, other):
        own = [float(distances[clip, one]) for one in others if one != clip]
        mean, variance = np.mean(own), np.var(own)
        return gamma.sf(distances[clip, other], mean**2 / variance, scale=variance / mean)

    return np.array([[further(a, b) * further(b, a) if a != b else 0.0 for b in clips] for a in clips])


def test_mutual_proximity_ranks_by_both_clips_distances(demo_catalog):
    with Catalog.open(demo_catalog) as catalog:
        clip_ids, distances = clip_ids_of(catalog), square(catalog, "b_dtw")
        proximity = slow_mutual(distances, range(len(clip_ids)))
        for place in (2, 33):
            found = catalog.similar(clip_ids[place], 6, metric="b_dtw", rank="mutual")
            order = np.argsort(-proximity[place])[:6]
            assert found.table["clip_id"].to_pylist() == [clip_ids[one] for one in order]
            np.testing.assert_allclose(found.table["mutual"].to_numpy(), proximity[place, order], rtol=1e-9)
            np.testing.assert_array_equal(found.table["distance"].to_numpy(), distances[place, order])


def test_a_file_is_ranked_by_mutual_proximity_too(demo_catalog, demo_library):
    with Catalog.open(demo_catalog) as catalog:
        clip_ids = clip_ids_of(catalog)
        found = catalog.similar(demo_library / clip_ids[7], 5, rank="mutual")
        assert found.table["clip_id"][0].as_py() == clip_ids[7]
        assert found.table["mutual"][0].as_py() == 1
        assert found.compared == len(clip_ids)
        stored = catalog.similar(clip_ids[7], 4, rank="mutual").table["clip_id"].to_pylist()
        assert len(set(stored) & set(found.table["clip_id"].to_pylist())) >= 3


def test_usual_distances_of_many_sides_are_to_some_of_them(fuzzy_catalog, monkeypatch):
    with Catalog.open(fuzzy_catalog) as catalog:
        clips, sides = len(catalog.inputs), side_count(catalog)
        monkeypatch.setattr(mutual, "_PAIRS", 3 * (clips // sides) * clips)
        clip_ids, distances = catalog.clips.to_arrow()["clip_id"].combine_chunks(), square(catalog, "dtw")
        usual = usual_distances(catalog, clip_ids, ranked_distance(catalog.config, "dtw"))
        on = dict(catalog.sql("select clip_id, side from inputs").to_pandas().to_numpy())
        chosen = {on[clip_ids[int(place)].as_py()] for place in usual.others}
        assert len(chosen) == 3
        assert {0, max(on.values())} < chosen
        for clip in range(len(clip_ids)):
            own = [float(distances[clip, other]) for other in usual.others if other != clip]
            assert usual.mean[clip] == pytest.approx(np.mean(own), rel=1e-12)
            assert usual.variance[clip] == pytest.approx(np.var(own), rel=1e-9)


def test_joints_are_compared_as_if_there_were_no_others(catalog, demo_library):
    clip_ids, library = clip_ids_of(catalog), library_features(catalog)
    paper = catalog.config.features.kind == "paper"
    names = CANONICAL_JOINTS[1:] if paper else CANONICAL_JOINTS
    knees = [names.index("left_knee"), names.index("right_knee"), names.index("head")]

    def chosen(features):
        places = features[:, : 3 * len(names)].reshape(len(features), len(names), 3) * np.sqrt(len(names))
        return (places[:, knees] / np.sqrt(3)).reshape(len(features), -1)

    place = 12
    clips = [chosen(clip) for clip in library.clips]
    expected = compare_clips([clips[place]], clips).b_dtw[0]
    for asked, itself in ((clip_ids[place], clip_ids[place]), (demo_library / clip_ids[place], None)):
        found = catalog.similar(asked, 5, metric="b_dtw", joints=["knee", "head"])
        assert not found.from_pairs
        wanted = nearest_by_sorting(expected, clip_ids, 5, itself)
        assert [one for one, _ in answered(found)] == [one for one, _ in wanted]
        np.testing.assert_allclose(
            [d for _, d in answered(found)], [d for _, d in wanted], rtol=1e-4, atol=1e-6
        )


def test_a_preset_weighs_joints(demo_catalog):
    arms = joint_columns("arms", "pose+travel")
    joints = {CANONICAL_JOINTS[column // 3] for column in arms.columns}
    assert joints == {"spine", "chest"} | {
        f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist")
    }
    weight = dict(zip(arms.columns // 3, arms.scale.astype(float) ** 2, strict=True))
    assert weight[CANONICAL_JOINTS.index("spine")] == pytest.approx(weight[5] / 2, rel=1e-6)
    assert sum(weight.values()) == pytest.approx(len(CANONICAL_JOINTS), rel=1e-6)
    full = joint_columns("full", "pose+travel")
    np.testing.assert_array_equal(full.scale, 1)
    assert len(full.columns) == 57


def test_only_the_files_of_its_side_are_opened(fuzzy_catalog, tmp_path):
    copy, held = Path(copied(fuzzy_catalog, tmp_path)), []
    with Catalog.open(fuzzy_catalog) as whole:
        clip_id = clip_ids_of(whole)[11]
        expected = answered(whole.similar(clip_id))
        for file in whole.files("pairs"):
            rows = whole.store.read([file])
            if clip_id in {*rows["clip_a"].to_pylist(), *rows["clip_b"].to_pylist()}:
                held.append(copy / file)
            elif len(rows):
                (copy / file).unlink()
        assert 5 < len(held) < len(whole.files("pairs")) / 2
    with Catalog.open(copy) as catalog:
        assert answered(catalog.similar(clip_id)) == expected
    held[2].write_bytes(b"PAR1")
    with Catalog.open(copy) as catalog, pytest.raises(CatalogError, match=held[2].name):
        catalog.similar(clip_id)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"k": 0}, "k is 0"),
        ({"rank": "best"}, "rank is 'best'"),
        ({"joints": "tail"}, "no joint 'tail'.*presets: full, legs, arms"),
        ({"joints": []}, "no joint: nothing to compare"),
        ({"joints": "arms", "rank": "mutual"}, "leave joints out"),
    ],
)
def test_what_cannot_be_asked(demo_catalog, arguments, message):
    with Catalog.open(demo_catalog) as catalog, pytest.raises(ValueError, match=message):
        catalog.similar(clip_ids_of(catalog)[0], **arguments)


def test_the_command_answers_in_every_format(motionary, demo_catalog, demo_library):
    with Catalog.open(demo_catalog) as catalog:
        clip_id = clip_ids_of(catalog)[30]
        rows = catalog.similar(clip_id, 3).table.to_pylist()
    code, out, err = motionary("similar", demo_catalog, clip_id, "-k", 3, "--format", "json")
    assert (code, json.loads(out)) == (0, rows)
    assert err == f"{clip_id}: weighted, read from table pairs\n"
    code, out, err = motionary("similar", demo_catalog, demo_library / clip_id, "-k", 4, "--format", "csv")
    assert [row["clip_id"] for row in csv.DictReader(io.StringIO(out))] == [
        clip_id, *(row["clip_id"] for row in rows)
    ]  # fmt: skip
    assert "clips compared" in err
    assert "ruled out by bounds" in err
    code, out, err = motionary("similar", demo_catalog, clip_id, "--joints", "left_knee, head", "-k", 2)
    assert code == 0
    assert "distance" in out


def test_the_command_finds_occurrences(motionary, demo_catalog, demo_library):
    with Catalog.open(demo_catalog) as catalog:
        clip_id = clip_ids_of(catalog)[30]
        expected = catalog.occurrences(clip_id, 3).to_arrow().to_pylist()
    code, out, err = motionary("similar", demo_catalog, clip_id, "--within", "-k", 3, "--format", "json")
    assert (code, json.loads(out)) == (0, expected)
    assert "searched" in err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["no_such_clip"], 1, "'no_such_clip' is neither a clip of"),
        (["{broken}"], 1, "broken.bvh"),
        (["{clip}", "--joints", "tail"], 2, "no joint 'tail'"),
        (["{clip}", "--joints", "arms", "--rank", "mutual"], 2, "without --joints"),
        (["{clip}", "--within", "--metric", "dtw"], 2, "without --metric"),
        (["{clip}", "-k", "0"], 2, "-k"),
    ],
)
def test_the_command_says_what_it_cannot_do(motionary, demo_catalog, tmp_path, arguments, code, message):
    broken = tmp_path / "broken.bvh"
    broken.write_text("HIERARCHY\n")
    with Catalog.open(demo_catalog) as catalog:
        known = {"broken": broken, "clip": clip_ids_of(catalog)[0]}
    answer, out, err = motionary("similar", demo_catalog, *(one.format(**known) for one in arguments))
    assert (answer, out) == (code, "")
    assert message in " ".join(err.replace("│", " ").split())


@pytest.mark.slow
def test_real_clips_find_what_comparing_all_finds(shared_data, tmp_path, silent_progress):
    library = tmp_path / "library"
    for folder in ("bandai", "hdm05"):
        files = sorted((shared_data / folder).iterdir())
        for file in files[:: max(1, len(files) // 25)] + [*(shared_data / folder).glob("*.asf")]:
            (library / folder).mkdir(parents=True, exist_ok=True)
            shutil.copy(file, library / folder / file.name)
    url = str(tmp_path / "catalog")
    run(Job([str(library)], url, PipelineConfig()), silent_progress)
    with Catalog.open(url) as catalog:
        clip_ids, features = clip_ids_of(catalog), library_features(catalog)
        for clip_id in clip_ids[::7]:
            distances = compare_clips([example_of(catalog, clip_id).features], features.clips)
            ranked = distances.weighted[0].astype(np.float32)
            assert answered(catalog.similar(clip_id)) == nearest_by_sorting(ranked, clip_ids, 10, clip_id)
            assert answered(catalog.similar(library / clip_id)) == nearest_by_sorting(ranked, clip_ids, 10)


def test_of_few_frames_it_says_so(demo_library, demo_catalog, tmp_path, motionary):
    motion = read_motion(demo_library / "walk" / "walk_neutral_alex_01.bvh")
    write_bvh(motion.sampled(np.arange(0.0, 6.0)), tmp_path / "step.bvh")
    code, _, told = motionary("similar", demo_catalog, tmp_path / "step.bvh")
    assert code == 0
    assert "few to be known by; --within finds where in longer takes it occurs" in told
    whole = motionary("similar", demo_catalog, demo_library / "walk" / "walk_neutral_alex_01.bvh")[2]
    assert "few" not in whole


def test_an_unknown_metric_is_refused(catalog):
    with pytest.raises(CatalogError, match="no metric 'foo'; there are dtw, b_dtw, weighted, fuzzy"):
        catalog.similar(catalog.sample(1).clip_ids[0], metric="foo")
