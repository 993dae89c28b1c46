"""Clips chosen by what is known of them, read as tables and as streams of motions."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.description import _counts
from motionary.catalog.views.notebook import facts_html, table_html
from motionary.pipeline.config import PipelineConfig


@pytest.fixture
def catalog(demo_catalog):
    with Catalog.open(demo_catalog) as opened:
        yield opened


def by_hand(catalog, keep):
    """Choose clips by a plain loop over the tables' rows."""
    clusters = {row["clip_id"]: row for row in catalog.clusters.to_arrow().to_pylist()}
    rows = [row | clusters[row["clip_id"]] for row in catalog.clips.to_arrow().to_pylist()]
    return sorted(row["clip_id"] for row in rows if keep(row))


def test_filters_are_a_loop_over_the_rows(catalog):
    for chosen, keep in [
        (catalog.filter(label="walk"), lambda row: row["label"] == "walk"),
        (catalog.filter(style="tired"), lambda row: row["style"] == "tired"),
        (catalog.filter(style=["tired", "proud"]), lambda row: row["style"] in ("tired", "proud")),
        (catalog.filter(cluster_id={1, 2}), lambda row: row["cluster_id"] in (1, 2)),
        (catalog.filter(licence=None), lambda row: row["licence"] is None),
        (catalog.filter(licence=["mine", None]), lambda row: row["licence"] in ("mine", None)),
        (catalog.filter(is_reference=True), lambda row: row["is_reference"]),
        (catalog.filter(min_seconds=2), lambda row: row["seconds"] >= 2),
        (
            catalog.filter(label="walk", style="tired", max_seconds=3),
            lambda row: row["label"] == "walk" and row["style"] == "tired" and row["seconds"] <= 3,
        ),
        (catalog.filter(), lambda row: True),
    ]:
        assert chosen.clip_ids == by_hand(catalog, keep)


def test_bounds_are_included(catalog):
    longest = max(catalog.clips.to_arrow()["seconds"].to_pylist())
    assert len(catalog.filter(min_seconds=longest)) >= 1
    assert len(catalog.filter(max_seconds=longest)) == len(catalog.clips)


def test_selections_narrow(catalog):
    walks = catalog.filter(label="walk")
    tired = walks.where("style = ?", ["tired"])
    assert set(tired.clip_ids) < set(walks.clip_ids)
    assert tired.clip_ids == walks.filter(style="tired").clip_ids
    assert tired.to_arrow()["clip_id"].to_pylist() == tired.clip_ids
    assert set(tired.to_pandas()["style"]) == {"tired"}


@pytest.mark.parametrize(("name", "meant"), [("stile", "style"), ("lable", "label")])
def test_an_unknown_column_is_named_with_the_nearest(catalog, name, meant):
    with pytest.raises(CatalogError, match=f"no column '{name}'; did you mean {meant}"):
        catalog.filter(**{name: "tired"})


@pytest.mark.parametrize("condition", ["style = tired", "style =", "true; drop view takes", ""])
def test_what_is_no_condition_is_refused(catalog, condition):
    with pytest.raises(CatalogError, match="cannot be answered|select"):
        catalog.where(condition)


def test_a_value_is_never_sql(catalog):
    assert len(catalog.filter(style="tired' or 'a' = 'a")) == 0


@given(n=st.integers(0, 100), seed=st.integers(0, 5))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=20)
def test_samples(catalog, n, seed):
    drawn = catalog.sample(n, seed)
    assert len(drawn) == len(set(drawn.clip_ids)) == min(n, len(catalog.clips))
    assert drawn.clip_ids == sorted(drawn.clip_ids) == catalog.sample(n, seed).clip_ids
    with pytest.raises(ValueError, match="n is -1"):
        drawn.sample(-1)


def test_other_seeds_draw_others(catalog):
    assert len({tuple(catalog.sample(5, seed).clip_ids) for seed in range(10)}) > 1


@pytest.mark.parametrize("aligned", [False, True])
def test_motions_stream_as_they_are_one_by_one(catalog, aligned):
    chosen = catalog.sample(7)
    streamed = {motion.name: motion for motion in chosen.motions(aligned)}
    assert sorted(streamed) == chosen.clip_ids
    table = catalog.aligned_frames if aligned else catalog.frames
    rows = table.to_pandas()
    rated, column = (catalog.alignments, "frame_rate") if aligned else (catalog.clips, "fps")
    rate_of = rated.to_pandas().set_index("clip_id")[column]
    for clip_id, motion in streamed.items():
        own = rows[rows["clip_id"] == clip_id].sort_values("frame")
        np.testing.assert_array_equal(motion.root_position, np.stack(own["root_position"]))
        alone = catalog.aligned(clip_id) if aligned else catalog.motion(clip_id)
        np.testing.assert_array_equal(motion.rotations, alone.rotations)
        assert motion.fps == alone.fps == rate_of[clip_id]


