"""A run by landmarks publishes the clusters that the pure functions make of the same distances."""

import shutil
from collections import Counter
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.distance import squareform

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.landmarks import approximation
from motionary.catalog.store import Store
from motionary.catalog.verify import verify
from motionary.catalog.views.overview import overview_page
from motionary.catalog.views.report.page import report_page
from motionary.pipeline.clustering.landmarks import cluster_by_landmarks
from motionary.pipeline.config import ClusterConfig, DistanceConfig, PipelineConfig
from motionary.pipeline.distances import pairwise_distances
from motionary.pipeline.stages.clip_frames import Measure, channels_of
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.stages.compare import thresholds_of
from motionary.pipeline.task import MAKES, run_task
from motionary.workflows.errors import UserError
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job, prepare

SAME = {
    "clips": "clip_id", "pairs": "clip_a, clip_b", "linkage": "method, metric, step",
    "partitions": "method, metric, clip_id", "cuts": "method, metric", "clusters": "clip_id",
    "references": "cluster_id", "alignments": "clip_id", "styles": "clip_id",
}  # fmt: skip


def config_of(
    landmarks: int | None = 15, tile: int = 8, thresholds: str = "midpoints", **clusters: object
) -> PipelineConfig:
    distances = DistanceConfig(pairs="landmarks", tile=tile, thresholds=thresholds)
    return PipelineConfig(clusters=ClusterConfig(landmarks=landmarks, **clusters), distances=distances)


ALL = PipelineConfig(distances=DistanceConfig(tile=8))


@pytest.fixture(scope="module")
def library(demo_library) -> list[str]:
    return [str(demo_library / action) for action in ("walk", "run", "squat")]


@pytest.fixture(scope="module")
def made(library, tmp_path_factory, silent_progress) -> str:
    url = str(tmp_path_factory.mktemp("landmarks") / "catalog")
    run(Job(library, url, config_of()), silent_progress)
    return url


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> str:
    """A folder for results, which runs to the groups alone share."""
    return str(tmp_path_factory.mktemp("stored") / "catalog")


def grouped(job: Job, done: list | None = None) -> tuple:
    """Run the waves that lead to the groups; returns the graph and the groups."""
    graph, store = prepare(job).graph, Store(job.catalog)
    for tasks in graph.waves(store.load):
        for task in tasks:
            report = run_task(task, store)
            if done is not None and report.computed:
                done.append(task)
    return graph, store.load(graph.grouped.key, "regrouped")


def rows(url: str, query: str) -> list:
    with Catalog.open(url) as catalog:
        return catalog.sql(query).to_pylist()


def reference(graph, store: Store, labels: list | None) -> list[int]:
    """The groups by `cluster_by_landmarks`, of all distances."""
    frames = {
        clip_id: matrix(part["feature"])
        for task in graph.resampled
        for clip_id, part in per_clip(store.load(task.key, "resampled")).items()
    }
    clip_ids = sorted(frames)
    thresholds = thresholds_of(graph.config.distances)
    found = pairwise_distances([frames[one] for one in clip_ids], n_jobs=1, thresholds=thresholds)
    clusters = graph.config.clusters
    square = np.stack([squareform(getattr(found, name)) for name in channels_of(clusters)])
    keys = [graph.contents[one] for one in clip_ids]
    exact = cluster_by_landmarks(
        keys, lambda a, b: square[:, a[:, None], b], clusters, labels, clusters.landmarks
    )
    return exact.labels.tolist()


@pytest.mark.parametrize("tile", [3, 8])
@pytest.mark.parametrize(
    ("landmarks", "clusters", "labelled"),
    [
        (10, {}, False),  # a share of another threshold than all
        (15, {}, True),
        (6, {"threshold": 0.4}, False),  # groups of more clips than landmarks
        (6, {"primary": "complete", "threshold": 0.15}, False),
        (12, {"primary": "fuzzy"}, False),
        (12, {"metric": "dtw", "primary": "average", "threshold": 0.2}, False),
        (12, {"n_clusters": 5}, False),
        (1, {}, False),
        (12, {"thresholds": "random", "threshold": 0.4}, False),
        (12, {"thresholds": "random", "primary": "fuzzy", "n_clusters": 12}, False),
    ],
)
def test_groups_are_those_of_the_pure_functions(library, stored, landmarks, clusters, labelled, tile):
    pattern = r"(?P<action>[a-z]+)_" if labelled else None
    job = Job(library, stored, config_of(landmarks, tile, **clusters), label_pattern=pattern)
    graph, groups = grouped(job)
    labels = [one.split("_")[0] for one in groups["clip_id"].to_pylist()] if labelled else None
    assert groups["group"].to_pylist() == reference(graph, Store(stored), labels)
    assert groups["clip_id"].to_pylist() == sorted(graph.layout.keys)
    assert sum(groups["landmark"].to_pylist()) == landmarks


