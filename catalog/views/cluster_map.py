"""The map of a library: every clip a mark, like ones together, coloured by label, shaped by source.

Neighbours on it are alike; how far apart groups lie, and how wide they are, means nothing: see
`motionary.catalog.views.embedding`. Every mark carries its clip_id as `customdata`, so that a page can play
the clip that is clicked.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.label_marks import (
    HALO,
    OTHER,
    SHAPES,
    LabelMark,
    label_marks,
    legend_key,
    source_shapes,
)
from motionary.catalog.views.library_map import library_map

if TYPE_CHECKING:
    import plotly.graph_objects as go

_WIDTH = 780.0  # pixels that the map is about wide
_LEAST_HEIGHT, _MOST_HEIGHT = 420.0, 900.0
_EDGE = 0.06  # of the map
_NEAR = 0.1  # of the map: clips so close to the middle of a group are what its name stands beside
_NAME = 22  # characters of a label on the map and in the legend
_CHARACTER, _LINE = 6.8, 15.0  # pixels of text
_AROUND = np.array([(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)])


def cluster_map_figure(catalog: Catalog, places: NDArray[np.float64] | None = None) -> go.Figure:
    """Draw the map of a library.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog; see `library_map` for how long 10,000 clips take.
    places : array (N, 2), optional
        Its `map_places`, where they are known already.

    Returns
    -------
    plotly Figure
        A trace a label, each clip's clip_id in `customdata`; the name of a label stands beside the largest
        group of its clips. Without clips it says so.

    Raises
    ------
    CatalogError
        Another version of motionary made the snapshot; or a file is damaged.
    """
    import plotly.graph_objects as go

    clips = library_map(catalog, places)
    rows = clips.to_pylist()
    marks = label_marks(clips["label"].to_pylist())
    shapes = source_shapes(clips["source"].to_pylist())
    by_mark: dict[str | None, list[dict]] = defaultdict(list)
    for row in rows:
        by_mark[row["label"] if row["label"] in marks else None].append(row)

    figure = go.Figure()
    for label in [None, *marks]:  # what has no mark of its own lies under the others
        if label in by_mark:
            mark = OTHER if label is None else marks[label]
            figure.add_trace(_trace(label, by_mark[label], mark, shapes, len(rows)))
    figure.add_trace(_names(clips, list(marks)))
    figure.add_traces(_label_keys(by_mark, marks))
    if len(shapes) > 1:
        figure.add_traces(_source_keys(shapes))
    _arrange(figure, clips)
    return figure


def _trace(
    label: str | None, rows: list[dict], mark: LabelMark, shapes: dict[str, str], clips: int
) -> go.Scatter:
    import plotly.graph_objects as go

    size = 9 if clips <= 500 else 7 if clips <= 2500 else 5
    return go.Scatter(
        x=np.array([one["x"] for one in rows], np.float32),
        y=np.array([one["y"] for one in rows], np.float32),
        mode="markers",
        legendgroup=_group(label),
        showlegend=False,
        marker={
            "color": mark.colour,
            "symbol": [mark.symbol(shapes[one["source"]]) for one in rows],
            "size": size,
            "opacity": 0.85,
            "line": {"width": 1.5 if size > 5 else 0.8, "color": mark.colour},
        },
        customdata=[one["clip_id"] for one in rows],
        hoverinfo="text",
        hovertext=[_hover(one) for one in rows],
    )


def _name_of(label: str | None, rows: list[dict]) -> str:
    if label is not None:
        return short_text(label, _NAME)
    others = len({one["label"] for one in rows} - {None})
    unnamed = any(one["label"] is None for one in rows)
    parts = [f"{others} other labels" if others else "", "no label" if unnamed else ""]
    return ", ".join(part for part in parts if part)


def _hover(row: dict) -> str:
    label = short_text(row["label"]) if row["label"] is not None else "no label"
    return (
        f"{short_text(row['clip_id'], 60)}<br>{label}, cluster {row['cluster_id']}, "
        f"{short_text(row['source'])}"
    )


def _names(clips: pa.Table, labels: list[str]) -> go.Scatter:
    """Write labels' names beside their clips, the most frequent first, where there is room for them."""
    import plotly.graph_objects as go

    places = _plane(clips)
    members: dict[str, list[int]] = defaultdict(list)
    for row, label in enumerate(clips["label"].to_pylist()):
        members[label].append(row)
    cluster_of = clips["cluster_id"].to_pylist()
    taken: list[NDArray[np.float64]] = []
    written = []
    for label in labels:
        (largest, _), *_ = Counter(cluster_of[row] for row in members[label]).most_common(1)
        group = places[[row for row in members[label] if cluster_of[row] == largest]]
        half = np.array([min(len(label), _NAME) * _CHARACTER, _LINE]) / 2 / _pixels(places)
        place = _free_place(group, half, taken, places)
        if place is not None:
            written.append((*place.tolist(), short_text(label, _NAME)))
    x, y, text = zip(*written, strict=True) if written else ((), (), ())
    return go.Scatter(
        x=x,
        y=y,
        mode="text",
        text=text,
        textfont={"size": 12, "shadow": HALO},
        hoverinfo="skip",
        showlegend=False,
    )