@pytest.mark.parametrize(("merged", "table"), [(False, "features"), (True, "resampled")])
def test_features_stream(catalog, merged, table):
    chosen = catalog.sample(5)
    rows = getattr(catalog, table).to_pandas()
    for clip_id, values in chosen.features(merged):
        own = rows[rows["clip_id"] == clip_id].sort_values("frame")
        np.testing.assert_array_equal(values, np.stack(own["feature"]))
    assert sorted(clip_id for clip_id, _ in chosen.features(merged)) == chosen.clip_ids


def test_a_stream_holds_one_part_at_a_time_and_opens_no_other(catalog, monkeypatch):
    opened, read = [], pq.read_table
    chosen = catalog.everything()
    catalog.motion(chosen.clip_ids[0])

    def read_table(path, **options):
        if "/tables/frames/" in path:
            opened.append(path)
        return read(path, **options)

    monkeypatch.setattr(pq, "read_table", read_table)
    stream = chosen.motions()
    next(stream)
    assert len(opened) == 1
    assert sum(1 for _ in stream) == len(catalog.clips) - 1
    assert sorted(opened) == sorted(map(catalog.store.path, catalog.files("frames")))
    opened.clear()
    catalog.motion(catalog.sample(1).clip_ids[0])
    assert len(opened) == 1


def test_takes_are_clips_with_their_clusters(catalog):
    takes = catalog.sql("from takes").to_pandas().set_index("clip_id")
    assert set(takes.columns) == (
        set(catalog.clips.to_arrow().column_names) | set(catalog.clusters.to_arrow().column_names)
    ) - {"clip_id", "skeleton"}
    clusters = catalog.clusters.to_pandas().set_index("clip_id")
    assert (takes["label"] == clusters["label"].reindex(takes.index)).all()


def test_a_catalog_answers_many_threads_and_again_after_it_was_closed(demo_catalog):
    with Catalog.open(demo_catalog) as catalog, ThreadPoolExecutor(8) as threads:
        query = "select count(*) n from takes join frames using (clip_id) where cluster_id = ?"
        counts = list(threads.map(lambda one: catalog.sql(query, [one % 4 + 1])["n"][0].as_py(), range(64)))
    assert counts == counts[:4] * 16
    assert catalog.sql("select count(*) n from clips")["n"].to_pylist() == [len(catalog.clips)]
    catalog.close()


def test_what_is_kept_is_made_once_until_the_catalog_is_closed(demo_catalog):
    made = []
    catalog = Catalog.open(demo_catalog)
    for _ in range(2):
        assert catalog.keep("answer", lambda: made.append(1) or 42) == 42
    catalog.close()
    catalog.keep("answer", lambda: made.append(2))
    assert made == [1, 2]


def test_config_is_that_of_the_run(catalog):
    assert catalog.config == PipelineConfig()


def test_the_description_counts(catalog):
    found = catalog.describe()
    labels = catalog.clusters.to_pandas()["label"]
    assert (found.clips, found.clusters, found.quarantined) == (80, len(catalog.references), 0)
    assert found.names == labels.value_counts().to_dict()
    assert [*found.names.values()] == sorted(found.names.values(), reverse=True)
    assert found.columns["style"] == 5
    assert sum(found.formats.values()) == sum(found.conventions.values()) == 80
    assert found.seconds == pytest.approx(catalog.clips.to_pandas()["seconds"].sum())
    assert "80, " in repr(found)


def test_counts_begin_with_the_most_frequent_and_go_on_by_name(catalog):
    found = replace(catalog.describe(), names=_counts(pa.chunked_array([["b", None, "c", "a", "c"]])))
    assert [*found.names.items()] == [("c", 2), ("a", 1), ("b", 1)]
    assert "c 2, a 1, b 1" in repr(found)


def test_a_notebook_shows_what_a_table_holds(catalog):
    walks = catalog.filter(label="walk")
    page = walks._repr_html_()
    assert walks.clip_ids[0] in page
    assert page.count("<tr") == min(12, len(walks)) + 1
    assert "skeleton" in catalog.clips._repr_html_().split("not shown: ")[1]
    assert "80" in catalog._repr_html_()


def test_text_is_shown_and_not_run(catalog):
    mean = "<script>alert(1)</script>"
    for page in (table_html(mean, pa.table({mean: [mean]})), facts_html([(mean, mean)])):
        assert "<script" not in page
