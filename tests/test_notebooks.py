"""Every notebook runs on the embedded library, says there what is so, and is kept without outputs."""

import shutil
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from motionary.catalog import Catalog, CatalogError
from motionary.workflows.errors import UserError
from motionary.workflows.notebook_catalog import catalog_of

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

CHECKS = {
    "01_explore_clusters": """
assert clusters["size"].sum() == len(catalog.clips) == 80
assert set(members["clip_id"]) >= {reference, furthest}
assert len({*spread}) == 2
written = {one.path for one in exported}
assert 0 < len(written) == len(plain) <= 3 * len(clusters)
assert all(one.is_file() for one in written)
""",
    "02_distances_explained": """
for name, curve in curves.items():
    assert (curve == [point.distance for point in {"a and b": kin, "a and c": stranger}[name].curve]).all()
    assert abs(by_hand.loc[name, "by these weights"] - by_hand.loc[name, "weighted"]) < 1e-12
assert 1 < len(zones) <= 12
assert abs(prices[cover].sum() - segment_dtw_distance(cost, level)) < 1e-9
assert abs(stored["weighted"][0].as_py() - stranger.distances["weighted"]) < 1e-5
nearer = summary.loc["a and c"] / summary.loc["a and b"]
assert nearer["weighted"] > 1.2 * nearer["DTW"]
""",
    "03_alignment_and_style": """
known = catalog.sql("select * from alignments where clip_id = ?", [moving]).to_pylist()[0]
assert known["reference_id"] == reference != moving
assert abs(warp.source_time - known["source_time"]).max() < 1e-3
assert warp.correlation > mean_correlation(even.apply(poses[moving]), poses[reference], weights) + 0.1
assert made.motion.frames == catalog.aligned(reference).frames
assert len({styled, onto, reference}) == 3
""",
    "04_label_a_library": """
right = [int(one["right"].sum()) for one in steps.values()]
wrong = [int(one["wrong"].sum()) for one in steps.values()]
assert right == sorted(right) and right[-1] > right[0] and wrong[-1] < wrong[0]
assert 0 < len(told) < len(clip_ids) / 3 and len(labels) == len(ANSWERS) + len(more)
assert answered["status"].tolist() == ["assigned"] * len(new)
assert changes.added["clip_id"].to_pylist() == [take.clip_id for take in new]
assert source.store.url not in catalog.store.url and not len(source.labels)
""",
}
"""What is so at a notebook's end, on the embedded library; asked in its kernel."""


@pytest.fixture(scope="module")
def working_folder(demo_catalog, tmp_path_factory):
    """Make a folder that holds the embedded library's catalog, as `motionary demo` leaves it."""
    folder = tmp_path_factory.mktemp("notebooks")
    (folder / "motionary-demo").symlink_to(Path(demo_catalog).resolve().parent)
    return folder


def execute(notebook, folder, **options):
    """Run a notebook, and what must be so at its end; return its cells that have code."""
    content = nbformat.read(notebook, as_version=4)
    content.cells.append(nbformat.v4.new_code_cell(CHECKS[notebook.stem]))
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(content, timeout=120, kernel_name="python3", resources=resources, **options).execute()
    return [cell for cell in content.cells if cell.cell_type == "code"]


def test_every_notebook_has_its_check():
    assert [*CHECKS] == [notebook.stem for notebook in NOTEBOOKS]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(notebook, working_folder, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # what it writes goes with the test
    cells = execute(notebook, working_folder)
    outputs = [one for cell in cells for one in cell.outputs]
    assert [one.text for one in outputs if one.output_type == "stream" and one.name == "stderr"] == []
    shown = [one.get("data", {}) for one in outputs]
    charts = [
        one["application/vnd.plotly.v1+json"] for one in shown if "application/vnd.plotly.v1+json" in one
    ]
    assert charts
    assert all(any(trace.get("z") or trace.get("x") for trace in chart["data"]) for chart in charts)
    players = [cell for cell in cells if cell.source.splitlines()[-1].startswith("play")]
    assert len(players) >= 1
    for cell in players:
        (made,) = (one["data"] for one in cell.outputs if "data" in one)
        assert "srcdoc=" in made["text/html"]
        assert "application/vnd.jupyter.widget-view+json" in made
    assert sorted(one.name for one in working_folder.iterdir()) == ["motionary-demo"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_is_pointed_elsewhere_by_one_variable(notebook):
    cells = [one for one in nbformat.read(notebook, as_version=4).cells if one.cell_type == "code"]
    assert cells[0].source.splitlines()[0] == 'LIBRARY = ""'
    used = [one for cell in cells[1:] for one in cell.source.splitlines() if "LIBRARY" in one]
    assert [one.partition(" = ")[2] for one in used] == ["catalog_of(LIBRARY)"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_is_kept_without_outputs(notebook):
    content = nbformat.read(notebook, as_version=4)
    code = [cell for cell in content.cells if cell.cell_type == "code"]
    assert [cell.outputs for cell in code] == [[]] * len(code)
    assert [cell.execution_count for cell in code] == [None] * len(code)
    assert content.metadata.kernelspec.name == "python3"


def test_without_a_place_the_demo_is_found_from_below(demo_catalog, tmp_path, monkeypatch):
    (tmp_path / "motionary-demo").symlink_to(Path(demo_catalog).resolve().parent)
    below = tmp_path / "deep" / "down"
    below.mkdir(parents=True)
    monkeypatch.chdir(below)
    assert catalog_of().store.url == str(tmp_path / "motionary-demo" / "catalog")
    assert [*below.iterdir()] == []


def test_a_catalog_is_opened_as_it_is(demo_catalog):
    assert catalog_of(demo_catalog).snapshot == Catalog.open(demo_catalog).snapshot


@pytest.mark.slow
def test_a_library_is_run_into_the_working_folder(demo_library, tmp_path, monkeypatch, capsys):
    library = tmp_path / "takes"
    shutil.copytree(demo_library / "walk", library / "walk")
    (library / "labels.csv").write_text("path,action\nwalk/walk_tired_alex_01.bvh,trudge\n")
    monkeypatch.chdir(tmp_path)
    made = catalog_of("takes")
    assert (len(made.clips), made.store.url) == (10, str(tmp_path / "takes-catalog"))
    assert "trudge" in made.clusters.to_arrow()["label"].to_pylist()
    assert capsys.readouterr().out.count("reading 10 clips") == 1
    again = catalog_of(library)
    assert again.last_run["clips_read"] == again.last_run["pairs_computed"] == 0
    assert capsys.readouterr().out == ""
    (tmp_path / "elsewhere" / "takes").mkdir(parents=True)
    with pytest.raises(UserError, match="is the catalog of"):  # of one that is only called alike
        catalog_of("elsewhere/takes")
    assert Catalog.open("takes-catalog").snapshot.snapshot_id == again.snapshot.snapshot_id


def test_a_place_that_is_neither_says_what_to_do(tmp_path):
    with pytest.raises(CatalogError, match="make one with: motionary run"):
        catalog_of(tmp_path / "nothing")
    with pytest.raises(UserError, match="no motion files"):
        catalog_of(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(CatalogError, match="is a file; a catalog is a folder"):
        catalog_of(tmp_path / "file")


@pytest.mark.slow
def test_the_demo_is_made_where_there_is_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert len(catalog_of().clips) == 80
    assert sorted(one.name for one in (tmp_path / "motionary-demo").iterdir()) == ["catalog", "library"]