def _free_place(
    group: NDArray[np.float64],
    half: NDArray[np.float64],
    taken: list[NDArray[np.float64]],
    places: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """Find where a name hides the fewest clips, near a group and off other names, and take the place.

    `half` is half the name's width and height; `taken` gets the middle and the half of a place (2, 2).
    """
    medoid = group[np.linalg.norm(group - np.median(group, axis=0), axis=1).argmin()]
    near = group[np.abs(group - medoid).max(axis=1) <= _NEAR]
    low, high = near.min(axis=0), near.max(axis=0)
    best, least = None, np.inf
    for gap in (0.7, 1.7, 3.0):
        for side in _AROUND:
            centre = (low + high) / 2 + side * ((high - low) / 2 + half + gap * half[1])
            free = all((np.abs(centre - other[0]) > half + other[1]).any() for other in taken)
            hidden = float((np.abs(places - centre) < half + 0.4 * half[1]).all(axis=1).sum())
            if free and hidden + gap < least:  # far from its clips a name tells less
                best, least = centre, hidden + gap
    if best is not None:
        taken.append(np.stack([best, half]))
    return best


def _group(label: str | None) -> str:
    return "no mark" if label is None else f"label {label}"


def _label_keys(by_mark: dict[str | None, list[dict]], marks: dict[str, LabelMark]) -> list[go.Scatter]:
    """List labels as circles, whatever the shapes of their clips; a click on one hides them."""
    keys: list[go.Scatter] = []
    for label in [*marks, *([None] if None in by_mark else [])]:
        mark, rows = OTHER if label is None else marks[label], by_mark[label]
        outline = {"width": 1.5, "color": mark.colour}
        marker = {"symbol": mark.symbol(SHAPES[0]), "color": mark.colour, "line": outline}
        title = {"legendgrouptitle": {"text": "label"}} if not keys else {}
        name = f"{_name_of(label, rows)} ({len(rows)})"
        keys.append(legend_key(name, marker, legendgroup=_group(label), **title))
    return keys


def _source_keys(shapes: dict[str, str]) -> list[go.Scatter]:
    alone = [source for source, shape in shapes.items() if shape != SHAPES[-1]]
    shared = [source for source, shape in shapes.items() if shape == SHAPES[-1]]
    named = {short_text(source, _NAME): shapes[source] for source in alone}
    if shared:
        named[short_text(shared[0], _NAME) if len(shared) == 1 else f"{len(shared)} others"] = SHAPES[-1]
    layout: dict[str, Any] = {"legendgroup": "sources", "legendgrouptitle": {"text": "<br>source"}}
    return [legend_key(name, {"symbol": shape, "color": GREY}, **layout) for name, shape in named.items()]


def _plane(clips: pa.Table) -> NDArray[np.float64]:
    return np.stack([clips["x"].to_numpy(), clips["y"].to_numpy()], axis=1)


def _pixels(places: NDArray[np.float64]) -> float:
    """Return about how many pixels a length of 1 is drawn."""
    wide, tall = np.ptp(places, axis=0) + 2 * _EDGE
    return float(min(_WIDTH / wide, _MOST_HEIGHT / tall))


def _arrange(figure: go.Figure, clips: pa.Table) -> None:
    places = _plane(clips) if len(clips) else np.zeros((1, 2))
    low, high = places.min(axis=0) - _EDGE, places.max(axis=0) + _EDGE
    legend = 90.0 + 20.0 * sum(trace.showlegend is not False for trace in figure.data)
    height = np.clip((high - low)[1] * _pixels(places), _LEAST_HEIGHT, _MOST_HEIGHT)
    figure.update_layout(
        **CHART,
        height=90 + max(float(height.round()), legend),
        margin={"l": 10, "r": 10, "t": 20, "b": 60},
        legend={"itemsizing": "constant", "tracegroupgap": 0},
        clickmode="event",
        hovermode="closest",
    )
    title = "neighbours are alike;<br>how far apart groups lie means nothing" if len(clips) else ""
    hidden = {**AXIS, "showticklabels": False, "showgrid": False, "showline": False}
    figure.update_xaxes(**hidden, title=title, range=[low[0], high[0]])
    figure.update_yaxes(**hidden, range=[low[1], high[1]], scaleanchor="x")
    if not len(clips):
        figure.add_annotation(text="no clips", showarrow=False, xref="paper", yref="paper", x=0.5, y=0.5)
