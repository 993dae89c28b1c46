"""Charts of pairs in a real browser: hostile names are shown as text, and hovering tells of what is there."""

import pytest

from motionary.catalog import Catalog
from motionary.catalog.views.charts import chart_html, plotly_script
from motionary.catalog.views.cost_matrix import cost_matrix_figure
from motionary.catalog.views.curve_chart import curve_figure
from motionary.catalog.views.dendrogram import dendrogram_figure
from motionary.catalog.views.page import page as html_page
from motionary.catalog.views.trajectory_chart import trajectory_figure
from motionary.catalog.views.warp_chart import warp_figure
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.synthetic import template
from motionary.pipeline.writers import write_bvh
from motionary.workflows.main_job import run
from motionary.workflows.preparation import Job

HOSTILE = ('<script>alert(1)</script>&"q"\'s %{x}.bvh', "<b>הליכה</b>.bvh")
SHOWN = "name => Array.from(document.querySelectorAll(`#${name} .main-svg text`), one => one.textContent)"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory, silent_progress):
    folder = tmp_path_factory.mktemp("hostile")
    for name, action in zip(HOSTILE, ("walk", "run"), strict=True):
        file = folder / "library" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        write_bvh(template(action), file)
    run(Job([str(folder / "library")], str(folder / "catalog"), PipelineConfig()), silent_progress)
    return Catalog.open(str(folder / "catalog"))


def show(page, figures):
    """Draw charts, one below the other, and return what is written in each."""
    charts = [chart_html(figure, name) for name, figure in figures.items()]
    page.set_content(html_page("charts", charts, plotly_script()))
    for name in figures:
        page.wait_for_selector(f"#{name} .main-svg")
    return {name: [plain(text) for text in page.evaluate(SHOWN, name)] for name in figures}


def plain(text):
    return text.replace("\u2068", "").replace("\u2069", "")


@pytest.mark.slow
def test_hostile_names_are_shown_as_they_are(page, screenshot, hostile):
    explanation = hostile.explain(*HOSTILE)
    figures = {
        "curve": curve_figure([explanation]),
        "cost": cost_matrix_figure(hostile, explanation, 0.55),
        "warp": warp_figure(hostile, HOSTILE),
        "trajectory": trajectory_figure(hostile, HOSTILE[1], "left_wrist"),
        "dendrogram": dendrogram_figure(hostile),
    }
    for name, texts in show(page, figures).items():
        for clip_id in HOSTILE if name != "trajectory" else HOSTILE[1:]:
            assert any(clip_id in text for text in texts), (name, texts)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        screenshot(page, scheme, full_page=True)


def test_hovering_a_warp_tells_the_clip_and_both_times(page, hostile):
    show(page, {"warp": warp_figure(hostile, HOSTILE[:1])})
    page.evaluate("Plotly.Fx.hover('warp', [{curveNumber: 2, pointNumber: 5}])")
    page.wait_for_selector("#warp .hoverlayer text")
    told = plain(page.locator("#warp .hoverlayer").text_content())
    assert HOSTILE[0] in told
    assert "s of the reference" in told
