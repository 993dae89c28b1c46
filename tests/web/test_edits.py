"""Labels set from the pages and taken back: exactly, one by one, and never over what somebody else did."""

import json
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import fsspec
import pytest

from motionary.catalog import Catalog
from motionary.catalog.errors import CatalogError
from motionary.catalog.store import Store
from motionary.catalog.web.desk import Desk, Edit, Relabel, Undo
from motionary.catalog.writer_lock import the_only_writer
from motionary.workflows.relabel import relabel
from tests.catalogs import copied
from tests.web.serving import editor_of, served

WALK, RUN, JUMP = "walk/walk_tired_alex_01.bvh", "run/run_tired_bea_01.bvh", "jump/jump_neutral_emil_02.bvh"


@pytest.fixture
def url(demo_catalog, tmp_path) -> str:
    return copied(demo_catalog, tmp_path)


@pytest.fixture
def client(url):
    with served(url, editor=editor_of(url)) as client:
        yield client


def label(client, clip: str, text: str | None) -> dict:
    answer = client.post("/edit/relabel", json={"clip": clip, "label": text})
    assert answer.status_code == 200, answer.text
    return answer.json()


def undo(client, edit: int):
    return client.post("/edit/undo", json={"edit": edit})


def state(url: str) -> tuple[list, list]:
    with Catalog.open(url) as catalog:
        return catalog.labels.to_arrow().to_pylist(), catalog.clusters.to_arrow().sort_by(
            "clip_id"
        ).to_pylist()


def labels(url: str) -> dict[str, str]:
    return {row["clip_id"]: row["label"] for row in state(url)[0]}


def test_a_label_is_published_and_said_who_set_it(client, url):
    answer = label(client, WALK, " trudge ")
    last = {"clip": WALK, "before": None, "label": "trudge"}
    assert answer == {**last, "undo": {"edit": 1, **last}}
    with Catalog.open(url) as catalog:
        (row,) = catalog.labels.to_arrow().to_pylist()
        (name,) = catalog.sql(
            "select label, label_source from clusters where clip_id = ?", [WALK]
        ).to_pylist()
    assert (row["label"], row["set_by"]) == ("trudge", "ada")
    assert name == {"label": "trudge", "label_source": "override"}


def test_undo_gives_back_that_there_was_none(client, url):
    before = state(url)
    edit = label(client, WALK, "trudge")["undo"]["edit"]
    answer = undo(client, edit)
    assert answer.json() == {"clip": WALK, "before": "trudge", "label": None, "undo": None}
    assert state(url) == before


def test_undo_gives_back_what_somebody_had_said_and_when(client, url):
    relabel(url, {WALK: "stroll"}, "grace").close()
    before = state(url)
    edit = label(client, WALK, "trudge")["undo"]["edit"]
    assert state(url)[0][0]["set_by"] == "ada"
    assert undo(client, edit).json()["label"] == "stroll"
    assert state(url) == before
    assert before[0][0]["set_by"] == "grace"


def test_undo_of_forgetting(client, url):
    relabel(url, {WALK: "stroll"}, "grace").close()
    before = state(url)
    edit = label(client, WALK, None)["undo"]["edit"]
    assert labels(url) == {}
    assert undo(client, edit).status_code == 200
    assert state(url) == before


def test_undo_across_several_edits_also_of_one_clip(client, url):
    relabel(url, {RUN: "jog"}, "grace").close()
    states = []
    for clip, text in ((WALK, "a"), (RUN, "b"), (WALK, "c"), (WALK, None), (JUMP, "d"), (RUN, None)):
        states.append(state(url))
        last = label(client, clip, text)["undo"]
    while states:
        answer = undo(client, last["edit"])
        assert answer.status_code == 200, answer.text
        assert state(url) == states.pop()
        last = answer.json()["undo"]
    assert last is None


def test_undo_of_an_earlier_edit_alone(client, url):
    first = label(client, WALK, "a")["undo"]["edit"]
    label(client, RUN, "b")
    assert undo(client, first).status_code == 200
    assert labels(url) == {RUN: "b"}


def test_undo_of_an_earlier_edit_waits_for_the_later_one_of_the_clip(client, url):
    first = label(client, WALK, "one")["undo"]["edit"]
    second = label(client, WALK, "two")["undo"]["edit"]
    answer = undo(client, first)
    assert (answer.status_code, "take that back first" in answer.json()["error"]) == (409, True)
    assert [undo(client, one).status_code for one in (second, first)] == [200, 200]
    assert labels(url) == {}


