"""The notebooks, executed for the site, with outputs that live without a kernel and without a network."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

_CHART = "application/vnd.plotly.v1+json"
_WIDGET = "application/vnd.jupyter.widget-view+json"
_SECONDS = 600  # for one cell, on a machine that is busy
_QUIET = ["--IPKernelApp.log_level=ERROR"]  # else it warns that its port on this machine is not encrypted


def render_notebooks(notebooks: Path, sources: Path, where: Path) -> None:
    """Execute every notebook and keep it with its outputs among the sources of the site.

    Parameters
    ----------
    notebooks : Path
        Folder of notebooks without outputs.
    sources : Path
        Folder that takes them with outputs.
    where : Path
        Folder they run in, which holds the catalog of the embedded library.
    """
    sources.mkdir(parents=True, exist_ok=True)
    for file in sorted(notebooks.glob("*.ipynb")):
        notebook = nbformat.read(file, as_version=4)
        folder = {"metadata": {"path": str(where)}}
        client = NotebookClient(notebook, timeout=_SECONDS, resources=folder, extra_arguments=_QUIET)
        client.execute(env=os.environ | {"PLOTLY_RENDERER": "plotly_mimetype"})
        nbformat.write(kept(notebook, file.stem), sources / file.name)


def kept(notebook: Any, name: str) -> Any:
    """Turn charts into HTML that shares the site's Plotly, and leave out what would want a kernel.

    Parameters
    ----------
    notebook : NotebookNode
        Executed; it is changed.
    name : str
        Begins the names of its charts.
    """
    notebook.metadata.pop("widgets", None)
    outputs = [one for cell in notebook.cells if cell.cell_type == "code" for one in cell.outputs]
    for number, output in enumerate(one for one in outputs if "data" in one):
        output.data.pop(_WIDGET, None)
        if _CHART in output.data:
            output.data = {"text/html": _chart(output.data[_CHART], f"{name}-{number}")}
    return notebook


def _chart(bundle: dict[str, Any], name: str) -> str:
    import plotly.graph_objects as go

    from motionary.catalog.views.charts import chart_html

    parts = {part: bundle[part] for part in ("data", "layout", "frames") if part in bundle}
    return chart_html(go.Figure(parts), name)
