"""What a person is asked to look at first."""

import json
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from itertools import combinations
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog import review as review_module
from motionary.catalog.review import REVIEW, review
from motionary.catalog.snapshot import Snapshot
from motionary.catalog.store import Store
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.stages.name import name
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.relabel import relabel
from tests.catalogs import copied
from tests.web.serving import with_mistakes


@pytest.fixture
def line(tmp_path):
    """Catalogs whose clips lie on a line: their distances are those of places; clusters have a reference."""

    def made(clips: dict[str, tuple], gone: dict[str, tuple[str, str]] | None = None) -> Catalog:
        """Each clip: place, cluster, own label or None, "supplied" and so on, digest; gone: digest, label."""
        place, cluster, label, source, digest = zip(*clips.values(), strict=True)
        ids = [*clips]
        pairs = [(a, b, abs(clips[a][0] - clips[b][0])) for a, b in combinations(sorted(ids), 2)]
        confidence = [{"propagated": 0.5, "unassigned": 0.0}.get(one, 1.0) for one in source]
        first = {one: ids[cluster.index(one)] for one in cluster}
        own = {
            one: [
                said
                for said, c, s in zip(label, cluster, source, strict=True)
                if c == one and s != "unassigned"
            ]
            for one in first
        }
        called = [max(sorted(set(own[one])), key=own[one].count) if own[one] else None for one in first]
        said = [
            (one, digest, label)
            for one, (_, _, label, source, digest) in clips.items()
            if source == "override"
        ]
        said += [(one, *rest) for one, rest in (gone or {}).items()]
        tables = {
            "clips": {"clip_id": ids, "digest": digest},
            "inputs": {"clip_id": ids, "digest": digest},
            "pairs": dict(zip(("clip_a", "clip_b", "dtw"), zip(*pairs, strict=True), strict=True)),
            "labels": {
                key: pa.array([row[place] for row in said], pa.string())
                for place, key in enumerate(("clip_id", "digest", "label"))
            },
            "clusters": {
                "clip_id": ids, "cluster_id": cluster, "label": pa.array(label, pa.string()),
                "label_source": source, "confidence": confidence,
                "is_reference": [first[one] == clip for clip, one in zip(ids, cluster, strict=True)],
                "distance_to_reference": [
                    abs(here - clips[first[one]][0]) for here, one in zip(place, cluster, strict=True)
                ],
            },
            "references": {
                "cluster_id": [*first], "clip_id": [*first.values()], "label": pa.array(called, pa.string()),
                "size": [cluster.count(one) for one in first],
            },
            "runs": {"settings": [json.dumps({"clusters": {"metric": "dtw"}, "distances": {}})]},
        }  # fmt: skip
        files = {}
        for table, columns in tables.items():
            files[table] = [f"tables/{table}/1.parquet"]
            (tmp_path / "tables" / table).mkdir(parents=True, exist_ok=True)
            pq.write_table(pa.table(columns), tmp_path / files[table][0])
        return Catalog(Store(str(tmp_path)), Snapshot("000001", "", files))

    return made


def supplied(place: float, cluster: int, label: str, digest: str = "") -> tuple:
    return (place, cluster, label, "supplied", digest or str(place))


def by_person(*clip) -> tuple:
    return (*supplied(*clip)[:3], "override", supplied(*clip)[4])


def asked(catalog: Catalog, *columns: str, **options) -> list[tuple]:
    found = review(catalog, **options)
    assert found.schema.equals(REVIEW)
    assert found["label"].null_count == len(found)
    return [*zip(*(found[one].to_pylist() for one in columns), strict=True)]


def test_a_catalog_without_doubts(line):
    clips = {"a": supplied(0, 1, "walk"), "b": supplied(1, 1, "walk"), "c": supplied(9, 2, "run"),
             "d": supplied(10, 2, "run")}  # fmt: skip
    assert asked(line(clips), "clip_id") == []


def test_a_label_that_its_neighbours_contradict(line):
    # e says run among walks: its nearest run is 7 away, its nearest walk 1; f says walk and is nearer to one.
    clips = {
        "a": supplied(0, 1, "walk"), "b": supplied(1, 1, "walk"), "e": supplied(2, 1, "run"),
        "c": supplied(9, 2, "run"), "d": supplied(10, 2, "run"), "g": supplied(12, 2, "run"),
        "f": supplied(5, 2, "walk"),
    }  # fmt: skip
    columns = ("clip_id", "reason", "current", "suggested", "cluster_id", "other", "distance")
    assert asked(line(clips), *columns) == [
        ("e", "mislabelled", "run", "walk", 1, "b", 1),
        ("f", "mislabelled", "walk", "run", 2, "e", 3),
    ]
    urgency = [one for (one,) in asked(line(clips), "urgency")]
    assert urgency == pytest.approx([7 / 8, 4 / 7])


def test_a_label_that_nobody_shares_is_likely_a_slip(line):
    clips = {"a": supplied(0, 1, "walk"), "b": supplied(1, 1, "walk"), "c": supplied(2, 1, "wlak")}
    assert asked(line(clips), "clip_id", "urgency") == [("c", 1.0)]


