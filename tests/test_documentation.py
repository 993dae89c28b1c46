"""The documentation says what the code says: what is made of the code is whole, and what is written holds."""

import json
import os
import posixpath
import re
import shutil
import subprocess
import sys
from importlib import import_module
from inspect import isclass, isroutine
from pathlib import Path

import nbformat
import numpy as np
import pytest
import typer
from markdown_it import MarkdownIt

from motionary.catalog import Catalog
from motionary.catalog.schema import PUBLISHED, SCHEMAS
from motionary.workflows.cli import app
from motionary.workflows.documentation import links
from motionary.workflows.documentation.command_text import commands, commands_text
from motionary.workflows.documentation.contact_sheet import contact_sheet
from motionary.workflows.documentation.making import asked, made, makers
from motionary.workflows.documentation.markdown import plain
from motionary.workflows.documentation.pictures import PICTURES, picture_text
from motionary.workflows.documentation.python_text import python_text
from motionary.workflows.documentation.rendered_notebooks import kept
from motionary.workflows.documentation.site import build_site
from motionary.workflows.documentation.staging import HERE, pages, readmes
from motionary.workflows.documentation.table_text import tables_text
from motionary.workflows.errors import UserError

ROOT = Path(__file__).resolve().parents[1]
PAGES = dict(pages(ROOT))
BLOCK = r"```{code-block} (\w+)\n:caption: (\S+)\n\n(.*?)\n```"
EVERY_PAGE = pytest.mark.parametrize("page", PAGES)

PUBLIC = {  # names that users import
    "pipeline.readers": ["read_motion", "ReadError"],
    "pipeline.motion": ["Motion", "Skeleton"],
    "pipeline.features": ["motion_features"],
    "pipeline.distances": [
        *("THRESHOLDS", "cost_matrix", "dtw_distance", "dtw_path", "bidirectional_dtw_distance"),
        *("similar_zones", "segment_dtw_distance", "dtw_curve", "weighted_distance", "fuzzy_distance"),
        "pairwise_distances",
    ],
    "pipeline.clustering": ["complete_linkage", "fuzzy_linkage", "cut_tree", "threshold_strips"],
    "pipeline.evaluation": ["reward_punish", "path_error", "path_deviation", "kendall_tau_similarity"],
    "pipeline.alignment": [
        *("Warp", "uniform", "dtw", "cotw", "cotw_search", "similarity_index", "select_reference"),
        *("derivative_dtw", "canonical_time_warping", "iterative_motion_warping", "adaptive_dtw"),
        *("generalized_time_warping", "OnlineAligner"),
    ],
    "pipeline.style": ["residual", "StyleSpace", "transfer"],
    "catalog": ["Catalog", "CatalogError"],
    "catalog.selection": ["Selection"],
    "catalog.explanation": ["Explanation"],
}


def test_every_table_and_column_is_told_with_type_unit_and_meaning():
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^\(table-|\Z)", tables_text(), re.M | re.S))
    assert list(sections) == list(PUBLISHED)
    for name, section in sections.items():
        rows = [re.split(r"(?<!\\)\|", line)[1:-1] for line in section.splitlines() if line[:3] == "| `"]
        assert [row[0].strip() for row in rows] == [f"`{column}`" for column in SCHEMAS[name].names]
        for field, (_, type_, unit, meaning) in zip(SCHEMAS[name], rows, strict=True):
            assert type_.strip()
            assert unit.strip() == plain((field.metadata or {}).get(b"unit", b"").decode())
            assert meaning.strip().startswith(plain(field.metadata[b"meaning"].decode()))
            assert ("may be null" in meaning) == field.nullable


def test_every_command_is_told_with_its_options_and_examples():
    text = commands_text()
    group = typer.main.get_command(app)
    assert {words[1] for words, _ in commands()} == set(group.commands)
    for words, command in commands():
        _, _, section = text.partition(f"\n## {' '.join(words)}\n")
        section = section.split("\n## ")[0]
        assert f"```text\n{' '.join(words)} " in section
        for option in command.params:
            own = option.opts[0].startswith("-") or option.metavar is None
            for name in [*option.opts, *option.secondary_opts] if own else [option.metavar]:
                row = rf"^\| `[^`]*{re.escape(name)}(?![\w-])"
                assert re.search(row, section, re.M | re.I), (words, name)
        assert f"$ {' '.join(words)}" in section


