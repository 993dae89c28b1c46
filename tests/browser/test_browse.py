"""The pages in a real browser: reading, playing, searching, comparing, by mouse and by keys."""

from urllib.parse import urlencode

import pytest

from motionary.catalog import Catalog
from tests.web.hostile import NAMES, hostile_catalog
from tests.web.serving import served

WALK, RUN = "walk/walk_tired_alex_01.bvh", "run/run_tired_bea_01.bvh"
DRAWN = "[...document.querySelectorAll('[data-chart]')].every((one) => one.dataset.drawn)"


@pytest.fixture(scope="module")
def base(demo_catalog):
    with served(demo_catalog) as client:
        yield str(client.base_url)


@pytest.fixture(scope="module")
def hostile(demo_library, tmp_path_factory, silent_progress):
    folder = tmp_path_factory.mktemp("hostile")
    with served(hostile_catalog(demo_library, folder, silent_progress)) as client:
        yield str(client.base_url)


def clip_url(base: str, clip_id: str) -> str:
    return f"{base}/clip?{urlencode({'id': clip_id})}"


def every_page(base: str, a: str, b: str) -> dict[str, str]:
    return {
        "start": f"{base}/",
        "clusters": f"{base}/clusters",
        "cluster": f"{base}/cluster?id=1",
        "search": f"{base}/search?{urlencode({'q': 'bvh', 'with': a})}",
        "wrong": f"{base}/search?{urlencode({'where': 'secs > 3'})}",
        "clip": clip_url(base, a),
        "compare": f"{base}/compare?{urlencode({'a': a, 'b': b})}",
        "choose": f"{base}/compare?{urlencode({'a': a})}",
        "map": f"{base}/map",
    }


