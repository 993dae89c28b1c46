"""The page of an alignment in a real browser: it plays, charts are drawn, hostile names are shown as text."""

from dataclasses import replace

import pytest

from motionary.pipeline.synthetic import template
from motionary.pipeline.writers import write_bvh
from motionary.workflows.align_pair import align_pair, read_pair, write_alignment_page

HOSTILE = ("\"><img src=x onerror=alert(1)>'%{x}.bvh", "<b>הליכה</b>\u202e.bvh")
TEXTS = "name => Array.from(document.querySelectorAll(`#${name} .main-svg text`), one => one.textContent)"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a page of a run in the time of a walk, with hostile names, aligned by two methods."""
    folder = tmp_path_factory.mktemp("alignment")
    for name, action in zip(HOSTILE, ("run", "walk"), strict=True):
        (folder / name).parent.mkdir(exist_ok=True)
        write_bvh(template(action), folder / name)
    pair = read_pair(*(str(folder / name) for name in HOSTILE))
    named = (
        replace(one, name=name) for one, name in zip((pair.moving, pair.reference), HOSTILE, strict=True)
    )
    pair = replace(pair, **dict(zip(("moving", "reference"), named, strict=True)))
    file = folder / "out.html"
    write_alignment_page(align_pair(pair, ["dtw", "cotw"]), file)
    return file


@pytest.fixture
def opened(page, made):
    page.goto(made.as_uri())
    for name in ("warps-chart", "ways-chart"):
        page.wait_for_selector(f"#{name} .main-svg")
    page.locator("#player").scroll_into_view_if_needed()
    page.wait_for_selector("#player[data-mounted=yes]")
    return page


def test_names_are_shown_as_they_are(opened):
    short = [name.split("/")[-1] for name in HOSTILE]
    for name in short:
        assert opened.locator("h1 bdi, .quiet bdi", has_text=name).count() == 1
        assert opened.locator(".player .name, .player bdi", has_text=name).count()
    assert opened.title() == f"{short[0]} in the time of {short[1]}"
    texts = [
        text.replace("\u2068", "").replace("\u2069", "") for text in opened.evaluate(TEXTS, "warps-chart")
    ]
    assert f"seconds of {HOSTILE[0]}" in texts
    assert any(HOSTILE[1].split("/")[-1] in text for text in texts)
    assert not opened.locator("main img").count()


def test_both_play_in_the_time_of_the_reference(opened):
    player = "document.getElementById('player').player"
    assert opened.evaluate(f"{player}.figures.map(one => one.name)")[1:] == ["DTW", "CoTW"]
    assert opened.evaluate(f"{player}.state.aligned")
    aligned = opened.evaluate(f"{player}.duration")
    opened.get_by_role("button", name="Play").click()
    opened.wait_for_function(f"{player}.state.time > 0.1")
    opened.get_by_role("button", name="Pause").click()
    opened.get_by_role("button", name="Aligned").click()
    longest = opened.evaluate(f"Math.max(...{player}.figures.map(one => one.seconds))")
    assert opened.evaluate(f"{player}.duration") == pytest.approx(longest)
    assert aligned == pytest.approx(opened.evaluate(f"{player}.figures[0].seconds"), abs=1 / 30)


def test_hovering_a_warp_tells_both_times(opened):
    opened.locator("#warps-chart").scroll_into_view_if_needed()
    opened.evaluate("Plotly.Fx.hover('warps-chart', [{curveNumber: 5, pointNumber: 7}])")
    opened.wait_for_selector("#warps-chart .hoverlayer text")
    told = opened.locator("#warps-chart .hoverlayer").text_content()
    assert "s of the reference" in told
    assert "DTW" in told


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.slow)])
@pytest.mark.parametrize("width", [400, 1200])
def test_it_fits_and_is_accessible(page, made, accessible, screenshot, width, scheme):
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    page.goto(made.as_uri())
    page.wait_for_selector("#ways-chart .main-svg")
    page.locator("#player").scroll_into_view_if_needed()
    page.wait_for_selector("#player[data-mounted=yes]")
    page.locator("summary").click()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    accessible(page)
    screenshot(page, f"{width}-{scheme}", full_page=True)
