"""Review and drop in a real browser: by keyboard, with what happens behind, and what a person sees of it."""

import http.server
import json
import threading
from pathlib import Path

import pytest

from motionary.catalog import Catalog
from motionary.catalog.review import review
from motionary.catalog.store import Store
from motionary.catalog.web.access import Guard
from motionary.catalog.writer_lock import the_only_writer
from motionary.workflows.relabel import relabel
from tests.web.serving import editor_of, served, with_mistakes

WALK = "walk/walk_tired_alex_01.bvh"


@pytest.fixture(scope="module")
def mistaken(demo_library, demo_catalog, tmp_path_factory, silent_progress) -> str:
    """A catalog with wrong labels, to be changed."""
    return with_mistakes(demo_library, demo_catalog, tmp_path_factory.mktemp("review"), silent_progress)


@pytest.fixture
def site(mistaken):
    with served(mistaken, editor=editor_of(mistaken)) as client:
        yield str(client.base_url).rstrip("/")


def labels(url: str) -> dict[str, str]:
    with Catalog.open(url) as catalog:
        rows = catalog.labels.to_arrow().to_pylist()
    return {row["clip_id"]: row["label"] for row in rows}


def shown(page) -> str:
    return page.locator("#item").get_attribute("data-clip")


def says(page, text: str) -> None:
    page.locator("#said", has_text=text).wait_for()


def press(page, key: str, then_shows: str) -> None:
    """Press a key and wait for the clip that it leads to."""
    page.keyboard.press(key)
    page.locator(f'#item[data-clip="{then_shows}"]').wait_for()


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_reviewing_by_keyboard(site, page, mistaken, accessible, screenshot, scheme):
    page.emulate_media(color_scheme=scheme)
    with Catalog.open(mistaken) as catalog:
        queue = review(catalog).to_pylist()
    first, second, third = queue[:3]
    page.goto(f"{site}/review")
    page.wait_for_selector(".motionary-player canvas")
    page.wait_for_timeout(300)
    assert shown(page) == first["clip_id"]
    accessible(page)
    screenshot(page, f"review-{scheme}", full_page=True)

    press(page, "n", second["clip_id"])
    press(page, "ArrowRight", third["clip_id"])
    press(page, "b", second["clip_id"])
    press(page, "ArrowLeft", first["clip_id"])

    press(page, "a", second["clip_id"])
    says(page, f"{first['clip_id']} is called {first['suggested']}")
    assert labels(mistaken) == {first["clip_id"]: first["suggested"]}

    page.keyboard.press("r")
    assert page.locator(f'#known-labels option[value="{third["suggested"]}"]').count() == 1
    page.keyboard.type(third["suggested"][:2])  # the beginning of a known label is a label of its own
    press(page, "Enter", third["clip_id"])
    says(page, f"{second['clip_id']} is called {third['suggested'][:2]}")
    press(page, "s", queue[3]["clip_id"])
    says(page, f"{third['clip_id']} is called {third['current']}")
    assert labels(mistaken)[second["clip_id"]] == third["suggested"][:2]
    assert labels(mistaken)[third["clip_id"]] == third["current"]

    for one in (third, second, first):
        press(page, "u", one["clip_id"])
        says(page, f"undone: {one['clip_id']}")
        assert one["clip_id"] not in labels(mistaken)
    assert labels(mistaken) == {}
    accessible(page)


def test_the_list_of_keys_is_the_pages_own_and_esc_gives_them_back(site, page):
    page.goto(f"{site}/review")
    page.wait_for_selector(".motionary-player canvas")
    page.keyboard.press("?")
    keys = page.locator("dialog").inner_text()
    assert "the name stays" in keys
    assert "for comparison" not in keys
    page.keyboard.press("Escape")
    second = page.locator("#item").get_attribute("data-after").split("=")[1]
    page.locator("canvas").click()
    page.keyboard.press("Escape")
    page.keyboard.press("n")
    page.wait_for_url(f"**{second}")
    page.wait_for_selector(".motionary-player canvas")