def test_who_was_labelled_by_a_person_is_not_asked_about(line):
    clips = {"a": supplied(0, 1, "walk"), "b": supplied(1, 1, "walk"), "c": by_person(2, 1, "run")}
    assert asked(line(clips), "clip_id") == []


def test_names_that_are_missing_or_uncertain(line):
    clips = {
        "a": supplied(0, 1, "walk"), "b": (1, 1, "walk", "propagated", "b"),
        "c": (9, 1, None, "unassigned", "c"), "d": (20, 2, None, "unassigned", "d"),
        "e": (22, 2, None, "unassigned", "e"),
        "f": (40, 3, None, "unassigned", "f"),
    }  # fmt: skip
    listed = asked(line(clips), "clip_id", "reason", "urgency", "suggested", "other", "distance")
    assert listed == [
        ("b", "uncertain", 0.5, "walk", "a", 1),
        ("e", "unassigned", 0.5, None, "d", 2),  # from here a name would reach d
        ("f", "unassigned", 0.5, None, None, None),
        ("c", "unassigned", 0.5, "walk", "a", 9),
        ("d", "unassigned", 0.5, None, None, None),
    ]
    assert "b" not in [one for (one,) in asked(line(clips), "clip_id", confidence=0.5)]


def test_the_same_motion_under_two_names(line):
    clips = {
        "a": supplied(0, 1, "walk", "same"), "b": supplied(0, 1, "walk", "same"), "c": supplied(5, 1, "walk"),
        "d": supplied(5.001, 1, "walk"), "e": supplied(8, 1, "walk"), "f": supplied(11, 1, "walk"),
    }  # fmt: skip
    columns = ("clip_id", "reason", "urgency", "other", "duplicate_of")
    assert asked(line(clips), *columns) == [
        ("b", "duplicate", 0, "a", "a"),
        ("d", "duplicate", 0, "c", "c"),
    ]
    assert asked(line(clips), "clip_id", near=0) == [("b",)]
    seen = clips | {"b": by_person(0, 1, "walk", "same"), "d": by_person(5.001, 1, "walk")}
    assert asked(line(seen), *columns) == []


def test_a_duplicate_is_told_beside_another_reason(line):
    clips = {
        "a": supplied(0, 1, "walk", "s"),
        "b": (0, 1, None, "unassigned", "s"),
        "c": supplied(3, 1, "walk"),
    }
    assert asked(line(clips), "clip_id", "reason", "duplicate_of") == [("b", "unassigned", "a")]


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (supplied, supplied, ["a", "b"]),
        (by_person, supplied, ["b"]),
        (by_person, by_person, ["a", "b"]),  # a person said both: one cannot be
    ],
)
def test_the_same_bytes_with_two_labels(line, first, second, expected):
    clips = {
        "a": first(0, 1, "walk", "same"), "b": second(0, 1, "stroll", "same"), "c": supplied(4, 1, "walk"),
        "d": supplied(7, 1, "walk"), "e": supplied(20, 2, "stroll"), "f": supplied(24, 2, "stroll"),
    }  # fmt: skip
    assert asked(line(clips), "clip_id", "reason", "urgency") == [
        (one, "contradiction", 1.0) for one in expected
    ]


def test_labels_that_people_gave_to_similar_clips_stand(line):
    clips = {"a": by_person(0, 1, "walk"), "b": by_person(0.001, 1, "stroll"), "c": supplied(4, 1, "walk"),
             "d": supplied(7, 1, "walk")}  # fmt: skip
    assert asked(line(clips), "clip_id") == []


def test_copies_of_a_labelled_file_that_is_gone(line):
    clips = {"a": supplied(0, 1, "walk", "x"), "b": supplied(0, 1, "walk", "x"), "c": supplied(4, 1, "walk"),
             "d": supplied(7, 1, "walk")}  # fmt: skip
    listed = asked(line(clips, {"z": ("x", "trudge")}), "clip_id", "reason", "suggested", "other")
    assert listed == [("a", "moved", "trudge", "z"), ("b", "moved", "trudge", "z")]
    clips["a"] = by_person(0, 1, "walk", "x")
    assert asked(line(clips, {"z": ("x", "trudge")}), "clip_id", "reason") == [("b", "moved")]
    clips["c"] = (4, 1, "walk", "supplied", "")  # bytes that cannot be read are like no others
    assert asked(line(clips, {"z": ("", "trudge")}), "clip_id", "reason") == [("b", "duplicate")]


def test_an_older_catalog_is_told_to_be_run_again(line):
    catalog = line({"a": supplied(0, 1, "walk"), "b": supplied(1, 1, "walk")})
    older = replace(
        catalog.snapshot, tables={k: v for k, v in catalog.snapshot.tables.items() if k != "labels"}
    )
    with pytest.raises(CatalogError, match="older motionary published it"):
        review(Catalog(catalog.store, older))