def test_public_names_have_their_docstrings_on_a_page():
    shown = set()
    for text in PAGES.values():
        for what, *arguments in asked(text):
            if what == "python":
                entries = re.findall(r"auto\w+:: ([\w.]+)", python_text(*arguments))
                assert entries
                assert not shown & set(entries), "told twice"
                shown |= set(entries)
    for module, names in PUBLIC.items():
        assert {f"motionary.{module}.{name}" for name in names} <= shown


def test_what_is_shown_of_python_has_docstrings():
    for text in PAGES.values():
        for _, module, *names in (one for one in asked(text) if one[0] == "python"):
            held = import_module(module)
            for name in names or held.__all__:
                value = getattr(held, name)
                assert value.__doc__ or not (isclass(value) or isroutine(value)), (module, name)


def test_every_picture_is_on_a_page_and_every_page_asks_for_what_is_there(demo_catalog):
    known = makers(ROOT, demo_catalog)
    wanted = [one for text in PAGES.values() for one in asked(text)]
    assert {what for what, *_ in wanted} == known.keys()
    assert {arguments[0] for what, *arguments in wanted if what == "picture"} == PICTURES.keys()
    left = [
        text for text in PAGES.values() if "<!-- make" in re.sub(r"^<!-- make: .* -->$", "", text, flags=re.M)
    ]
    assert not left, "a line that asks for something has nothing else in it"
    with pytest.raises(KeyError, match="nothing"):
        made("<!-- make: nothing -->", known)


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_made(name, opened_demo):
    text = picture_text(opened_demo, name)
    assert 'class="plotly-graph-div"' in text or 'class="motionary-player"' in text
    assert not re.search(r'(?:src|href)="https?:', text)


def test_players_of_one_page_are_told_apart(opened_demo):
    made = "".join(picture_text(opened_demo, name) for name in ("walks", "runs", "aligned-pair", "residual"))
    ids = re.findall(r'<div class="motionary-player" id="([^"]*)"', made)
    assert ids == ["picture-walks", "picture-runs", "picture-aligned-pair", "picture-residual"]


@pytest.fixture(scope="module")
def opened_demo(demo_catalog):
    """Open the catalog of the embedded library."""
    with Catalog.open(demo_catalog) as catalog:
        yield catalog


@EVERY_PAGE
def test_a_page_names_only_what_exists(page):
    text = re.sub(BLOCK, "", PAGES[page], flags=re.S)  # what these make is tried below
    for name in re.findall(r"\bmotionary\.(?:pipeline|catalog|workflows)[\w.]*\w", text):
        assert is_there(name), name
    for path in re.findall(r"`((?:pipeline|catalog|workflows|tests)/[\w./]*)`", text):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"`(readers/\w+\.py)`", text):
        assert (ROOT / "pipeline" / path).exists(), path
    known = {words[1] for words, _ in commands()}
    assert set(re.findall(r"`motionary ([a-z]+)[ `]", text)) <= known
    options = {name for _, one in commands() for option in one.params for name in option.opts}
    options |= {name for _, one in commands() for option in one.params for name in option.secondary_opts}
    assert set(re.findall(r"`(?:run )?(--[a-z-]+)`", text)) <= options


def is_there(name: str) -> bool:
    module, _, last = name.rpartition(".")
    try:
        return hasattr(import_module(module), last) or bool(import_module(name))
    except ImportError:
        return False


@EVERY_PAGE
def test_the_links_of_a_page_lead_to_pages(page):
    targets = {*PAGES, *readmes(ROOT)}
    for link in re.findall(r"\]\(([^)#\s]+\.md)\)", PAGES[page]):
        assert posixpath.normpath(posixpath.join(posixpath.dirname(page), link)) in targets, link
    made_anchors = {f"table-{name}" for name in PUBLISHED} | {"-".join(words) for words, _ in commands()}
    assert set(re.findall(r"\]\(#([\w-]+)\)", PAGES[page])) <= made_anchors


