"""Catalogs that are not on disk: in memory, and on an S3 server of this machine."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from motionary.catalog import Catalog, CatalogError
from motionary.catalog.history import diff
from motionary.catalog.snapshot import current_id, current_snapshot, next_snapshot_id, publish, snapshot_ids
from motionary.catalog.store import Store
from motionary.catalog.vacuum import vacuum
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job


@pytest.fixture(scope="module")
def few(demo_library, tmp_path_factory) -> Path:
    """A small library: six clips of two actions."""
    library = tmp_path_factory.mktemp("elsewhere") / "few"
    for action in ("walk", "squat"):
        (library / action).mkdir(parents=True)
        for file in sorted((demo_library / action).glob("*.bvh"))[:3]:
            shutil.copy(file, library / action)
    return library


@pytest.fixture(scope="module", params=["memory", pytest.param("s3", marks=pytest.mark.slow)])
def published(request, few, silent_progress) -> str:
    """Publish a library, and again with a clip less; returns the catalog's URL. Tests do not change it."""
    url = (
        "memory://elsewhere" if request.param == "memory" else f"{request.getfixturevalue('bucket')}/some/dir"
    )
    run(Job([str(few)], url, PipelineConfig(), workers=1), silent_progress)
    taken = sorted((few / "squat").glob("*.bvh"))[0]
    taken.rename(few.parent / taken.name)
    run(Job([str(few)], url, PipelineConfig(), workers=1), silent_progress)
    (few.parent / taken.name).rename(taken)
    return url


@pytest.fixture
def copy(published, request) -> Store:
    """A copy of the catalog that a test may change."""
    source = Store(published)
    target = Store(f"{published}-{request.node.name.partition('[')[0]}")
    for name in source.sizes(""):
        target.write(name, source.read_bytes(name))
    return target


def test_it_is_read_back(published, few, tmp_path):
    with Catalog.open(published) as catalog:
        clips = catalog.clips.to_arrow()["clip_id"].to_pylist()
        assert clips == sorted(path.relative_to(few).as_posix() for path in few.rglob("*.bvh"))[1:]
        counted = catalog.sql('select count(*) n from pairs join "references" r on r.clip_id = clip_a')
        assert len(catalog.pairs) == 10
        assert counted["n"][0].as_py() > 0
        assert catalog.motion(clips[0]).frames == clips_frames(catalog, clips[0])
        assert catalog.aligned(clips[0]).fps == 30
        assert [one.reason for one in catalog.export(tmp_path / "out", "bvh")] == [None] * len(clips)
        assert len(list((tmp_path / "out").rglob("*.bvh"))) == len(clips)


def clips_frames(catalog: Catalog, clip_id: str) -> int:
    return catalog.sql("select frames from clips where clip_id = ?", [clip_id])["frames"][0].as_py()


@pytest.mark.parametrize(
    "query",
    [
        "select * from read_text('{local}')",
        "select * from read_text('{other}')",
        "copy (select 1) to '{url}/made.csv'",
        "copy (select 1) to '{local}.made'",
        "set enable_external_access = true",
    ],
)
def test_a_query_reaches_nothing_but_the_catalog(published, tmp_path, query):
    local, other = tmp_path / "secret.txt", Store(f"{published}-other")
    local.write_text("secret")
    other.write("secret.txt", b"secret")
    asked = query.format(local=local, other=f"{other.url}/secret.txt", url=published)
    with pytest.raises(CatalogError):
        Catalog.open(published).sql(asked)
    assert not Store(published).filesystem.exists(Store(published).path("made.csv"))
    assert [path.name for path in tmp_path.iterdir()] == ["secret.txt"]


def test_it_is_opened_as_it_was(published):
    earlier, now = Catalog.open(published, 1), Catalog.open(published)
    assert (len(earlier.clips), len(now.clips)) == (6, 5)
    assert len(diff(earlier, now).removed) == 1
    assert (earlier.lease, now.lease) == (None, None)


def test_vacuum_keeps_what_the_current_snapshot_names(copy):
    before = Catalog.open(copy.url, 1)
    gone = vacuum(copy, keep=1, grace_hours=0)
    assert gone.snapshots == ("000001",)
    assert gone.files > 0
    after = Catalog.open(copy.url)
    assert set(copy.sizes("tables")) == set(after.snapshot.files)
    assert {file: copy.facts(file) for file in after.snapshot.files} == dict(after.snapshot.parts)
    with pytest.raises(FileNotFoundError):
        before.pairs.to_arrow()