def test_distances_that_no_pair_holds_are_computed(
    demo_library, demo_catalog, tmp_path, silent_progress, monkeypatch
):
    with Catalog.open(with_mistakes(demo_library, demo_catalog, tmp_path, silent_progress)) as catalog:
        stored = review(catalog)
        monkeypatch.setattr(review_module, "route_of", lambda catalog: "landmarks")
        assert review(catalog).equals(stored)
    assert stored["reason"].to_pylist().count("mislabelled") >= 6


def test_by_landmarks_every_doubtful_name_is_listed(demo_library, tmp_path, silent_progress, motionary):
    config = PipelineConfig(
        clusters=ClusterConfig(n_clusters=4, landmarks=12), distances=DistanceConfig(pairs="landmarks")
    )
    job = Job([str(demo_library)], str(tmp_path / "catalog"), config, demo_library / "labels.csv")
    run(job, silent_progress)
    with Catalog.open(tmp_path / "catalog") as catalog:
        doubtful = catalog.sql(
            """select c.clip_id from clusters c join "references" r using (cluster_id)
            where c.label <> r.label order by 1"""
        )
        listed = review(catalog)
    mislabelled = listed.filter(pc.equal(listed["reason"], "mislabelled"))
    assert sorted(mislabelled["clip_id"].to_pylist()) == doubtful["clip_id"].to_pylist()
    assert len(mislabelled) > 12
    assert "among the 12 landmarks alone" in motionary("label", "review", tmp_path / "catalog")[2]


def test_planted_mistakes_come_first(demo_catalog, tmp_path):
    # Eight labels of eighty are exchanged for others: of the first eight of the list, how many are those?
    catalog = Catalog.open(copied(demo_catalog, tmp_path))
    store, tables = catalog.store, catalog.snapshot.tables
    clips = catalog.clips.to_arrow()
    actions = clips["action"].to_pylist()
    represented, centres = (store.read(tables[one]) for one in ("represented", "centres"))
    overrides = catalog.labels.to_arrow()
    listed, found = 0, 0
    for seed in range(10):
        generator = np.random.default_rng(seed)
        wrong = list(actions)
        planted = generator.choice(len(wrong), 8, replace=False)
        for one in planted:
            wrong[one] = generator.choice(sorted(set(actions) - {actions[one]}))
        place = clips.column_names.index("action")
        relabelled = clips.set_column(place, clips.schema.field("action"), pa.array(wrong))
        named = name(relabelled, represented, centres, overrides, ClusterConfig())
        store.save("planted", {"clips": relabelled, **named})
        changed = {one: [store.part_name(one, "planted")] for one in ("clips", *named)}
        first = asked(Catalog(store, replace(catalog.snapshot, tables=dict(tables) | changed)), "clip_id")
        mistakes = {(clips["clip_id"][int(one)].as_py(),) for one in planted}
        listed += len(mistakes & {*first})
        found += len(mistakes & {*first[:8]})
    print(f"of 80 planted mistakes {listed} are listed, {found} among as many first rows as were planted")
    assert found >= 72


@pytest.fixture
def copies(demo_library, tmp_path) -> Path:
    """Six walks, and three copies: the same bytes, numbers of two digits, a frame cut off."""
    library = tmp_path / "copies"
    library.mkdir()
    files = sorted((demo_library / "walk").glob("*.bvh"))[:6]
    for file in files:
        shutil.copy(file, library)
    text = files[0].read_text().splitlines()
    motion = text.index("MOTION")
    frames = text[motion + 3 :]
    rounded = [" ".join(f"{float(value):.2f}" for value in frame.split()) for frame in frames]
    (library / "z_same.bvh").write_bytes(files[0].read_bytes())
    (library / "z_rounded.bvh").write_text("\n".join([*text[: motion + 3], *rounded]))
    (library / "z_cut.bvh").write_text(
        "\n".join([*text[: motion + 1], f"Frames: {len(frames) - 1}", text[motion + 2], *frames[:-1]])
    )
    return library


def test_copies_of_a_take_are_found_by_their_motion(copies, tmp_path, silent_progress):
    config = PipelineConfig(clusters=ClusterConfig(n_clusters=1), distances=DistanceConfig(tile=4))
    first = sorted(copies.iterdir())[0].name
    catalog = run(Job([str(copies)], str(tmp_path / "out"), config), silent_progress).catalog
    found = dict(asked(catalog, "clip_id", "duplicate_of"))
    assert {clip for clip, of in found.items() if of} == {"z_cut.bvh", "z_rounded.bvh", "z_same.bvh"}
    assert found["z_same.bvh"] in (first, "z_rounded.bvh")

    furthest = asked(catalog, "clip_id")[0][0]
    named = relabel(catalog.store.url, {furthest: "walk"}, "ada")
    assert set(named.clusters.to_arrow()["label"].to_pylist()) == {"walk"}

    everything = dict.fromkeys(found, "walk") | {"z_same.bvh": "stroll"}
    named = relabel(catalog.store.url, everything | {first: "walk"}, "ada")
    assert asked(named, "clip_id", "reason") == [(first, "contradiction"), ("z_same.bvh", "contradiction")]
    assert named.labels.to_arrow()["set_at"][0].as_py() <= datetime.now(UTC)