@pytest.mark.parametrize("readme", readmes(ROOT))
def test_the_links_of_a_readme_hold_on_the_site_too(readme):
    text = (ROOT / readme).read_text(encoding="utf-8")
    shown = {links.page_of(source) for source in links.linked_sources(text, readme, ROOT)}
    notebooks = {f"notebooks/{file.name}" for file in (ROOT / "notebooks").glob("*.ipynb")}
    for link in re.findall(r"\]\((?!\w+:|#)([^)#\s]+)", links.rewritten(text, readme, ROOT)):
        on_site = posixpath.normpath(posixpath.join(posixpath.dirname(readme), link))
        assert on_site in {*shown, *notebooks, *readmes(ROOT)}, link


def test_the_readmes_picture_is_of_the_embedded_library(demo_catalog):
    kept = (ROOT / HERE / "static" / "clusters.svg").read_text(encoding="utf-8")
    with Catalog.open(demo_catalog) as catalog:
        drawn = contact_sheet(catalog)
    number = r"-?\d+(?:\.\d+)?"
    assert re.sub(number, "#", kept) == re.sub(number, "#", drawn), "draw it anew: see contact_sheet.py"
    places = [[float(one) for one in re.findall(number, text)] for text in (kept, drawn)]
    np.testing.assert_allclose(*places, atol=0.11, err_msg="draw it anew: see contact_sheet.py")


def test_a_link_that_leads_nowhere_is_refused():
    with pytest.raises(FileNotFoundError, match="README.md links to gone.md, and there is no gone.md"):
        links.rewritten("[a](gone.md)", "README.md", ROOT)


def test_links_to_code_lead_to_a_page_that_shows_it():
    text = "[a](config.py) [b](readers) [c](writers) [d](#here) [e](https://example.org/x.py)"
    assert links.rewritten(text, "pipeline/README.md", ROOT) == (
        "[a](config.py.md) [b](readers/README.md) [c](writers/__init__.py.md) [d](#here) "
        "[e](https://example.org/x.py)"
    )
    picture = f"![a]({HERE}/static/clusters.svg)"
    assert links.rewritten(picture, "README.md", ROOT) == picture
    shown = links.source_page("pipeline/config.py", ROOT)
    assert (ROOT / "pipeline" / "config.py").read_text().rstrip() in shown


@pytest.mark.parametrize("text", ["a | b", "|h|", "*a* _b_ `c` <d> [e](f) $x$ # {g}", "two\nlines"])
def test_text_is_shown_as_it_stands(text):
    shown = MarkdownIt().render(f"x {plain(text)}")
    as_html = " ".join(text.split()).replace("<", "&lt;").replace(">", "&gt;")
    assert shown == f"<p>x {as_html}</p>\n"
    assert not re.search(r"(?<!\\)[|$]", plain(text)), "a cell would end, or an equation begin"


def test_a_rendered_notebook_wants_neither_kernel_nor_network():
    chart = {"data": [{"type": "scatter", "y": [1, 2]}], "layout": {}}
    widget = {"application/vnd.jupyter.widget-view+json": {"model_id": "1"}, "text/html": "<p>player</p>"}
    outputs = [
        nbformat.v4.new_output("display_data", data={"application/vnd.plotly.v1+json": chart}),
        nbformat.v4.new_output("display_data", data=widget),
        nbformat.v4.new_output("stream", text="said"),
    ]
    cells = [nbformat.v4.new_markdown_cell("words"), nbformat.v4.new_code_cell("code", outputs=outputs)]
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"widgets": {"state": {}}})
    shown, played, said = kept(notebook, "01_first").cells[1].outputs
    assert "widgets" not in notebook.metadata
    assert list(shown.data) == ["text/html"]
    assert 'id="01_first-0"' in shown.data["text/html"]
    assert "<script src" not in shown.data["text/html"]
    assert played.data == {"text/html": "<p>player</p>"}
    assert said.text == "said"