def test_another_threshold_refines_anew(library, stored):
    for threshold in (0.4, 0.3, 0.4):
        job = Job(library, stored, config_of(6, threshold=threshold))
        graph, groups = grouped(job)
        assert groups["group"].to_pylist() == reference(graph, Store(stored), None)


def test_more_landmarks_refine_anew(library, stored):
    for landmarks in (2, 3, 4):
        job = Job(library, stored, config_of(landmarks, primary="complete", threshold=0.2))
        graph, groups = grouped(job)
        assert groups["group"].to_pylist() == reference(graph, Store(stored), None)


def test_refinement_finds_what_landmarks_missed(library, stored):
    _, groups = grouped(Job(library, stored, config_of(6, threshold=0.4)))
    of_landmarks = groups.filter(groups["landmark"])["group"].to_pylist()
    assert len(set(groups["group"].to_pylist())) > len(set(of_landmarks)) > 1


def test_tasks_are_announced_before_they_are_known(library, stored):
    graph, _ = grouped(Job(library, stored, config_of(6, threshold=0.4)))
    tasks = Counter(task.stage for wave in graph.waves(Store(stored).load) for task in wave)
    assert tasks == {stage: graph.tasks_by_stage()[stage] for stage in tasks}
    assert {*MAKES} - {*tasks} == {"represent", "align", "style", "name"}
    assert tasks["refine"] == 5


def test_blocks_of_distances_are_those_of_all_pairs():
    rng = np.random.default_rng(0)
    clips = [rng.normal(size=(6, 3)).astype(np.float32) for _ in range(150)]
    measure = Measure(("weighted", "dtw"), (0.5, 1.0))
    wanted = pairwise_distances(clips, n_jobs=1, thresholds=(0.5, 1.0))
    for channel, name in zip(measure.among(clips), measure.columns, strict=True):
        np.testing.assert_array_equal(channel, squareform(getattr(wanted, name)).astype(np.float32))
    assert (measure.between(clips[:140], clips) == measure.among(clips)[:, :140]).all()