def test_one_bad_wish_leaves_the_others_of_its_publication_alone(url):
    """Three come while one is published, so they go together."""
    inner, begun, go_on = editor_of(url), threading.Event(), threading.Event()

    class Slow:
        user = "ada"

        def publish(self, changed) -> None:
            begun.set()
            assert go_on.wait(60)
            inner.publish(changed)

    with served(url, editor=Slow()) as client, ThreadPoolExecutor(4) as threads:
        asked = [threads.submit(client.post, "/edit/relabel", json={"clip": WALK, "label": "a"})]
        assert begun.wait(60)
        for clip in ("\ud800", RUN, JUMP):
            body = json.dumps({"clip": clip, "label": "b"})
            headers = {"Content-Type": "application/json"}
            asked.append(threads.submit(client.post, "/edit/relabel", content=body, headers=headers))
        time.sleep(0.5)  # they are on their way; were one late, it would be published on its own
        go_on.set()
        assert [one.result().status_code for one in asked] == [200, 404, 200, 200]
    assert labels(url) == {WALK: "a", RUN: "b", JUMP: "b"}


@pytest.mark.parametrize("theirs", ["stroll", None])
def test_what_somebody_else_changed_meanwhile_is_not_undone(client, url, theirs):
    first = label(client, RUN, "jog")["undo"]["edit"]
    edit = label(client, WALK, "trudge")["undo"]["edit"]
    relabel(url, {WALK: theirs, JUMP: "hop"}, "grace").close()
    before = state(url)
    answer = undo(client, edit)
    assert answer.status_code == 409
    assert f"{WALK} was changed by somebody else" in answer.json()["error"]
    assert ("it has 'stroll' by grace" if theirs else "no label of a person's") in answer.json()["error"]
    assert state(url) == before
    assert answer.json()["undo"]["edit"] == first  # what is before it can still be taken back
    assert undo(client, first).status_code == 200
    assert labels(url) == ({WALK: theirs, JUMP: "hop"} if theirs else {JUMP: "hop"})


def test_the_same_label_set_by_somebody_else_is_theirs(client, url):
    edit = label(client, WALK, "trudge")["undo"]["edit"]
    relabel(url, {WALK: None}, "grace").close()
    relabel(url, {WALK: "trudge"}, "grace").close()
    assert undo(client, edit).status_code == 409


def test_json_without_an_end_is_told(client):
    headers = {"Content-Type": "application/json"}
    answer = client.post("/edit/relabel", content="[" * 60_000, headers=headers)
    assert (answer.status_code, "no JSON object" in answer.json()["error"]) == (400, True)


def test_nothing_is_undone_twice(client):
    edit = label(client, WALK, "trudge")["undo"]["edit"]
    assert undo(client, edit).status_code == 200
    assert undo(client, edit).status_code == 409
    assert undo(client, 77).status_code == 409


def test_a_label_that_was_so_already_is_no_change(client, url):
    label(client, WALK, "trudge")
    snapshot = Catalog.open(url).snapshot.snapshot_id
    assert label(client, WALK, "trudge")["undo"]["edit"] == 1
    assert Catalog.open(url).snapshot.snapshot_id == snapshot


def test_another_writer_is_named_and_nothing_lost(client, url):
    edit = label(client, RUN, "jog")["undo"]["edit"]
    with the_only_writer(Store(url), lambda dead: None):
        refused = client.post("/edit/relabel", json={"clip": WALK, "label": "trudge"})
        also = undo(client, edit)
    assert refused.status_code == also.status_code == 409
    assert "is being written by process" in refused.json()["error"]
    assert labels(url) == {RUN: "jog"}
    assert label(client, WALK, "trudge")["label"] == "trudge"
    assert undo(client, edit).status_code == 200, "an undo that could not be published can be tried again"


@pytest.mark.parametrize(
    ("sent", "status", "told"),
    [
        ({"clip": "walk/none.bvh", "label": "x"}, 404, "no clip 'walk/none.bvh'"),
        ({"clip": WALK, "label": "  "}, 400, "cannot be the label"),
        ({"clip": WALK, "label": "a\nb"}, 400, "cannot be the label"),
        ({"clip": WALK, "label": "x" * 301}, 400, "301 characters; give 300"),
        ({"clip": WALK}, 400, "cannot be the label"),
        ({"clip": WALK, "label": None}, 400, "nothing to remove"),
        ({"clip": 7, "label": "x"}, 400, "clip_id"),
        ({"clip": WALK, "label": ["x"]}, 400, "clip_id"),
        ([], 400, "no JSON object"),
    ],
)
def test_what_cannot_be_done_is_told(client, url, sent, status, told):
    before = state(url)
    answer = client.post("/edit/relabel", json=sent)
    assert answer.status_code == status
    assert told in answer.json()["error"]
    assert state(url) == before


def test_little_is_read(client):
    kind = {"Content-Type": "application/json"}
    assert client.post("/edit/relabel", content=b" " * 70_000, headers=kind).status_code == 413
    assert client.post("/edit/relabel", content=b"{", headers=kind).status_code == 400
    assert client.post("/edit/undo", json={"edit": "1"}).status_code == 400


