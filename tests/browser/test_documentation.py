"""The documentation site, built and opened from its files as a reader would: no server, no network."""

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import unquote, urldefrag, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]
KINDS = (
    "index.html",
    "algorithms/distances.html",
    "how_to/add_a_reader.html",
    "notebooks/01_explore_clusters.html",
    "reference/commands.html",
    "reference/python/catalog.html",
    "reference/tables.html",
    "search.html",
)

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def site(chromium, tmp_path_factory) -> Path:
    """Build the site once, as `make docs` does."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    build = [sys.executable, "-m", "motionary.workflows.documentation", str(folder)]
    told = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert told.stderr == ""
    return folder


def test_every_link_leads_somewhere_and_every_page_is_reached(site, page):
    seen: dict[str, set[str]] = {}
    links: list[tuple[str, str]] = []
    waiting = [(site / "index.html").as_uri()]
    while waiting:
        address = waiting.pop()
        if address in seen:
            continue
        page.goto(address)
        seen[address] = set(page.evaluate("[...document.querySelectorAll('[id]')].map(one => one.id)"))
        for link in page.evaluate("[...document.links].map(one => one.href)"):
            if urlsplit(link).scheme == "file":
                links.append((address, link))
                target = urldefrag(link).url.partition("?")[0]
                if target.endswith(".html") and place(target).exists():
                    waiting.append(target)
    for address, link in links:
        target, fragment = urldefrag(link)
        assert place(target).is_file(), f"{address} links to {link}"
        ids = seen.get(target.partition("?")[0])
        assert not fragment or ids is None or unquote(fragment) in ids, f"{address} links to {link}"
    unlinked = {file.as_uri() for file in site.rglob("*.html")} - seen.keys()
    assert {place(one).name for one in unlinked} <= {"genindex.html", "search.html"}


def place(address: str) -> Path:
    return Path(unquote(urlsplit(address).path))


@pytest.fixture(scope="module")
def served(site) -> Iterator[str]:
    """Serve the site, for axe fetches its styles, and files may not be fetched."""

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *arguments: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=site)) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("kind", KINDS)
def test_pages_can_be_read_by_everybody(kind, scheme, served, page, accessible, screenshot):
    page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
    page.goto(f"{served}/{kind}")
    page.wait_for_load_state("load")
    screenshot(page, "seen")
    accessible(page)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_wider_than_a_telephone(kind, site, page, screenshot):
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto((site / kind).as_uri())
    screenshot(page, "narrow")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_players_play(site, page):
    page.goto((site / "index.html").as_uri())
    page.wait_for_function("document.querySelector('.motionary-player')?.player")
    page.evaluate("document.querySelector('.motionary-player').player.play()")
    page.wait_for_function("document.querySelector('.motionary-player').player.state.time > 0.1")


def test_players_of_a_notebook_play_without_its_kernel(site, page):
    page.goto((site / "notebooks" / "01_explore_clusters.html").as_uri())
    page.locator("iframe").first.scroll_into_view_if_needed()
    player = page.frame_locator("iframe").first.locator(".motionary-player")
    player.locator("canvas").wait_for()
    player.evaluate("one => one.player.play()")
    page.wait_for_timeout(300)
    assert player.evaluate("one => one.player.state.time") > 0


@pytest.mark.parametrize("kind", ["algorithms/clustering.html", "notebooks/01_explore_clusters.html"])
def test_charts_are_drawn(kind, site, page):
    page.goto((site / kind).as_uri())
    charts = page.locator(".plotly-graph-div")
    assert charts.count() > 2
    assert page.locator(".plotly-graph-div .main-svg").count() >= charts.count()


def test_the_site_can_be_searched(site, page):
    page.goto(f"{(site / 'search.html').as_uri()}?q=dendrogram")
    page.locator("#search-results li a").first.wait_for()
    assert page.locator("#search-results li a").count() > 2