def test_it_verifies_and_says_that_it_is_approximate(made, motionary):
    assert [check for check in verify(made) if not check.passed] == []
    with Catalog.open(made) as catalog:
        found = approximation(catalog)
        assert (len(found.landmarks), found.clips) == (15, 30)
        own = sum(size * (size - 1) // 2 for size in _sizes_before_refining(catalog))
        stand = catalog.store.read(catalog.files("standing"))["clip_id"].unique()
        assert found.compared == 15 * 14 // 2 + 15 * len(stand) + own
        assert catalog.runs.to_arrow()["pairs_computed"][-1].as_py() == found.compared
        for page in (overview_page(catalog), report_page(catalog)):
            assert str(found) in page
            assert "motionary reproduce landmarks" in page
        assert "those of its landmarks" in report_page(catalog)
        clip_id = catalog.clips.to_arrow()["clip_id"][5].as_py()
        assert not catalog.similar(clip_id, 4).from_pairs
        with pytest.raises(CatalogError, match="mutual proximity needs all pairs"):
            catalog.similar(clip_id, rank="mutual")
    code, out, _ = motionary("status", made)
    assert code == 0
    assert "clusters from 15 landmarks of 30 clips" in " ".join(out.split())


def _sizes_before_refining(catalog: Catalog) -> list[int]:
    return catalog.store.read(catalog.files("assigned"))["group"].value_counts().field("counts").to_pylist()


def test_verify_finds_a_landmark_without_its_row(made, tmp_path):
    shutil.copytree(made, tmp_path / "copy")
    with Catalog.open(made) as catalog:
        (file,) = catalog.files("partitions")
        landmark = approximation(catalog).landmarks[3]
    path = tmp_path / "copy" / file
    table = pq.read_table(path)
    pq.write_table(table.filter([one != landmark for one in table["clip_id"].to_pylist()]), path)
    failed = {check.name: check.detail for check in verify(str(tmp_path / "copy")) if not check.passed}
    assert f"{landmark} is either a landmark" in failed["partitions hold every clip once"]


@pytest.mark.parametrize(("tile", "workers"), [(3, 1), (20, 2)])
def test_tiles_and_workers_change_nothing(library, made, tile, workers, tmp_path, silent_progress):
    job = Job(library, str(tmp_path / "out"), config_of(tile=tile), workers=workers)
    run(job, silent_progress)
    for table, order in SAME.items():
        query = f'from "{table}" order by {order}'
        assert rows(job.catalog, query) == rows(made, query), table


def test_a_second_run_computes_nothing(library, made, tmp_path, silent_progress):
    shutil.copytree(made, tmp_path / "copy")
    again = run(Job(library, str(tmp_path / "copy"), config_of()), silent_progress)
    assert (again.computed, again.plan.to_compare) == (0, 0)
    assert [check for check in verify(str(tmp_path / "copy")) if not check.passed] == []


def test_another_clip_leaves_the_other_batches_assigned(demo_library, tmp_path):
    folder = tmp_path / "library"
    shutil.copytree(demo_library / "walk", folder)
    job = Job([str(folder)], str(tmp_path / "out"), config_of(5, tile=4, threshold=0.3))
    before, _ = grouped(job)
    for file in sorted((demo_library / "run").iterdir()):
        new = folder / file.name
        shutil.copy(file, new)
        if [one.clip_id for one in prepare(job).graph.landmarks] == [one.clip_id for one in before.landmarks]:
            break
        new.unlink()
    computed: list = []
    after, groups = grouped(job, computed)
    stages = [task.stage for task in computed]
    assert len(groups) == 11
    assert stages.count("ingest") == stages.count("assign") == 1 < len(after.ingested)
    assert not {"sample", "compare"} & {*stages}


def test_a_landmark_that_changes_is_compared_anew(demo_library, tmp_path):
    folder = tmp_path / "library"
    shutil.copytree(demo_library / "walk", folder)
    job = Job([str(folder)], str(tmp_path / "out"), config_of(9, tile=4, threshold=0.3))
    before, _ = grouped(job)
    landmarks = [one.clip_id for one in before.landmarks]
    for file in sorted((demo_library / "squat").iterdir()):
        shutil.copy(file, folder / landmarks[0])
        if [one.clip_id for one in prepare(job).graph.landmarks] == landmarks:
            break
    after, groups = grouped(job)
    assert [one.clip_id for one in after.landmarks] == landmarks
    assert groups["group"].to_pylist() == reference(after, Store(job.catalog), None)


def test_a_catalog_goes_from_one_route_to_another(library, tmp_path, silent_progress):
    whole = Job(library[:2], str(tmp_path / "out"), ALL)
    few = replace(whole, config=config_of(9))
    snapshots = []
    for job in (whole, few, whole, few):
        result = run(job, silent_progress)
        assert [check for check in verify(job.catalog) if not check.passed] == []
        snapshots.append([len(result.catalog.pairs), len(result.catalog.clusters)])
    assert snapshots == [[190, 20], [36, 20]] * 2
    assert "are of the landmarks" not in overview_page(Catalog.open(whole.catalog, 3))
    again = run(few, silent_progress)
    assert again.computed == 0


def test_a_landmark_that_cannot_be_read_drops_out(demo_library, tmp_path, silent_progress):
    folder = tmp_path / "library"
    shutil.copytree(demo_library / "walk", folder)
    job = Job([str(folder)], str(tmp_path / "out"), config_of(6, tile=4))
    for number in range(20):
        (folder / "broken.bvh").write_text(f"HIERARCHY {number}")
        if "broken.bvh" in [clip.clip_id for clip in prepare(job).graph.landmarks]:
            break
    catalog = run(job, silent_progress).catalog
    assert catalog.quarantine.to_arrow()["path"].to_pylist() == ["broken.bvh"]
    assert len(approximation(catalog).landmarks) == 5
    assert [check for check in verify(job.catalog) if not check.passed] == []


@pytest.mark.parametrize(
    ("landmarks", "clusters", "said"),
    [
        (2, {}, "of 2 landmarks none can be read, and of the other clips 2; take more landmarks"),
        (3, {"n_clusters": 2}, "2 clusters are asked for, and of the clips to cluster 1 can be read"),
    ],
)
def test_too_few_landmarks_that_can_be_read_are_told(
    demo_library, tmp_path, silent_progress, landmarks, clusters, said
):
    folder = tmp_path / "library"
    folder.mkdir()
    for file in sorted((demo_library / "walk").iterdir())[2:4]:
        shutil.copy(file, folder)
    job = Job([str(folder)], str(tmp_path / "out"), config_of(landmarks, **clusters))
    broken = {"x.bvh", "y.bvh"}
    for number in range(100):
        for name in broken:
            (folder / name).write_text(f"HIERARCHY {number} {name}")
        if broken <= {clip.clip_id for clip in prepare(job).graph.landmarks}:
            break
    with pytest.raises(UserError, match=said):
        run(job, silent_progress)
    assert not (tmp_path / "out" / "CURRENT").exists()


def test_clips_that_are_read_again_leave_the_landmarks_as_they_were(demo_library, tmp_path, silent_progress):
    folder = tmp_path / "library"
    shutil.copytree(demo_library / "walk", folder)
    for number in range(6):
        (folder / f"gone-{number}.bvh").symlink_to(tmp_path / f"nothing-{number}")
    job = Job([str(folder)], str(tmp_path / "out"), config_of(8, n_clusters=2))
    found = []
    for _ in range(4):
        catalog = run(job, silent_progress).catalog
        found.append((approximation(catalog).landmarks, catalog.clusters.to_arrow().to_pylist()))
    assert found == [found[0]] * 4


def test_nothing_that_can_be_read_is_a_catalog_too(tmp_path, silent_progress):
    folder = tmp_path / "library"
    folder.mkdir()
    for number in range(3):
        (folder / f"{number}.bvh").write_text(f"HIERARCHY {number}")
    job = Job([str(folder)], str(tmp_path / "out"), config_of(2))
    assert len(run(job, silent_progress).catalog.clips) == 0
    assert [check for check in verify(job.catalog) if not check.passed] == []


@pytest.mark.parametrize("landmarks", [20, None])
def test_as_many_landmarks_as_clips_are_all_pairs(library, tmp_path, silent_progress, landmarks):
    said: list[str] = []
    job = Job(library[:2], str(tmp_path / "out"), config_of(landmarks))
    graph = prepare(job).graph
    assert graph.config == ALL
    if landmarks:
        run(replace(job, libraries=library[:1]), silent_progress, remark=said.append)
        assert said == ["compares all pairs: of 10 clips, landmarks would be all"]


def test_more_clusters_than_landmarks_are_refused(library, tmp_path):
    with pytest.raises(UserError, match="6 clusters are asked for of 5 landmarks"):
        prepare(Job(library, str(tmp_path / "out"), config_of(5, n_clusters=6)))


def test_landmarks_are_counted_only_where_they_are_asked_for():
    with pytest.raises(ValueError, match="set that to 'landmarks'"):
        PipelineConfig(clusters=ClusterConfig(landmarks=5))
    with pytest.raises(ValueError, match="landmarks is 0"):
        ClusterConfig(landmarks=0)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--landmarks", "many"), "give a number from 1, or auto"),
        (("--landmarks", "9", "--prune"), "not both"),
    ],
)
def test_the_command_line_says_what_landmarks_are(motionary, demo_library, tmp_path, options, said):
    code, _, err = motionary("run", demo_library, tmp_path / "out", *options)
    assert code == 2
    assert said in " ".join(err.replace("│", " ").split())


def test_the_command_line_plans_landmarks(motionary, demo_library, tmp_path):
    options = (demo_library, tmp_path / "out", "--landmarks", 10, "--dry-run")
    code, out, _ = motionary("run", *options)
    assert code == 0
    assert f"{10 * 9 // 2 + 80 * 10 // 2} pairs to compare" in out
