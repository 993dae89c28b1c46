"""A real browser for the pages: headless Chromium, driven by Playwright, cut off from every other host."""

import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

HOW = "install Debian's package chromium, or name a Chromium or Chrome by MOTIONARY_CHROMIUM"
FLAGS = [
    "--no-sandbox",  # as root, which CI is, Chromium has none
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-quic",
    "--disable-sync",
]
OURS = {"127.0.0.1", "localhost"}


@pytest.fixture(scope="session")
def chromium() -> Iterator:
    """Start a browser once, where there is one."""
    path = os.environ.get("MOTIONARY_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        pytest.skip(f"no browser: {HOW}")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def artefacts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return where screenshots are kept: MOTIONARY_ARTEFACTS, else with pytest's temporary files."""
    named = os.environ.get("MOTIONARY_ARTEFACTS")
    folder = Path(named) if named else tmp_path_factory.mktemp("artefacts")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture
def page(chromium) -> Iterator:
    """Open an empty page; the test fails by a console error or a request to another host."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    shown = context.new_page()
    faults: list[str] = []
    shown.on("console", lambda one: faults.append(f"console: {one.text}") if one.type == "error" else None)
    shown.on("pageerror", lambda error: faults.append(f"uncaught: {error}"))
    context.on("request", lambda one: faults.extend(_elsewhere(one.url)))
    yield shown
    context.close()
    assert faults == []


def _elsewhere(url: str) -> list[str]:
    parts = urlsplit(url)
    own = parts.scheme in ("file", "data", "blob", "about") or parts.hostname in OURS
    return [] if own else [f"request to {url}"]


@pytest.fixture
def screenshot(artefacts: Path, request: pytest.FixtureRequest) -> Callable:
    """Return a way of keeping a picture of a page, named after the test."""

    def keep(page, name: str, **options: object) -> Path:
        file = artefacts / f"{re.sub(r'[^a-z0-9]+', '-', request.node.name.lower())}-{name}.png"
        page.screenshot(path=file, **options)
        return file

    return keep


@pytest.fixture(scope="session")
def accessible() -> Callable:
    """Return a check by axe that a page has no serious or critical fault; it tells what it found."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()

    def check(page) -> None:
        found = axe.run(page).response["violations"]
        serious = [
            f"{one['id']}: {one['help']}: {node['html'][:160]}"
            for one in found
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"]
        ]
        assert serious == []

    return check
