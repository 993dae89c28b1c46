"""A run that leaves far pairs out publishes the clusters of one that does not."""

from dataclasses import replace

import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.verify import verify
from motionary.catalog.views.overview import overview_page
from motionary.catalog.views.report.page import report_page
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.stages import compare
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job
from motionary.workflows.reproduce.assign import study_assign
from motionary.workflows.reproduce.mutual import study_mutual

MU = 0.25


def config_of(pairs: str, mu: float = MU, tile: int = 8) -> PipelineConfig:
    clusters = ClusterConfig(primary="complete", threshold=mu)
    return PipelineConfig(clusters=clusters, distances=DistanceConfig(pairs=pairs, tile=tile))


@pytest.fixture(scope="module")
def library(demo_library) -> list[str]:
    return [str(demo_library / action) for action in ("walk", "run", "squat")]


@pytest.fixture(scope="module")
def pruned(library, tmp_path_factory, silent_progress) -> str:
    url = str(tmp_path_factory.mktemp("pruned") / "catalog")
    run(Job(library, url, config_of("pruned")), silent_progress)
    return url


@pytest.fixture(scope="module")
def whole(library, tmp_path_factory, silent_progress) -> str:
    url = str(tmp_path_factory.mktemp("whole") / "catalog")
    run(Job(library, url, config_of("all")), silent_progress)
    return url


def rows(url: str, query: str) -> list:
    with Catalog.open(url) as catalog:
        return catalog.sql(query).to_pylist()


def test_clusters_references_and_alignments_are_those_of_all_pairs(pruned, whole):
    for table in ("clusters", '"references"', "alignments", "styles"):
        query = f"select * from {table} order by clip_id"
        assert rows(pruned, query) == rows(whole, query)
    assert len(rows(pruned, 'select * from "references"')) > 3


def test_the_pairs_are_those_of_at_most_mu_with_the_same_values(pruned, whole):
    query = "select * from pairs where weighted <= 0.25 order by clip_a, clip_b"
    assert rows(pruned, query) == rows(whole, query)
    assert 0 < len(rows(pruned, "select clip_a from pairs")) == len(rows(pruned, query))
    assert len(rows(pruned, query)) < len(rows(whole, "select clip_a from pairs"))


def test_other_partitions_are_absent_and_the_pages_say_so(pruned):
    assert rows(pruned, "select distinct method, metric from partitions") == [
        {"method": "complete", "metric": "weighted"}
    ]
    assert rows(pruned, "select * from linkage") == []
    with Catalog.open(pruned) as catalog:
        for page in (overview_page(catalog), report_page(catalog)):
            assert "are not known" in page
            assert "needs two clips" not in page


def test_the_summary_says_that_pairs_were_left_out(pruned, motionary):
    code, out, _ = motionary("status", pruned)
    kept = len(rows(pruned, "select clip_a from pairs"))
    assert code == 0
    assert f"Pruned: {kept} of 435 pairs are at most 0.25 apart" in " ".join(out.split())


def test_it_verifies_and_answers(pruned, whole):
    assert [check for check in verify(pruned) if not check.passed] == []
    with Catalog.open(pruned) as some, Catalog.open(whole) as every:
        clip_id = some.clips.to_arrow()["clip_id"][5].as_py()
        found, wanted = some.similar(clip_id, 4), every.similar(clip_id, 4)
        assert not found.from_pairs
        assert found.table["clip_id"] == wanted.table["clip_id"]
        with pytest.raises(CatalogError, match="mutual proximity needs all pairs"):
            some.similar(clip_id, rank="mutual")


@pytest.mark.parametrize("study", [study_assign, study_mutual])
def test_experiments_on_all_distances_are_refused(pruned, study, silent_progress):
    with Catalog.open(pruned) as some, pytest.raises(CatalogError, match="needs all pairs"):
        study(some, "action", 1, 0, silent_progress)


def test_more_clips_compare_themselves_alone_and_end_like_a_fresh_run(
    library, tmp_path, silent_progress, monkeypatch
):
    first = Job(library[:2], str(tmp_path / "grown"), config_of("pruned"))
    run(first, silent_progress)
    compared: list[int] = []
    between, among = compare._compare, compare._among

    def counted_between(values, rows, columns, *rest):
        compared.append(len(rows) * len(columns))
        between(values, rows, columns, *rest)

    def counted_among(values, some, *rest):
        compared.append(len(some) * (len(some) - 1) // 2)
        among(values, some, *rest)

    monkeypatch.setattr(compare, "_compare", counted_between)
    monkeypatch.setattr(compare, "_among", counted_among)
    grown = run(replace(first, libraries=library), silent_progress)
    assert sum(compared) == 10 * 20 + 10 * 9 // 2
    fresh = run(replace(first, libraries=library, catalog=str(tmp_path / "fresh")), silent_progress)
    query = "from pairs order by clip_a, clip_b"
    assert grown.catalog.sql(query) == fresh.catalog.sql(query)


@pytest.mark.parametrize("tile", [3, 30])
def test_tiles_change_nothing(library, pruned, tile, tmp_path, silent_progress):
    result = run(Job(library, str(tmp_path / "out"), config_of("pruned", tile=tile)), silent_progress)
    for query in ("from pairs order by clip_a, clip_b", "from clusters order by clip_id"):
        assert result.catalog.sql(query).to_pylist() == rows(pruned, query)


@pytest.mark.parametrize(
    "clusters",
    [ClusterConfig(), ClusterConfig(threshold=0.2), ClusterConfig(primary="complete")],
)
def test_pruning_needs_complete_linkage_cut_at_a_threshold(clusters):
    with pytest.raises(ValueError, match="set the three, or compare all pairs"):
        PipelineConfig(clusters=clusters, distances=DistanceConfig(pairs="pruned"))


def test_the_command_line_says_what_pruning_needs(motionary, demo_library, tmp_path):
    code, _, said = motionary("run", demo_library, tmp_path / "out", "--prune")
    assert code == 1
    assert "complete linkage on the weighted distance is cut at a threshold" in said
    assert not (tmp_path / "out").exists()