def wait_until(page, condition: str) -> None:
    """Wait for a condition in the page, whose policy keeps Playwright from waiting inside it."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"never came: {condition}")


def settled(page) -> None:
    """Bring every chart and player into view, and wait for them."""
    for one in page.query_selector_all("[data-chart], .motionary-player"):
        one.scroll_into_view_if_needed()
        page.wait_for_timeout(50)
    wait_until(page, DRAWN)
    wait_until(page, "[...document.querySelectorAll('.motionary-player')].every((one) => one.player)")
    page.evaluate("scrollTo(0, 0)")


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_every_page_is_accessible_and_fits_a_telephone(base, page, scheme, accessible, screenshot):
    page.emulate_media(color_scheme=scheme)
    for name, url in every_page(base, WALK, RUN).items():
        page.set_viewport_size({"width": 1280, "height": 900})
        page.goto(url)
        settled(page)
        accessible(page)
        screenshot(page, f"{name}-{scheme}", full_page=True)
        page.set_viewport_size({"width": 400, "height": 800})
        page.goto(url)
        settled(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= 400, name
        screenshot(page, f"{name}-{scheme}-narrow")


@pytest.mark.slow
def test_hostile_names_run_nothing_and_fit(hostile, page, accessible, screenshot):
    said = []
    page.on("dialog", lambda one: (said.append(one.message), one.dismiss()))
    page.set_viewport_size({"width": 400, "height": 800})
    for a, b in zip(NAMES, NAMES[1:] + NAMES[:1], strict=True):
        for name, url in every_page(hostile, a, b).items():
            if a is not NAMES[0] and name not in ("clip", "compare", "search"):
                continue
            page.goto(url)
            settled(page)
            assert page.evaluate("document.documentElement.scrollWidth") <= 400, (name, a)
        page.goto(clip_url(hostile, a))
        page.fill("#q", a.split("/")[-1].split()[0])
        page.wait_for_selector("[role=option]")
        page.goto(clip_url(hostile, a))
        page.keyboard.press("c")
        page.keyboard.press("p")
        page.wait_for_selector("dialog canvas")
        assert page.inner_text("dialog h2").replace("\n", "") == a
    accessible(page)
    screenshot(page, "playing")
    assert said == []


def test_a_clip_plays_beside_its_reference_and_aligned(base, page):
    page.goto(clip_url(base, WALK))
    settled(page)
    player = "document.querySelector('.motionary-player').player"
    page.evaluate(f"{player}.play()")
    wait_until(page, f"{player}.state.time > 0")
    page.evaluate(f"{player}.pause()")
    page.evaluate(f"{player}.seek(1)")
    before = page.evaluate(f"[...{player}.positions(1)]")
    page.get_by_role("button", name="Aligned").first.click()
    assert page.evaluate(f"{player}.state.aligned")
    page.evaluate(f"{player}.seek(1)")
    assert page.evaluate(f"[...{player}.positions(1)]") != before


def test_one_types_is_suggested_clips_and_opens_one(base, page):
    page.goto(base)
    page.keyboard.press("/")
    page.keyboard.type("walk tired", delay=20)
    # Of all that was typed: what comes for its beginning is replaced, and with it what is chosen.
    page.wait_for_selector("[role=option]:has-text('tired')")
    page.keyboard.press("ArrowDown")
    chosen = page.inner_text("[role=option][aria-selected=true]")
    with page.expect_navigation():
        page.keyboard.press("Enter")
    assert page.inner_text("h1") == chosen


def test_a_search_can_be_gone_through_by_keys(base, page):
    page.goto(f"{base}/search?q=walk")
    clips = page.eval_on_selector_all("li[data-clip]", "all => all.map((one) => one.dataset.clip)")
    here = "document.activeElement.closest('[data-clip]')?.dataset.clip"
    for key, at in (("j", 0), ("j", 1), ("ArrowRight", 2), ("k", 1), ("ArrowLeft", 0)):
        page.keyboard.press(key)
        assert page.evaluate(here) == clips[at]
    page.keyboard.press("ArrowDown")
    below = clips.index(page.evaluate(here))
    assert below > 1
    page.keyboard.press("ArrowUp")
    assert page.evaluate(here) == clips[0]
    page.keyboard.press("c")
    page.keyboard.press("j")
    page.keyboard.press("c")
    with page.expect_navigation():
        page.keyboard.press("C")
    assert page.input_value("input[name=a]") == clips[0]
    assert page.input_value("input[name=b]") == clips[1]


def test_keys_play_a_clip_and_tell_themselves(base, page):
    page.goto(f"{base}/search?q=walk")
    page.keyboard.press("j")
    page.keyboard.press("p")
    page.wait_for_selector("dialog [data-playing=true]")
    page.keyboard.press("Space")  # the player has the keys
    page.wait_for_selector("dialog [data-playing=false]")
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")
    page.keyboard.press("?")
    assert "mark the clip for comparison" in page.inner_text("dialog")
    page.keyboard.press("j")  # nothing moves behind it
    page.keyboard.press("Escape")
    with page.expect_navigation():
        page.keyboard.press("Enter")
    assert page.inner_text("h1") == page.evaluate("document.querySelector('h1').dataset.clip")


def test_letters_that_are_typed_are_no_keys(base, page):
    page.goto(f"{base}/search")
    page.click("form.ask input[name=where]")
    page.keyboard.type("j?c/p")
    assert page.input_value("form.ask input[name=where]") == "j?c/p"
    assert page.query_selector("dialog, .marked") is None


def test_marks_stay_from_page_to_page(base, page):
    page.goto(clip_url(base, WALK))
    page.get_by_role("button", name="Mark for comparison").click()
    page.goto(clip_url(base, RUN))
    assert WALK in page.inner_text(".marked")
    page.get_by_role("button", name="Mark for comparison").click()
    page.click(".marked [data-compare]")
    page.wait_for_url("**/compare?**")
    page.get_by_role("button", name="Clear").click()
    assert page.query_selector(".marked") is None


def test_a_comparison_shows_its_zones_at_the_threshold_chosen(base, page):
    page.goto(f"{base}/compare?{urlencode({'a': WALK, 'b': RUN})}")
    settled(page)
    title = "document.querySelector('[data-chart*=\"name=costs\"]').textContent"
    before = page.evaluate(title)
    page.get_by_label("Zones at threshold").select_option("0.55")
    wait_until(page, f"{title}.includes('0.55')")
    assert page.evaluate(title) != before


def test_a_click_on_the_map_plays_the_clip(base, page, demo_catalog):
    page.goto(f"{base}/map")
    settled(page)
    point = page.evaluate(
        "(() => { const one = document.querySelector('.scatterlayer .point').getBoundingClientRect();"
        " return [one.x + one.width / 2, one.y + one.height / 2]; })()"
    )
    page.mouse.move(*point)
    page.mouse.click(*point)
    page.wait_for_selector("dialog canvas")
    with Catalog.open(demo_catalog) as catalog:
        catalog.require(page.inner_text("dialog h2"))


def test_pages_can_be_read_without_script(base, chromium):
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(f"{base}/search?q=walk")
    assert page.locator("li[data-clip]").count() > 1
    page.locator("a.clip").first.click()
    assert "Nearest clips" in page.inner_text("main")
    assert "needs JavaScript" in page.inner_text("main")
    assert page.get_by_role("button", name="Play").count() == 0
    context.close()
