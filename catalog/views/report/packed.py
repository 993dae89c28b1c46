"""Scripts and charts that lie in a page compressed until they are looked at.

Plotly's script is most of a page, as text of its gzip less than half as much, and a browser takes longer to
run it than to show all the rest. So it lies there as data, and `report.js` unpacks it by the browser's
DecompressionStream when the first chart comes into view.
"""

from __future__ import annotations

import base64
import gzip
import json
from html import escape
from typing import TYPE_CHECKING

from motionary.catalog.views.charts import CONFIG

if TYPE_CHECKING:
    import plotly.graph_objects as go

_HEIGHT = 440  # what Plotly gives a chart that names none


def packed_plotly() -> str:
    """Return Plotly's script as data, for `report.js` to unpack."""
    from plotly.offline import get_plotlyjs

    return _packed(get_plotlyjs(), "plotly")


def packed_chart(figure: go.Figure, name: str) -> str:
    """Return a chart as data and an element called `name` that `report.js` draws it in."""
    chart = f'{{"figure":{figure.to_json()},"config":{json.dumps(CONFIG)}}}'
    height = figure.layout.height or _HEIGHT
    return (
        f'<div class="chart" id="{escape(name)}" data-packed="{escape(name)}-data" role="group" '
        f'aria-label="Chart" style="min-height:{height:.0f}px"></div>\n{_packed(chart, f"{name}-data")}'
    )


def data_element(text: str, name: str) -> str:
    """Return JSON, as `json_in_script` writes it, as an element called `name`."""
    return f'<script type="application/json" id="{escape(name)}">{text}</script>'


def _packed(text: str, name: str) -> str:
    packed = base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()
    return f'<script type="text/plain" id="{escape(name)}">{packed}</script>'