def test_it_does_not_wait_for_the_publication(page, mistaken):
    """The next clip is there while the decision is on its way; what was refused stays listed."""
    inner, go_on = editor_of(mistaken), threading.Event()

    class Slow:
        user = "ada"

        def publish(self, changed) -> None:
            assert go_on.wait(60)
            inner.publish(changed)

    with served(mistaken, editor=Slow()) as client:
        page.goto(f"{client.base_url}/review")
        first = shown(page)
        second = page.locator("#item").get_attribute("data-waiting")
        page.keyboard.press("a")
        page.wait_for_url(f"**{second}")
        says(page, "being published")
        assert labels(mistaken) == {}
        go_on.set()
        says(page, f"{first} is called")
        page.locator("text=1 decided").wait_for()
        page.keyboard.press("u")
        says(page, "undone")
        page.goto("about:blank")  # a page that still fetches would tell that the server is gone


def test_what_goes_wrong_is_told_and_stays_told(site, chromium, mistaken):
    """A run writes the catalog. The console tells of the answer 409, so not the fixture `page`."""
    page = chromium.new_page()
    page.goto(f"{site}/review")
    first = shown(page)
    with the_only_writer(Store(mistaken), lambda dead: None):
        page.keyboard.press("a")
        says(page, "is being written by process")
    assert "is being written by process" in page.locator("#failed li").inner_text()
    page.locator("#failed a").click()
    page.wait_for_selector(f'#item[data-clip="{first}"]')
    assert labels(mistaken) == {}
    page.context.close()


def test_somebody_elses_change_is_not_undone(site, chromium, mistaken):
    page = chromium.new_page()
    page.goto(f"{site}/review")
    first = shown(page)
    page.keyboard.press("a")
    says(page, f"{first} is called")
    relabel(mistaken, {first: "theirs"}, "grace").close()
    page.keyboard.press("u")
    says(page, "was changed by somebody else")
    assert labels(mistaken) == {first: "theirs"}
    relabel(mistaken, {first: None}, "grace").close()
    page.context.close()


def test_read_only_shows_the_same_without_editing(page, mistaken, accessible):
    with served(mistaken) as client:
        page.goto(f"{client.base_url}/review")
        page.wait_for_selector(".motionary-player canvas")
        first = shown(page)
        for key in "akru":
            page.keyboard.press(key)
        says(page, "Read only")
        assert shown(page) == first
        assert page.locator("[data-does], #relabel, #undo").count() == 0
        page.keyboard.press("n")
        page.wait_for_function("first => document.getElementById('item').dataset.clip !== first", arg=first)
        accessible(page)
        page.goto("about:blank")
    assert labels(mistaken) == {}


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_a_file_that_is_chosen(site, page, demo_library, accessible, screenshot, scheme):
    page.emulate_media(color_scheme=scheme)
    page.goto(f"{site}/drop")
    accessible(page)
    page.set_input_files("#files", demo_library / WALK)
    page.wait_for_selector("#found .motionary-player canvas")
    assert page.locator("#found [data-beside]").count() == 8
    handle = "document.querySelector('#found .motionary-player').player"
    before = page.evaluate(f"[...{handle}.positions(1)].slice(0, 30)")
    page.locator("#found [data-beside]").nth(3).click()
    page.wait_for_function(
        "before => {const now = document.querySelector('#found .motionary-player').player.positions(1);"
        " return before.some((value, place) => value !== now[place])}",
        arg=before,
    )
    assert page.locator('#found [data-beside][aria-pressed="true"]').count() == 1
    page.wait_for_timeout(300)
    accessible(page)
    screenshot(page, f"dropped-{scheme}", full_page=True)


def test_a_file_that_is_dropped_on_the_page(site, page, demo_library):
    page.goto(f"{site}/drop")
    content = (demo_library / WALK).read_text()
    transfer = page.evaluate_handle(
        "text => { const data = new DataTransfer();"
        " data.items.add(new File([text], 'dropped <b>.bvh')); return data; }",
        content,
    )
    for event in ("dragenter", "dragover", "drop"):
        page.dispatch_event("#main", event, {"dataTransfer": transfer})
    page.wait_for_selector("#found .motionary-player canvas")
    assert page.locator("#found h2").first.inner_text() == "dropped <b>.bvh"
    assert WALK in page.locator("#found .card").first.inner_text()


