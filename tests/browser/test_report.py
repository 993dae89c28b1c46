"""The report in a real browser: takes play, charts are drawn, nothing is fetched, keys find their way."""

import json

import pytest

from motionary.catalog import Catalog
from motionary.catalog.views.report.page import report_page
from motionary.pipeline.config import PipelineConfig
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

HOSTILE = "\"><img src=x onerror=alert(1)>'\u202eשלום " + "long " * 40 + ".bvh"
FIRST = ".card button.take"
OPENED = """() => { const [own] = performance.getEntriesByType('navigation');
  const paint = performance.getEntriesByName('first-contentful-paint')[0];
  return { load: own.loadEventEnd, interactive: own.domInteractive, paint: paint.startTime }; }"""


@pytest.fixture(scope="module")
def demo_report(demo_catalog, tmp_path_factory):
    file = tmp_path_factory.mktemp("report") / "report.html"
    file.write_text(report_page(Catalog.open(demo_catalog)))
    return file


@pytest.fixture
def opened(page):
    """Return a way of opening a report; the answer is the page when its script has run."""

    def show(file):
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready]")
        return page

    return show


def state(page, stage):
    return page.evaluate("id => document.getElementById(id).player?.state", stage)


def drawn(page, name):
    """Scroll to a chart and wait until it is there."""
    page.locator(f"#{name}").scroll_into_view_if_needed()
    page.wait_for_selector(f"#{name} .main-svg")


def test_takes_play_beside_the_reference(opened, demo_report, screenshot):
    page = opened(demo_report)
    assert page.locator("canvas").count() == 0  # none before one is asked for
    reference, tightest = page.locator(FIRST).nth(0), page.locator(FIRST).nth(1)
    stage = reference.get_attribute("data-stage")
    reference.click()
    page.wait_for_function("id => document.getElementById(id).player.state.time > 0", arg=stage)
    assert len(page.evaluate("id => document.getElementById(id).player.figures", stage)) == 1
    tightest.click()
    page.wait_for_function("id => document.getElementById(id).player.state.time > 0.2", arg=stage)
    assert page.locator("canvas").count() == 1
    names = page.evaluate("id => document.getElementById(id).player.figures.map(one => one.name)", stage)
    held = json.loads(page.locator("#figures").text_content())
    assert [held[name] for name in names] == tightest.get_attribute("data-figures").split()
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Time").fill("0.5")
    page.get_by_role("button", name="Aligned").click()
    shown = state(page, stage)
    assert (shown["playing"], shown["aligned"]) == (False, True)
    screenshot(page, "card")
    page.get_by_role("button", name="Close").click()
    assert page.locator("canvas").count() == 0
    assert tightest.evaluate("one => one === document.activeElement")


def test_only_so_many_players_live_at_once(opened, demo_report):
    page = opened(demo_report)
    for card in page.locator(".card").all()[:8]:
        card.locator("button.take").first.click()
    assert page.locator("canvas").count() == 6
    assert page.locator(".card").first.locator("canvas").count() == 0
    assert page.locator(".take[aria-expanded]").count() == 6


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
def test_charts_are_drawn_when_they_are_seen(opened, demo_report, page, screenshot, scheme):
    page.emulate_media(color_scheme=scheme)
    opened(demo_report)
    assert page.evaluate("typeof Plotly") == "undefined"
    screenshot(page, f"top-{scheme}")
    for name in ("map-chart", "labels-chart", "dendrogram-chart", "thresholds-chart"):
        drawn(page, name)
        screenshot(page, f"{name}-{scheme}")


def test_a_point_of_the_map_plays_its_clip(opened, demo_report):
    page = opened(demo_report)
    drawn(page, "map-chart")
    held = json.loads(page.locator("#figures").text_content())
    points = "{ points: [{ customdata: clip }] }"
    press = f"clip => document.getElementById('map-chart').emit('plotly_click', {points})"
    page.evaluate(press, next(iter(held)))
    page.wait_for_function("document.getElementById('map-stage').player.state.duration > 0")
    page.evaluate(press, "another clip")
    assert "The page does not hold another clip" in page.locator("#map-said").text_content()


@pytest.mark.parametrize("width", [1280, 400])
def test_it_is_accessible(opened, demo_report, page, accessible, screenshot, width):
    page.set_viewport_size({"width": width, "height": 800})
    opened(demo_report)
    page.locator(FIRST).nth(1).click()
    page.locator("summary").nth(1).click()
    drawn(page, "map-chart")
    accessible(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.evaluate("scrollTo(0, 0)")
    screenshot(page, str(width))


def test_keys_lead_to_the_content_and_play(opened, demo_report):
    page = opened(demo_report)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the content"
    page.keyboard.press("Enter")
    assert page.url.endswith("#main")
    page.locator(FIRST).first.focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("canvas")


def test_print_leaves_out_what_cannot_be_printed(opened, demo_report, page):
    opened(demo_report)
    page.locator(FIRST).first.click()
    page.emulate_media(media="print")
    assert not page.locator("nav").is_visible()
    assert not page.locator("canvas").is_visible()
    assert page.locator(".card .still").first.is_visible()
    assert page.locator("#dendrogram-chart").bounding_box()["height"] < 100


def test_hostile_names_are_shown_as_text(opened, demo_library, silent_progress, page, tmp_path):
    library = tmp_path / "library"
    library.mkdir()
    names = [f"{k}{HOSTILE}" for k in range(3)]
    for name, file in zip(names, sorted((demo_library / "walk").glob("*.bvh")), strict=False):
        (library / name).write_bytes(file.read_bytes())
    job = Job(
        [str(library)], str(tmp_path / "catalog"), PipelineConfig(), label_pattern="(?P<action><img[^>]*>)"
    )
    run(job, silent_progress)
    file = tmp_path / "report.html"
    file.write_text(report_page(Catalog.open(job.catalog)))
    said = []
    page.on("dialog", lambda one: (said.append(one.message), one.dismiss()))
    opened(file)
    page.locator(FIRST).nth(1).click()
    drawn(page, "map-chart")
    drawn(page, "dendrogram-chart")
    assert page.locator("img").count() == 0
    assert names[0] in page.locator("main").inner_text()
    assert said == []


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_library_of_real_clips_opens_at_once(
    opened, shared_data, silent_progress, page, screenshot, tmp_path
):
    job = Job([str(shared_data)], str(tmp_path / "catalog"), PipelineConfig(), shared_data / "labels.csv", 2)
    run(job, silent_progress)
    catalog = Catalog.open(job.catalog)
    file = tmp_path / "report.html"
    file.write_text(report_page(catalog))
    assert file.stat().st_size < 10_000_000
    opened(file)
    times = page.evaluate(OPENED)
    print(f"{len(catalog.clips)} clips, {file.stat().st_size / 1e6:.1f} MB, milliseconds to {times}")
    held = json.loads(page.locator("#figures").text_content())
    for row in catalog.clusters.to_pandas().sort_values("distance_to_reference").groupby("cluster_id"):
        others = row[1].loc[~row[1]["is_reference"], "clip_id"].tolist()
        assert {*row[1].loc[row[1]["is_reference"], "clip_id"], *others[:1], *others[-1:]} <= held.keys()
    for button in page.locator(".card button.take").all()[::5]:
        button.click()
        stage = button.get_attribute("data-stage")
        page.wait_for_function("id => document.getElementById(id).player.state.time > 0", arg=stage)
    screenshot(page, "real")
