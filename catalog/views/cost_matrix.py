"""The cost matrix of two clips, with the similar zones of a threshold and the cover of S-DTW [DC figure 6].

Time runs to the right in `b` and up in `a`, so that clips that keep pace follow a rising diagonal. Every
compared frame takes as much room as the time it stands for: half a frame on either side of its first and
last. Up to the threshold's limit delta costs are dark, above it pale, and so the connected regions show.
Along the axes stand the segments that the cover has to touch, as in [DC figure 2].

A matrix of more than `MOST_FRAMES` frames a side is drawn in blocks of neighbouring frames, each in the mean
of its costs; the rival, the least of them, would show regions wider than they are. Zones, paths, limits and
the colours' ends are those of the whole matrix, and the chart says how many costs a block stands for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.errors import CatalogError
from motionary.catalog.example import example_of
from motionary.catalog.explanation import CurvePoint, ExplainedClip, Explanation
from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.zone_traces import path_traces, segment_traces, zone_traces
from motionary.pipeline.distances import cost_matrix
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

MOST_FRAMES = 320
_BELOW = ("#16202e", "#4d7ea8")
_ABOVE = ("#c3ccd3", "#f5f3ee")


def cost_matrix_figure(
    catalog: Catalog, explanation: Explanation, threshold: float | None = 1.0
) -> go.Figure:
    """Draw the costs of two clips, and what S-DTW makes of them at a threshold.

    Parameters
    ----------
    catalog : Catalog
        The one that made the explanation.
    explanation : Explanation
        From `Catalog.explain`; a file it tells of is read again.
    threshold : float, optional
        One of the curve's thresholds lambda; 1 is B-DTW of the whole clips. None: no zones, the path of the
        explanation's `warp`.

    Returns
    -------
    plotly Figure
        Seconds on both axes.

    Raises
    ------
    ValueError
        The curve has no such threshold; the message names those it has.
    CatalogError
        A clip or file is gone, or is another than was explained.
    """
    import plotly.graph_objects as go

    point = None if threshold is None else _point(explanation, threshold)
    costs = _costs(catalog, explanation)
    rate, a, b = explanation.frame_rate, explanation.a, explanation.b
    blocks = _block_of(len(a.first_frame)), _block_of(len(b.first_frame))
    heat = go.Heatmap(
        x=_edges(b, rate, blocks[1]),
        y=_edges(a, rate, blocks[0]),
        z=mean_of_blocks(costs, *blocks),
        zmin=float(costs.min()),
        zmax=float(costs.max()),
        colorscale=_colours(threshold),
        colorbar={
            "title": {"text": "cost", "side": "right"},
            "thickness": 12,
            "len": 0.6,
            "y": 0.7,
            "outlinecolor": GREY,
            "outlinewidth": 1,
        },
        hovertemplate="%{y:.2f} s with %{x:.2f} s: cost %{z:.4f}<extra></extra>",
    )
    figure = go.Figure(heat)
    if point is None:
        way = (explanation.warp.path_a, explanation.warp.path_b, explanation.warp.backward)
        figure.add_traces(path_traces(a, b, rate, [way]))
    else:
        figure.add_traces(zone_traces(point, rate))
        chosen = [(zone.path_a, zone.path_b, zone.backward) for zone in point.zones if zone.chosen]
        figure.add_traces(path_traces(a, b, rate, chosen))
        figure.add_traces(segment_traces(point, rate))
    _arrange(figure, explanation, point, blocks)
    return figure


def mean_of_blocks(values: FloatArray, rows: int, columns: int) -> FloatArray:
    """Take the mean of every block of `rows` times `columns` values; those at the ends may be smaller."""
    if rows == columns == 1:
        return values
    height, width = values.shape
    sums = np.add.reduceat(values.astype(np.float64), np.arange(0, height, rows), axis=0)
    sums = np.add.reduceat(sums, np.arange(0, width, columns), axis=1)
    high = np.diff([*range(0, height, rows), height])
    wide = np.diff([*range(0, width, columns), width])
    return (sums / np.outer(high, wide)).astype(np.float32)


def _point(explanation: Explanation, threshold: float) -> CurvePoint:
    for point in explanation.curve:
        if abs(point.threshold - threshold) < 1e-9:
            return point
    known = ", ".join(f"{point.threshold:g}" for point in explanation.curve)
    raise ValueError(f"threshold is {threshold:g}; the curve was taken at {known}")


def _costs(catalog: Catalog, explanation: Explanation) -> FloatArray:
    examples = []
    for clip in (explanation.a, explanation.b):
        example = example_of(catalog, clip.name)
        if (example.first_frame.tolist(), example.last_frame.tolist()) != (clip.first_frame, clip.last_frame):
            raise CatalogError(
                f"{clip.name} has changed since it was explained, or is another catalog's; explain it again"
            )
        examples.append(example)
    return cost_matrix(examples[0].features, examples[1].features)


def _block_of(frames: int) -> int:
    return -(-frames // MOST_FRAMES)


def _edges(clip: ExplainedClip, rate: float, block: int) -> FloatArray:
    """When every block of compared frames begins, and when the last one ends (blocks + 1,)."""
    begins = np.array(clip.first_frame[::block]) - 0.5
    return np.append(begins, clip.last_frame[-1] + 0.5) / rate


def _colours(threshold: float | None) -> list[tuple[float, str]]:
    """Return colours that step from dark to pale at delta, a share lambda of the way up the costs."""
    if threshold is None or not 0 < threshold < 1:
        return [(0.0, _BELOW[0]), (0.5, _BELOW[1]), (1.0, _ABOVE[1])]
    return [(0.0, _BELOW[0]), (threshold, _BELOW[1]), (threshold, _ABOVE[0]), (1.0, _ABOVE[1])]


def _arrange(
    figure: go.Figure, explanation: Explanation, point: CurvePoint | None, blocks: tuple[int, int]
) -> None:
    axis: dict[str, Any] = {**AXIS, "showgrid": False}
    strip: dict[str, Any] = {"visible": False, "range": [0, 1], "fixedrange": True}
    figure.update_layout(
        **CHART,
        height=660,
        margin={"l": 70, "r": 20, "t": 60, "b": 60},
        legend={"orientation": "h", "y": -0.14, "yanchor": "top", "bgcolor": "rgba(0,0,0,0)"},
        title={"text": _title(explanation, point, blocks), "font": {"size": 13}},
        xaxis={
            **axis,
            "title": f"seconds of b: {short_text(explanation.b.name)}",
            "domain": [0.04, 1],
            "anchor": "y2",
        },
        yaxis={
            **axis,
            "title": f"seconds of a: {short_text(explanation.a.name)}",
            "domain": [0.05, 1],
            "anchor": "x2",
        },
        xaxis2={**strip, "domain": [0, 0.03]},
        yaxis2={**strip, "domain": [0, 0.035]},
    )
    for name, edges in (("xaxis", figure.data[0].x), ("yaxis", figure.data[0].y)):
        room = 0.006 * (edges[-1] - edges[0])  # for the frames of zones that end where the clip does
        figure.layout[name].range = [edges[0] - room, edges[-1] + room]


def _title(explanation: Explanation, point: CurvePoint | None, blocks: tuple[int, int]) -> str:
    if point is None:
        way = ", b played backward" if explanation.warp.backward else ""
        told = f"warp of the whole clips{way}: mean cost {explanation.warp.distance:.4g}"
    else:
        chosen = sum(zone.chosen for zone in point.zones)
        told = (
            f"λ = {point.threshold:.3g}, δ = {point.limit:.4g}: S-DTW {point.distance:.4g}, "
            f"{chosen} of {len(point.zones)} similar zones chosen"
        )
    if blocks != (1, 1):
        told += f"<br>drawn in blocks of {blocks[0]} × {blocks[1]} compared frames, each in its mean cost"
    return told