def test_a_hostile_label_is_text(client, url):
    label(client, WALK, "</script><img src=x onerror=alert(1)>'\"")
    page = client.get("/review", params={"clip": WALK}).text
    assert "<img src=x" not in page
    assert "&lt;/script&gt;" in page


class Slow:
    """An editor whose first publication waits for a word."""

    user = "ada"

    def __init__(self, url: str) -> None:
        self.inner, self.published = editor_of(url), 0
        self.begun, self.go_on = threading.Event(), threading.Event()

    def publish(self, changed) -> None:
        self.published += 1
        self.begun.set()
        assert self.go_on.wait(30)
        self.inner.publish(changed)


def test_what_comes_meanwhile_is_published_together_each_with_its_answer(url):
    editor = Slow(url)
    with served(url, editor=editor) as client, ThreadPoolExecutor(5) as threads:

        def ask(clip: str, text: str):
            return client.post("/edit/relabel", json={"clip": clip, "label": text})

        first = threads.submit(ask, WALK, "a")
        assert editor.begun.wait(30)
        others = [threads.submit(ask, *one) for one in ((RUN, "b"), ("none", "c"), (JUMP, "d"), (JUMP, ""))]
        assert client.get("/review", params={"clip": WALK}).status_code == 200  # pages are shown meanwhile
        threading.Event().wait(0.5)  # for the others to arrive
        editor.go_on.set()
        assert first.result().status_code == 200
        assert [one.result().status_code for one in others] == [200, 404, 200, 400]
    assert editor.published == 2
    assert labels(url) == {WALK: "a", RUN: "b", JUMP: "d"}


@pytest.mark.parametrize("error", [CatalogError("it is away"), OSError(28, "No space left on device")])
def test_a_publication_that_fails_is_told_and_the_next_one_works(url, error):
    class Failing(Slow):
        def publish(self, changed) -> None:
            raise error

    editor = Failing(url)
    with served(url, editor=editor) as client:
        answer = client.post("/edit/relabel", json={"clip": WALK, "label": "a"})
        assert answer.status_code in (409, 500)
        assert ("away" in answer.json()["error"]) or ("No space" in answer.json()["error"])
        assert answer.json()["undo"] is None
        editor.publish = editor.inner.publish
        assert label(client, WALK, "a")["label"] == "a"


def test_a_fault_of_ours_is_told_and_logged_and_answers_all_who_wait(url, caplog):
    class Faulty(Slow):
        def publish(self, changed) -> None:
            self.published += 1
            self.begun.set()
            assert self.go_on.wait(30)
            if self.published == 2:
                raise KeyError("of a test")
            self.inner.publish(changed)

    editor = Faulty(url)
    with served(url, editor=editor) as client, ThreadPoolExecutor(3) as threads:

        def ask(clip: str):
            return client.post("/edit/relabel", json={"clip": clip, "label": "a"})

        first = threads.submit(ask, WALK)
        assert editor.begun.wait(30)
        others = [threads.submit(ask, one) for one in (RUN, JUMP)]
        threading.Event().wait(0.5)  # for the others to arrive
        editor.go_on.set()
        assert first.result().status_code == 200
        answers = [one.result() for one in others]
        assert ask(RUN).status_code == 200
    assert [one.status_code for one in answers] == [500] * 2
    assert all("motionary failed: KeyError" in one.json()["error"] for one in answers)
    assert answers[0].json()["undo"]["clip"] == WALK
    assert [one.exc_info[0] for one in caplog.records if one.name.endswith("web.desk")][0] is KeyError


@pytest.fixture
def threads_change_often():
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def test_the_latest_change_is_read_while_others_are_made(url, threads_change_often):
    desk = Desk(editor_of(url))
    ended = threading.Event()

    def change() -> None:
        while not ended.is_set():
            desk._note(Relabel(WALK, "a"), Edit(WALK, None, {"label": "a"}))
            desk._note(Undo(desk._number), Edit(WALK, {"label": "a"}, None))

    thread = threading.Thread(target=change)
    thread.start()
    try:
        for _ in range(20_000):
            assert desk.last is None or desk.last["clip"] == WALK
    finally:
        ended.set()
        thread.join()


def test_a_catalog_on_s3_is_shown_edited_and_undone(demo_catalog, bucket, tmp_path):
    url = f"{bucket}/catalog"
    fsspec.filesystem("s3").put(copied(demo_catalog, tmp_path), url, recursive=True)
    before = state(url)
    with served(url, editor=editor_of(url)) as client:
        assert client.get("/").status_code == 200
        assert WALK in client.get("/review", params={"clip": WALK}).text
        edit = label(client, WALK, "trudge")["undo"]["edit"]
        assert "as a person said" in client.get("/review", params={"clip": WALK}).text
        assert labels(url) == {WALK: "trudge"}
        assert undo(client, edit).status_code == 200
    assert state(url) == before