def test_every_readme_has_its_place_on_the_site():
    entries = re.findall(r"^(?:.*<)?([\w/]*README)>?$", PAGES["index.md"], re.M)
    assert sorted(f"{one}.md" for one in entries) == sorted(readmes(ROOT))


def test_a_folder_of_something_else_is_not_replaced(tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(UserError, match="name another folder"):
        build_site(ROOT, tmp_path)
    with pytest.raises(UserError, match="in the root of the repository"):
        build_site(tmp_path, tmp_path / "site")
    assert (tmp_path / "thesis.tex").read_text() == "mine"


def blocks(page: str) -> list[tuple[str, str, str]]:
    """List the captioned blocks of a page: language, caption, text."""
    return re.findall(BLOCK, PAGES[page], re.S)


def changed(text: str, diff: str) -> str:
    """Do what a block of removed and added lines asks for; the removed ones must stand there."""
    lines = diff.splitlines()
    removed = "\n".join(line[1:] for line in lines if line[0] == "-")
    added = "\n".join(line[1:] for line in lines if line[0] == "+")
    assert text.count(removed + "\n") == 1, f"the page would replace what is not there: {removed}"
    return text.replace(removed, added)


READ_IT = """
import json, sys
from motionary.pipeline import readers
from motionary.pipeline.readers import ReadError, read_motion, scan_library

motion = read_motion("library/one.take")
faults = []
for name in sys.argv[1:]:
    try:
        read_motion(name)
    except ReadError as error:
        faults.append([error.line, error.what, error.mend])
print(json.dumps({
    "from": readers.__file__, "positions": motion.positions().tolist(),
    "rotations": motion.rotations.round(3).tolist(), "fps": motion.fps, "unit": motion.unit, "faults": faults,
    "clips": [[one.clip_id, one.format] for one in scan_library("library")],
}))
"""


def test_the_steps_to_a_reader_make_a_reader(tmp_path):
    for top in ("pipeline", "catalog"):
        shutil.copytree(
            ROOT / top, tmp_path / "motionary" / top, ignore=shutil.ignore_patterns("__pycache__")
        )
    library = tmp_path / "library"
    library.mkdir()
    for language, caption, text in blocks("how_to/add_a_reader.md"):
        file = library / caption if language == "json" else tmp_path / "motionary" / caption
        file.write_text(changed(file.read_text(), text) if language == "diff" else text + "\n")
    text = (library / "one.take").read_text()
    for name, bad in (
        ("cut.take", text[:-3]),
        ("less.take", "{}"),
        ("words.take", text.replace("90", '"a"')),
    ):
        (tmp_path / name).write_text(bad)
    call = [sys.executable, "-c", READ_IT, "cut.take", "less.take", "words.take", "gone.take"]
    told = subprocess.run(
        call, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, check=False
    )
    assert told.returncode == 0, told.stderr.decode()
    answer = json.loads(told.stdout)
    assert Path(answer["from"]).is_relative_to(tmp_path), "the project was read, not the changed copy"
    assert answer["positions"] == [[[0, 90, 0]], [[1, 90, 0]]]
    assert answer["rotations"] == [[[0, 0, 0, 1]], [[0, 0.707, 0, 0.707]]]
    assert (answer["fps"], answer["unit"]) == (60, 0.01)
    assert answer["clips"] == [["one.take", "take"]]
    assert [line for line, _, _ in answer["faults"]] == [3, None, None, None]
    assert all(what and mend for _, what, mend in answer["faults"])


def test_the_aligner_of_the_page_aligns():
    (text,) = [
        text for _, caption, text in blocks("how_to/add_an_aligner.md") if caption == "by_path_length.py"
    ]
    names: dict = {"__name__": "by_path_length"}
    exec(text, names)
    reference = np.sin(np.linspace(0, 6, 40))[:, None] * np.arange(1, 4)
    moving = np.repeat(reference, 2, axis=0)  # each pose held for two frames
    warp = names["by_path_length"](moving, reference)
    assert warp.apply(moving) == pytest.approx(reference, abs=1e-6)
    with pytest.raises(ValueError, match="DOFs"):
        names["by_path_length"](moving, reference[:, :2])
