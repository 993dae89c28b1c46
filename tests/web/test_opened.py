"""When a catalog is looked at again, and what is kept of what was made of it."""

import base64
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionary.catalog.web import chart_data, opened
from motionary.catalog.web.opened import CatalogGone, Kept, Opened
from motionary.workflows.relabel import relabel
from tests.catalogs import copied
from tests.web.serving import editor_of, served

WALK = "walk/walk_tired_alex_01.bvh"


class Far:
    """A store that counts how often it is asked, and answers the second time when it is told to."""

    def __init__(self, monkeypatch) -> None:
        self.asked, self.now = 0, 100.0
        self.answers = threading.Event()
        self._current = opened.current_id
        monkeypatch.setattr(opened, "current_id", self.current_id)
        monkeypatch.setattr(opened, "monotonic", lambda: self.now)

    def current_id(self, store):
        self.asked += 1
        held, found = self.asked == 2, self._current(store)
        assert not held or self.answers.wait(30)
        return found


@pytest.fixture
def far(monkeypatch):
    return Far(monkeypatch)


def name_of(shown) -> str:
    return shown.catalog.sql("select label from clusters where clip_id = ?", [WALK])["label"][0].as_py()


def test_it_is_looked_up_once_a_second_at_most(demo_catalog, tmp_path, far):
    url = copied(demo_catalog, tmp_path)
    catalog = Opened(url)
    first = catalog.shown()
    far.answers.set()
    relabel(url, {WALK: "trudge"}, "ada").close()
    far.now += 0.9
    assert all(catalog.shown() is first for _ in range(20))
    assert far.asked == 1
    far.now += 0.2
    assert name_of(catalog.shown()) == "trudge"
    assert far.asked == 2


def test_nobody_waits_for_a_store_that_is_slow_but_one(demo_catalog, far):
    catalog = Opened(demo_catalog)
    first = catalog.shown()
    far.now += 2
    with ThreadPoolExecutor(1) as thread:
        one = thread.submit(catalog.shown)
        while far.asked < 2:
            time.sleep(0.01)
        assert [catalog.shown() for _ in range(5)] == [first] * 5
        assert not one.done()
        far.answers.set()
        assert one.result() is first
    assert far.asked == 2


def test_a_look_that_began_before_another_does_not_bring_the_old_back(demo_catalog, tmp_path, far):
    url = copied(demo_catalog, tmp_path)
    catalog = Opened(url)
    catalog.shown()
    with ThreadPoolExecutor(1) as thread:
        slow = thread.submit(catalog.look)
        while far.asked < 2:
            time.sleep(0.01)
        relabel(url, {WALK: "trudge"}, "ada").close()
        newer = catalog.look()
        far.answers.set()
        slow.result()
    assert name_of(newer) == "trudge"
    assert catalog.shown() is newer


def test_what_cannot_be_looked_up_is_looked_up_by_the_next(demo_catalog, monkeypatch, far):
    far.answers.set()
    catalog = Opened(demo_catalog)
    first = catalog.shown()
    far.now += 2
    with monkeypatch.context() as broken:
        broken.setattr(opened, "current_id", lambda store: 1 / 0)
        for _ in range(2):
            with pytest.raises(ZeroDivisionError):
                catalog.shown()
    assert catalog.shown() is first
    monkeypatch.setattr(opened, "current_id", lambda store: None)
    far.now += 2
    for _ in range(2):
        with pytest.raises(CatalogGone):
            catalog.shown()


def test_an_edit_is_in_the_very_next_answer(demo_catalog, tmp_path, monkeypatch):
    url = copied(demo_catalog, tmp_path)
    monkeypatch.setattr(opened, "LOOK_EVERY", 1e6)
    with served(url, editor=editor_of(url)) as client:
        for label in ("trudge", "plod"):
            assert label not in client.get("/clip", params={"id": WALK}).text
            client.post("/edit/relabel", json={"clip": WALK, "label": label})
            assert label in client.get("/clip", params={"id": WALK}).text
        client.post("/edit/undo", json={"edit": 2})
        assert "trudge" in client.get("/clip", params={"id": WALK}).text


def test_a_label_leaves_the_places_on_the_map(demo_catalog, tmp_path, monkeypatch):
    laid_out = []
    places = chart_data.map_places
    monkeypatch.setattr(chart_data, "map_places", lambda catalog: laid_out.append(1) or places(catalog))
    url = copied(demo_catalog, tmp_path)

    def drawn() -> tuple[dict, set[str]]:
        traces = client.get("/data/chart", params={"name": "map"}).json()["data"]
        marks = [one for one in traces if one.get("customdata")]
        where = {
            clip: (x, y)
            for one in marks
            for clip, x, y in zip(one["customdata"], unpacked(one["x"]), unpacked(one["y"]), strict=True)
        }
        return where, {text for one in marks for text in one["hovertext"]}

    with served(url, editor=editor_of(url)) as client:
        before, names = drawn()
        client.post("/edit/relabel", json={"clip": WALK, "label": "trudge"})
        after, others = drawn()
    assert (len(before), before) == (80, after)
    assert any("trudge" in one for one in others - names)
    assert laid_out == [1]


def unpacked(values: dict) -> list[float]:
    return np.frombuffer(base64.b64decode(values["bdata"]), values["dtype"]).tolist()


# what is kept


def test_what_two_ask_for_at_once_is_made_once():
    kept, made, began = Kept(1000), [], threading.Event()

    def make() -> str:
        made.append(1)
        began.wait(5)
        return "it"

    with ThreadPoolExecutor(4) as threads:
        answers = [threads.submit(kept.get, "key", make) for _ in range(4)]
        time.sleep(0.05)
        assert not kept.ready("key")
        began.set()
        assert [one.result() for one in answers] == ["it"] * 4
    assert made == [1]
    assert kept.ready("key")


def test_what_failed_is_tried_again():
    kept = Kept(1000)
    with pytest.raises(ZeroDivisionError):
        kept.get("key", lambda: 1 / 0)
    assert kept.get("key", lambda: "it") == "it"


def test_the_longest_unasked_for_is_forgotten():
    kept = Kept(2500)
    for key in ("a", "b", "a", "c"):
        kept.get(key, lambda: bytes(1000))
    assert [kept.ready(one) for one in "abc"] == [True, False, True]


def test_what_is_larger_than_all_may_be_is_given_and_not_kept():
    kept = Kept(2500)
    kept.get("a", lambda: bytes(1000))
    assert kept.get("b", lambda: bytes(3000)) == bytes(3000)
    assert [kept.ready(one) for one in "ab"] == [True, False]


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 600)), max_size=40))
def test_never_more_bytes_than_the_most_are_kept(asked):
    kept, sizes = Kept(1000), {}
    for key, size in asked:
        if not kept.ready(key):
            sizes[key] = size
        assert kept.get(key, lambda size=size: bytes(size)) == bytes(sizes[key])
        assert kept.ready(key)
        assert sum(size for one, size in sizes.items() if kept.ready(one)) <= 1000
