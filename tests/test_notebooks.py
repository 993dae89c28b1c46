"""Every notebook runs from top to bottom on the demo's catalog, and is kept without outputs."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))


def test_there_are_notebooks():
    assert "01_explore_clusters" in [notebook.stem for notebook in NOTEBOOKS]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(notebook, demo_catalog, monkeypatch):
    monkeypatch.setenv("MOTIONARY_DEMO", str(Path(demo_catalog).resolve()))
    content = nbformat.read(notebook, as_version=4)
    folder = {"metadata": {"path": str(notebook.parent)}}
    NotebookClient(content, timeout=120, kernel_name="python3", resources=folder).execute()
    outputs = [one for cell in content.cells if cell.cell_type == "code" for one in cell.outputs]
    warned = [one.text for one in outputs if one.output_type == "stream" and one.name == "stderr"]
    assert not warned
    charts = [one for one in outputs if "application/vnd.plotly.v1+json" in one.get("data", {})]
    moving = [one for one in charts if one["data"]["application/vnd.plotly.v1+json"].get("frames")]
    assert charts
    assert moving


def test_says_what_to_do_without_a_catalog(monkeypatch, tmp_path):
    monkeypatch.setenv("MOTIONARY_DEMO", str(tmp_path / "nothing"))
    content = nbformat.read(NOTEBOOKS[0], as_version=4)
    content.cells = content.cells[:2]
    client = NotebookClient(
        content, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}, allow_errors=True
    )
    client.execute()
    said = str(content.cells[1].outputs)
    assert "make one with: motionary run" in said


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_is_kept_without_outputs(notebook):
    content = nbformat.read(notebook, as_version=4)
    code = [cell for cell in content.cells if cell.cell_type == "code"]
    assert [cell.outputs for cell in code] == [[]] * len(code)
    assert [cell.execution_count for cell in code] == [None] * len(code)
    assert content.metadata.kernelspec.name == "python3"
