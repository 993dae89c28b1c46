"""A run on a library that changed does what the change asks for, and ends where a fresh run would."""

import os
import random
import shutil
from collections import Counter
from pathlib import Path

import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.schema import PUBLISHED
from motionary.catalog.verify import verify
from motionary.pipeline.config import (
    AlignmentConfig,
    ClusterConfig,
    DistanceConfig,
    FeatureConfig,
    PipelineConfig,
    ReadConfig,
)
from motionary.pipeline.readers import library as scanning
from motionary.pipeline.stages import align, compare, ingest, represent
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job, prepare


@pytest.fixture
def takes(demo_library, tmp_path) -> Path:
    """Ten clips of two actions."""
    folder = tmp_path / "takes"
    for action in ("walk", "squat"):
        (folder / action).mkdir(parents=True)
        for file in sorted((demo_library / action).glob("*.bvh"))[:5]:
            shutil.copy(file, folder / action)
    return folder


@pytest.fixture
def another(demo_library) -> Path:
    """A clip that is not among `takes`."""
    return sorted((demo_library / "walk").glob("*.bvh"))[5]


@pytest.fixture
def work(monkeypatch) -> Counter:
    """What was computed: clips read, pairs compared, references chosen, clips aligned."""
    done: Counter = Counter()

    def counted(module, name, what, count=lambda *arguments: 1):
        usual = getattr(module, name)

        def spy(*arguments, **options):
            done[what] += count(*arguments)
            return usual(*arguments, **options)

        monkeypatch.setattr(module, name, spy)

    counted(ingest, "read_motion", "read")
    counted(compare, "_compare", "compared", lambda values, rows, columns, *_: len(rows) * len(columns))
    counted(compare, "_among", "compared", lambda values, some, *_: len(some) * (len(some) - 1) // 2)
    counted(represent, "similarity_index", "represented")
    counted(align, "cotw_search", "aligned")
    return done


def job(library: Path, catalog: Path, **stages) -> Job:
    stages.setdefault("distances", DistanceConfig(tile=3))
    stages.setdefault("clusters", ClusterConfig(n_clusters=2))
    return Job([str(library)], str(catalog), PipelineConfig(**stages))


@pytest.fixture
def after_first(takes, tmp_path, silent_progress, work):
    """Run once, forget what that took, and return how to run again."""
    run(job(takes, tmp_path / "out"), silent_progress)
    work.clear()

    def again(**stages):
        return run(job(takes, tmp_path / "out", **stages), silent_progress)

    return again


def names(catalog: Catalog) -> list[str]:
    return catalog.clips.to_arrow()["clip_id"].to_pylist()


def test_a_new_clip_is_read_and_compared_with_all_others(takes, after_first, work, another):
    shutil.copy(another, takes / "walk")
    result = after_first()
    assert (work["read"], work["compared"]) == (1, 10)
    assert (result.plan.new, result.plan.unchanged) == (1, 10)
    assert (result.plan.to_read, result.plan.to_compare) == (1, 10)
    # The squats keep their reference and their alignments.
    assert work["represented"] == 1
    assert work["aligned"] <= 6


def test_a_renamed_clip_costs_nothing(takes, after_first, work):
    old = sorted((takes / "walk").iterdir())[0]
    old.rename(takes / "another_name.bvh")
    result = after_first()
    assert not +work
    assert (result.plan.renamed, result.plan.unchanged, result.plan.removed) == (1, 9, 0)
    assert result.plan.to_read == result.plan.to_compare == 0
    assert "another_name.bvh" in names(result.catalog)
    assert f"walk/{old.name}" not in names(result.catalog)
    assert len(result.catalog.pairs) == 45
    assert (
        result.catalog.motion("another_name.bvh").frames
        == result.catalog.clips.to_pandas().set_index("clip_id").loc["another_name.bvh", "frames"]
    )


def test_equal_bytes_at_two_paths_are_two_clips_computed_once(takes, after_first, work, another):
    for name in ("a.bvh", "walk/b.bvh", "zz.bvh"):
        shutil.copy(another, takes / name)
    result = after_first()
    assert work["read"] == result.plan.to_read == 1
    # One of the three with ten others; then the three among themselves, at most.
    assert 10 <= work["compared"] <= 13
    assert len(result.catalog.clips) == 13
    assert len(result.catalog.pairs) == 13 * 12 // 2
    twins = result.catalog.sql(
        "select weighted from pairs where clip_a = 'a.bvh' and clip_b in ('walk/b.bvh', 'zz.bvh')"
    )
    assert twins["weighted"].to_pylist() == [0, 0]


def test_equal_bytes_in_several_batches_are_computed_once(takes, after_first, work, another):
    for number in range(9):
        shutil.copy(another, takes / f"{number}.bvh")
    result = after_first()
    assert len(set(result.catalog.inputs.to_pandas().query("clip_id < 'a'")["batch"])) > 1
    assert work["read"] == 1
    # One with ten others, and in each of few tiles a clip with itself; all pairs would be 126.
    assert 10 <= work["compared"] <= 20
    assert len(result.catalog.pairs) == 19 * 18 // 2


def test_a_changed_clip_is_read_again(takes, after_first, work, another):
    changed = sorted((takes / "walk").iterdir())[0]
    shutil.copy(another, changed)
    result = after_first()
    assert (work["read"], work["compared"]) == (1, 9)
    assert (result.plan.changed, result.plan.unchanged) == (1, 9)


def test_a_removed_clip_leaves_no_trace(takes, after_first, work):
    gone = sorted((takes / "walk").iterdir())[2]
    gone.unlink()
    result = after_first()
    assert (work["read"], work["compared"]) == (0, 0)
    assert result.plan.removed == 1
    for table in ("clips", "frames", "features", "resampled", "clusters", "aligned_frames", "inputs"):
        assert f"walk/{gone.name}" not in set(
            getattr(result.catalog, table).to_arrow()["clip_id"].to_pylist()
        )
    assert len(result.catalog.pairs) == 9 * 8 // 2


def test_settings_recompute_what_they_matter_to(after_first, work):
    after_first(features=FeatureConfig(epsilon=0.2))
    assert work["read"] == 0
    assert work["compared"] == 45
    work.clear()
    after_first(features=FeatureConfig(epsilon=0.2), alignment=AlignmentConfig(alpha=0.4))
    assert dict(work) == {"aligned": 10}
    work.clear()
    result = after_first(features=FeatureConfig(epsilon=0.2), alignment=AlignmentConfig(alpha=0.4))
    assert not +work
    assert result.computed == 0


def test_settings_and_back_again_find_the_first_results(after_first, work):
    after_first(features=FeatureConfig(epsilon=0.2))
    work.clear()
    after_first()
    assert (work["read"], work["compared"]) == (0, 0)


@pytest.mark.parametrize("other", [{"read": ReadConfig(up="z")}, {"features": FeatureConfig(frame_rate=15)}])
def test_other_reading_settings_read_everything_anew(
    takes, after_first, tmp_path, silent_progress, work, other
):
    grown = after_first(**other).catalog
    assert work["read"] == 10
    fresh = run(job(takes, tmp_path / "fresh", **other), silent_progress).catalog
    one, another = (catalog.sql("select * from features order by all") for catalog in (grown, fresh))
    assert one.equals(another)


def test_another_size_of_batches_moves_results_about(after_first, work):
    after_first(distances=DistanceConfig(tile=4))
    assert not +work


def test_an_untouched_file_is_not_even_opened(takes, after_first, monkeypatch):
    monkeypatch.setattr(scanning, "_SETTLED", 0.0)
    after_first()  # from here on the catalog knows the files' times

    def opened(files):
        raise AssertionError(f"{files} were read")

    with monkeypatch.context() as patch:
        patch.setattr(scanning, "digest_of", opened)
        assert after_first().computed == 0
    touched = sorted((takes / "walk").iterdir())[0]
    touched.touch()
    monkeypatch.setattr(scanning, "digest_of", opened)
    with pytest.raises(AssertionError, match=touched.name):
        after_first()


def test_a_file_changed_a_moment_ago_is_not_trusted(takes, after_first):
    (sorted((takes / "walk").iterdir())[0]).touch()
    states = after_first().catalog.inputs.to_arrow()["files"].to_pylist()
    assert [] in states


def test_a_file_that_could_not_be_read_for_a_while_is_read_again(takes, after_first, monkeypatch, another):
    shutil.copy(another, takes / "walk")
    usual = ingest.read_motion

    def out_of_memory(path, **options):
        if path.endswith(another.name):
            raise MemoryError("a moment's need")
        return usual(path, **options)

    with monkeypatch.context() as patch:
        patch.setattr(ingest, "read_motion", out_of_memory)
        missing = after_first().catalog
        (row,) = missing.quarantine.to_arrow().to_pylist()
        assert (row["path"], row["retry"]) == (f"walk/{another.name}", True)
    healed = after_first().catalog
    assert (len(healed.quarantine), len(healed.clips)) == (0, 11)
    assert after_first().computed == 0


def test_a_file_that_is_wrong_is_not_read_again(takes, after_first, work):
    (takes / "wrong.bvh").write_text("HIERARCHY\n")
    assert len(after_first().catalog.quarantine) == 1
    assert work.pop("read") == 1
    (takes / "wrong.bvh").rename(takes / "wrong_as_ever.bvh")
    (row,) = after_first().catalog.quarantine.to_arrow().to_pylist()
    assert row["path"] == "wrong_as_ever.bvh"
    assert not work["read"]


def test_a_lost_part_is_computed_again(takes, after_first, tmp_path, work, another):
    out = tmp_path / "out"
    (out / Catalog.open(out).files("pairs")[0]).unlink()
    (out / Catalog.open(out).files("frames")[1]).unlink()
    shutil.copy(another, takes / "walk")
    result = after_first()
    assert work["read"] > 1
    assert len(result.catalog.pairs) == 55


def test_looking_changes_nothing(takes, after_first, tmp_path, another):
    shutil.copy(another, takes / "walk")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")}
    plan = prepare(job(takes, tmp_path / "out")).plan
    assert (plan.new, plan.to_read, plan.to_compare) == (1, 1, 10)
    assert plan.seconds > 0
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*")} == before
    assert prepare(job(takes, tmp_path / "nowhere")).plan.seconds is None
    assert not (tmp_path / "nowhere").exists()


def some_change(library: Path, spare: list[Path], draw: random.Random) -> None:
    files = sorted(library.rglob("*.bvh"))
    match draw.choice(["new", "copy", "rename", "change", "remove", "wrong"]):
        case "new":
            shutil.copy(spare.pop(), library / "walk" / f"new{draw.random():.6f}.bvh")
        case "copy":
            shutil.copy(draw.choice(files), library / f"copy{draw.random():.6f}.bvh")
        case "rename":
            draw.choice(files).rename(library / "squat" / f"renamed{draw.random():.6f}.bvh")
        case "change":
            shutil.copy(spare.pop(), draw.choice(files))
        case "remove" if len(files) > 4:
            draw.choice(files).unlink()
        case "wrong":
            draw.choice(files).write_text("HIERARCHY\n")


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_library_that_grew_ends_like_one_that_came_at_once(
    takes, demo_library, after_first, tmp_path, silent_progress, seed
):
    draw = random.Random(seed)
    spare = sorted(demo_library.glob("[!sw]*/*.bvh"))
    draw.shuffle(spare)
    for _ in range(4):
        for _ in range(draw.randint(1, 3)):
            some_change(takes, spare, draw)
        grown = after_first().catalog
    fresh = run(job(takes, tmp_path / "fresh"), silent_progress).catalog
    kept = {"runs", "inputs", "lineage"}
    numbered = {"clusters", "references", "alignments", "aligned", "styles"}
    for table in set(PUBLISHED) - kept - numbered:
        one, other = (catalog.sql(f"select * from {table} order by all") for catalog in (grown, fresh))
        assert one.equals(other), table
    # The clusters are the same but for their numbers.
    for table in ("clusters", "references"):
        grown_rows, fresh_rows = (
            catalog.sql(f'select * exclude (cluster_id) from "{table}" order by clip_id').to_pylist()
            for catalog in (grown, fresh)
        )
        assert grown_rows == fresh_rows
    # Copies of one file stand for a cluster equally well, so the alignments are compared by content.
    for one in ("alignments", "styles"):
        assert len(getattr(grown, one)) == len(getattr(fresh, one)) == len(fresh.clips)


def test_labels_of_renamed_files_are_told_with_the_new_names(takes, tmp_path, silent_progress):
    labels = takes / "labels.csv"
    files = sorted(path.relative_to(takes).as_posix() for path in takes.rglob("*.bvh"))
    labels.write_text("path,action\n" + "".join(f"{file},{file.split('/')[0]}\n" for file in files))

    def again():
        config = PipelineConfig(distances=DistanceConfig(tile=3))
        return run(Job([str(takes)], str(tmp_path / "labelled"), config, labels), silent_progress)

    assert again().stale_labels == {}
    (takes / "walk").rename(takes / "gait")
    stale = again().stale_labels
    assert stale == {file: file.replace("walk/", "gait/") for file in files if file.startswith("walk/")}


def flipped(file: Path) -> None:
    """Change one bit in the middle of a file."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize("damage", [flipped, lambda file: file.write_bytes(file.read_bytes()[:100])])
def test_a_damaged_part_of_an_older_snapshot_is_not_built_upon(
    after_first, tmp_path, silent_progress, takes, damage
):
    first = Catalog.open(tmp_path / "out")
    after_first(features=FeatureConfig(epsilon=0.3))
    for table in ("resampled", "pairs"):
        damage(tmp_path / "out" / first.files(table)[0])
    again = after_first().catalog
    assert [check.name for check in verify(again.store) if not check.passed] == []
    fresh = run(job(takes, tmp_path / "fresh"), silent_progress).catalog
    for table in ("resampled", "pairs"):
        one, other = (catalog.sql(f"select * from {table} order by all") for catalog in (again, fresh))
        assert one.equals(other)


def test_a_damaged_part_of_the_published_snapshot_is_named(takes, after_first, tmp_path, another):
    out = tmp_path / "out"
    damaged = out / Catalog.open(out).files("pairs")[0]
    damaged.write_bytes(damaged.read_bytes()[:100])
    shutil.copy(another, takes / "walk")
    with pytest.raises(CatalogError, match=rf"{damaged} is damaged .* remove that file and run again"):
        after_first()
    damaged.unlink()
    assert len(after_first().catalog.pairs) == 55


def test_a_name_decides_nothing_between_equally_good_references(takes, tmp_path, silent_progress):
    for file in sorted((takes / "walk").iterdir())[2:]:
        file.unlink()
    shutil.rmtree(takes / "squat")
    one = ClusterConfig(n_clusters=1)
    before = run(job(takes, tmp_path / "out", clusters=one), silent_progress).catalog
    reference = before.references.to_arrow()["clip_id"][0].as_py()
    (takes / reference).rename(takes / "zz.bvh")
    grown = run(job(takes, tmp_path / "out", clusters=one), silent_progress).catalog
    fresh = run(job(takes, tmp_path / "fresh", clusters=one), silent_progress).catalog
    assert grown.references.to_arrow().equals(fresh.references.to_arrow())
    assert grown.references.to_arrow()["clip_id"].to_pylist() == ["zz.bvh"]


def test_a_copy_inside_a_cluster_counts_there(takes, after_first, tmp_path, silent_progress):
    shutil.copy(sorted((takes / "squat").iterdir())[0], takes / "squat" / "copy.bvh")
    grown = after_first().catalog
    assert [check.name for check in verify(grown.store) if not check.passed] == []
    fresh = run(job(takes, tmp_path / "fresh"), silent_progress).catalog
    for table in ("references", "styles"):
        one, other = (
            catalog.sql(f'select * exclude (cluster_id) from "{table}" order by clip_id')
            for catalog in (grown, fresh)
        )
        assert one.equals(other), table


def test_lost_numbers_are_not_given_again(after_first, tmp_path):
    (lost,) = Catalog.open(tmp_path / "out").files("lineage")
    (tmp_path / "out" / lost).unlink()
    with pytest.raises(CatalogError, match=rf"{lost} is gone, and with it the clusters' numbers; restore it"):
        after_first()


def test_what_a_snapshot_names_is_not_written_again(after_first, tmp_path):
    (labels,) = Catalog.open(tmp_path / "out").files("labels")
    before = (tmp_path / "out" / labels).stat()
    assert after_first().catalog.files("labels") == [labels]
    after = (tmp_path / "out" / labels).stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_files_that_cannot_be_opened_have_their_own_reasons(takes, after_first):
    (takes / "a_link.bvh").symlink_to(takes / "nowhere.bvh")
    os.mkfifo(takes / "b_pipe.bvh")
    reasons = {row["path"]: row["reason"] for row in after_first().catalog.quarantine.to_arrow().to_pylist()}
    assert len(set(reasons.values())) == 2


def test_a_folder_with_colons_is_itself(takes, tmp_path, silent_progress, monkeypatch):
    monkeypatch.chdir(tmp_path)
    catalog = run(Job([str(takes)], "zz::b", PipelineConfig()), silent_progress).catalog
    assert (tmp_path / "zz::b" / "CURRENT").exists()
    assert not (tmp_path / "zz").exists()
    assert len(catalog.sql("from clips")) == 10
