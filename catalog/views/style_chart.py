"""The style space of a cluster: how its clips differ once they run in one time [CoTW 6.3].

Each clip, aligned, less the cluster's reference is its residual; the axes are the principal ones of the
cluster's residuals, the widest first. An axis points to where its largest value is positive, as
`motionary.pipeline.style.space` has it. Like clips lie together whatever the axes are; what an axis means is
told by the clips at its ends. Places have no unit: a residual is a vector of angles in radians and of lengths
in leg lengths (`motionary.pipeline.style.Residual.vector`).
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.compute as pc

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.label_marks import HALO, OTHER, SHAPES, label_marks

if TYPE_CHECKING:
    import plotly.graph_objects as go

_TELLING = ("style", "subject", "label")
_NAMED_JOINTS = 3
_UNITLESS = "no unit: a residual weighs<br>radians and leg lengths together"


def style_figure(catalog: Catalog, cluster_id: int) -> go.Figure:
    """Draw the style space of a cluster along its two widest axes.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.
    cluster_id : int
        One of its clusters.

    Returns
    -------
    plotly Figure
        Each clip's clip_id in `customdata`; coloured by the label column `style`, else `subject`, else the
        clip's name, the first of which anything is known; the reference is ringed. A cluster of one clip, or
        of equal ones, has no axes and lies at 0.

    Raises
    ------
    CatalogError
        The catalog has no such cluster.
    """
    import plotly.graph_objects as go

    rows = _rows(catalog, cluster_id)
    column = next((one for one in _TELLING if any(row[one] is not None for row in rows)), _TELLING[-1])
    marks = label_marks(row[column] for row in rows)
    by_mark: dict[str | None, list[dict]] = defaultdict(list)
    for row in rows:
        by_mark[row[column] if row[column] in marks else None].append(row)

    figure = go.Figure()
    size = 11 if len(rows) <= 60 else 8 if len(rows) <= 300 else 5
    for place, value in enumerate([*marks, None]):
        if value in by_mark:
            mark, shape = OTHER if value is None else marks[value], SHAPES[place % len(SHAPES)]
            name = f"other {column}s" if value is None else short_text(value, 22)
            name = f"no {column}" if all(row[column] is None for row in by_mark[value]) else name
            marker = {"color": mark.colour, "symbol": mark.symbol(shape), "size": size}
            figure.add_trace(_trace(by_mark[value], name, marker, column))
    figure.add_trace(_ring([row for row in rows if row["clip_id"] == row["reference_id"]]))
    _arrange(figure, rows)
    return figure


def _rows(catalog: Catalog, cluster_id: int) -> list[dict]:
    styles = catalog.styles.to_arrow()
    own = styles.filter(pc.equal(styles["cluster_id"], cluster_id)).sort_by("clip_id").to_pylist()
    if not own:
        numbers = pc.unique(styles["cluster_id"]).to_pylist()
        there = f"it has {min(numbers)} to {max(numbers)}" if numbers else "it has none"
        raise CatalogError(f"no cluster {cluster_id} in {catalog.store.url}; {there}")
    ids = [row["clip_id"] for row in own]
    known = catalog.sql(
        "select clip_id, c.style, c.subject, k.label from clips c join clusters k using (clip_id) "
        "where clip_id in (select unnest($ids))",
        {"ids": ids},
    )
    by_clip = {row["clip_id"]: row for row in known.to_pylist()}
    return [row | by_clip[row["clip_id"]] | {"place": _place(row["scores"])} for row in own]


def _place(scores: list[float]) -> tuple[float, float]:
    x, y, *_ = [*scores, 0.0, 0.0]
    return x, y


def _ring(references: list[dict]) -> go.Scatter:
    """Draw a ring and a name about the reference."""
    import plotly.graph_objects as go

    return go.Scatter(
        x=[row["place"][0] for row in references],
        y=[row["place"][1] for row in references],
        mode="markers+text",
        marker={"symbol": "circle-open", "size": 22, "color": GREY, "line": {"width": 2}},
        text=["reference"] * len(references),
        textposition="top center",
        textfont={"shadow": HALO},
        hoverinfo="skip",
        showlegend=False,
    )


def _trace(rows: list[dict], name: str, marker: dict[str, Any], column: str) -> go.Scatter:
    import plotly.graph_objects as go

    return go.Scatter(
        x=np.array([row["place"][0] for row in rows], np.float32),
        y=np.array([row["place"][1] for row in rows], np.float32),
        mode="markers",
        name=f"{name} ({len(rows)})",
        legendgroup=column,
        legendgrouptitle={"text": column},
        marker={**marker, "line": {"width": 2, "color": marker["color"]}},
        customdata=[row["clip_id"] for row in rows],
        hoverinfo="text",
        hovertext=[_hover(row, column) for row in rows],
    )


def _hover(row: dict, column: str) -> str:
    value = f"no {column}" if row[column] is None else f"{column} {short_text(row[column])}"
    energy = np.array(row["joint_energy"], dtype=np.float64)
    most = np.argsort(-energy, kind="stable")[:_NAMED_JOINTS]
    shares = ", ".join(
        f"{short_text(row['joints'][one], 20)} {energy[one] / energy.sum():.0%}"
        for one in most.tolist()
        if energy[one] > 0
    )
    departs = f"departs from the reference in {shares}" if shares else "as the reference"
    return f"{short_text(row['clip_id'], 60)}<br>{value}<br>{departs}"


def _arrange(figure: go.Figure, rows: list[dict]) -> None:
    explained = rows[0]["explained"]
    figure.update_layout(
        **CHART,
        height=515,
        margin={"l": 60, "r": 20, "t": 30, "b": 90},
        showlegend=True,
        legend={"groupclick": "toggleitem"},
        clickmode="event",
        hovermode="closest",
    )
    axis = {**AXIS, "zeroline": True, "zerolinecolor": GREY}
    names = [f"axis {k + 1}: {share:.0%} of the variance" for k, share in enumerate(explained[:2])]
    along, across = [*names, *["nothing varies along it"] * 2][:2]
    figure.update_xaxes(**axis, title=f"{along}<br><sub>{_UNITLESS}</sub>")
    figure.update_yaxes(**axis, title=across, scaleanchor="x")
    if not explained:
        figure.update_xaxes(range=[-1, 1], showticklabels=False)
        figure.update_yaxes(range=[-1, 1], showticklabels=False)