def test_what_cannot_be_read_is_told(site, chromium, tmp_path):
    page = chromium.new_page()
    page.goto(f"{site}/drop")
    bad = tmp_path / "bad.bvh"
    bad.write_text("HIERARCHY\nROOT Hips\n{\n OFFSET 0 0\n")
    page.set_input_files("#files", bad)
    page.wait_for_selector("#found .wrong")
    assert "line 4" in page.locator("#found .wrong").inner_text()
    page.context.close()


def test_a_large_file_is_not_even_sent(site, page):
    page.goto(f"{site}/drop")
    asked = []
    page.on("request", lambda one: asked.append(one.url))
    page.evaluate(
        "() => { const data = new DataTransfer(); data.items.add(new File([new Uint8Array(65e6)], 'a.bvh'));"
        " const how = {dataTransfer: data, bubbles: true, cancelable: true};"
        " document.body.dispatchEvent(new DragEvent('drop', how)) }"
    )
    page.locator("#told", has_text="65.0 MB were given, and 32 MB are looked at").wait_for()
    assert not [url for url in asked if url.endswith("/drop")]


def test_another_sites_page_reads_and_changes_nothing(site, chromium, mistaken, tmp_path):
    """A page of another port of this machine, which cookies do not tell apart, tries what pages can."""

    class Evil(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *given):
            super().__init__(*given, directory=str(tmp_path))

        def log_message(self, *given):
            pass

    (tmp_path / "evil.html").write_text("<!DOCTYPE html><iframe id=frame></iframe><form id=form></form>")
    evil = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Evil)
    threading.Thread(target=evil.serve_forever, daemon=True).start()
    page = chromium.new_page()
    page.goto(f"http://127.0.0.1:{evil.server_port}/evil.html")
    clip = json.dumps({"clip": WALK, "label": "pwned"})
    tried = page.evaluate(
        """async ([site, clip]) => {
          const tells = (asked) => asked.then((one) => one.type + one.status, () => "refused");
          const sent = { method: "POST", body: clip, credentials: "include" };
          const headers = { "Content-Type": "application/json" };
          const frame = document.getElementById("frame");
          const loaded = new Promise((done) => { frame.onload = done; setTimeout(done, 3000); });
          frame.src = site + "/review";
          await loaded;
          const script = (url) => new Promise((done) => {
            const one = document.createElement("script");
            one.onload = () => done("ran"); one.onerror = () => done("refused"); one.src = url;
            document.head.append(one);
          });
          let inside;
          try { inside = frame.contentDocument ? "empty" : "other"; } catch { inside = "other"; }
          return {
            read: await tells(fetch(site + "/data/search?q=walk")),
            plain: await tells(fetch(site + "/edit/relabel", { ...sent, mode: "no-cors" })),
            json: await tells(fetch(site + "/edit/relabel", { ...sent, headers })),
            script: await script(site + "/static/review.js"),
            inside,
          };
        }""",
        [site, clip],
    )
    assert tried["read"] == tried["json"] == tried["script"] == "refused"
    assert tried["plain"] in ("opaque0", "refused")  # sent, and refused by the server
    page.evaluate(
        """(site) => { const form = document.getElementById("form");
          form.method = "post"; form.action = site + "/edit/relabel"; form.submit(); }""",
        site,
    )
    page.wait_for_url(f"{site}/**")
    assert "Only this server's own pages may ask for that" in page.inner_text("body")
    page.context.close()
    evil.shutdown()
    evil.server_close()
    assert labels(mistaken) == {}


def test_the_token_page(page, mistaken, accessible, screenshot, tmp_path: Path):
    token = "a-token-that-nobody-guesses"
    with served(mistaken, guard=Guard(token)) as client:
        page.goto(f"{client.base_url}/clusters?token={token}")
        assert page.url == f"{client.base_url}/clusters"
        assert page.context.cookies()[0]["httpOnly"]
        assert page.evaluate("document.cookie") == ""
        page.goto(f"{client.base_url}/review")
        assert shown(page)
        page.goto("about:blank")