def test_what_was_current_a_moment_ago_is_kept_for_its_readers(copy):
    before = Catalog.open(copy.url, 1)
    assert vacuum(copy, keep=1).snapshots == ()
    assert len(before.pairs.to_arrow()) == 15


def test_of_two_runs_made_from_one_snapshot_the_second_is_refused(copy):
    start = current_snapshot(copy)
    publish(copy, replace(start, snapshot_id=next_snapshot_id(copy)), after=start)
    assert current_id(copy) == "000003"
    files = copy.sizes("")
    with pytest.raises(CatalogError, match="another run has published snapshot 000003 of .* meanwhile"):
        publish(copy, replace(start, snapshot_id=next_snapshot_id(copy)), after=start)
    assert (copy.sizes(""), current_id(copy)) == (files, "000003")


def test_of_two_runs_with_one_number_the_second_is_refused(copy, monkeypatch):
    start = current_snapshot(copy)
    mine = replace(start, snapshot_id=next_snapshot_id(copy))
    yours = replace(mine, created_at="2026-01-02T03:04:05+00:00")
    meanwhile(monkeypatch, copy, "create", lambda: publish(copy, yours, after=start))
    with pytest.raises(CatalogError, match="another run has published .*000003.* meanwhile"):
        publish(copy, mine, after=start)
    assert current_snapshot(copy).created_at == yours.created_at


def test_current_is_replaced_only_where_it_is_what_was_seen(copy, monkeypatch):
    if not copy.url.startswith("s3://"):
        pytest.skip("only S3 replaces on condition")
    start = current_snapshot(copy)
    meanwhile(
        monkeypatch, copy, "replace", lambda: publish(copy, replace(start, snapshot_id="000004"), after=start)
    )
    with pytest.raises(CatalogError, match="another run has published snapshot 000004 of .* meanwhile"):
        publish(copy, replace(start, snapshot_id="000003"), after=start)
    assert current_id(copy) == "000004"
    assert snapshot_ids(copy) == ["000001", "000002", "000004"]


def test_the_first_to_publish_is_alone_in_that(copy, monkeypatch):
    if not copy.url.startswith("s3://"):
        pytest.skip("only S3 replaces on condition")
    start = current_snapshot(copy)
    copy.delete("CURRENT")
    meanwhile(
        monkeypatch, copy, "replace", lambda: publish(copy, replace(start, snapshot_id="000004"), after=None)
    )
    with pytest.raises(CatalogError, match="another run has published snapshot 000004"):
        publish(copy, replace(start, snapshot_id="000003"), after=None)
    assert current_id(copy) == "000004"


def test_a_request_that_was_sent_twice_has_not_lost_to_itself(copy, monkeypatch):
    start = current_snapshot(copy)
    usual = type(copy.filesystem).pipe_file

    def twice(self, *arguments, **options):
        usual(self, *arguments, **options)
        if options:
            usual(self, *arguments, **options)

    monkeypatch.setattr(type(copy.filesystem), "pipe_file", twice)
    publish(copy, replace(start, snapshot_id="000003"), after=start)
    assert current_id(copy) == "000003"


def test_the_commands_take_a_url(copy, motionary):
    assert motionary("query", copy.url, "select count(*) n from clips", "--format", "csv")[1].split() == [
        '"n"',
        "5",
    ]
    assert motionary("runs", copy.url)[1].count("true") + motionary("runs", copy.url)[1].count("True") >= 2
    code, out, _ = motionary("vacuum", copy.url, "--grace-hours", 0)
    assert (code, snapshot_ids(copy)) == (0, ["000002"])
    assert out.startswith("removed 1 snapshot")


def test_a_server_that_cannot_be_reached_is_one_clear_line(motionary, monkeypatch):
    exceptions = pytest.importorskip("botocore.exceptions")

    def refuse(self, name):
        raise exceptions.EndpointConnectionError(endpoint_url="http://127.0.0.1:9")

    monkeypatch.setattr(Store, "read_bytes", refuse)
    code, out, err = motionary("status", "memory://nowhere")
    assert (code, out) == (1, "")
    assert err == 'motionary: Could not connect to the endpoint URL: "http://127.0.0.1:9"\n'


def meanwhile(monkeypatch, store: Store, step: str, act) -> None:
    """Let something happen just before a step of publishing, once."""
    usual = getattr(Store, step)

    def interrupted(self, *arguments):
        monkeypatch.setattr(Store, step, usual)
        act()
        return usual(self, *arguments)

    monkeypatch.setattr(Store, step, interrupted)
