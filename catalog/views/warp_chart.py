"""Warping paths: which moment of a clip is shown at each moment of its reference [CoTW figures 2, 17].

Above is the path itself, beside the straight line of a clip that is only stretched to the reference's length
(UTW); below, how far the one lies ahead of the other. The marks are CoTW's nodes: between two of them the
pace does not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, GREY
from motionary.catalog.views.line_styles import line_style
from motionary.pipeline.alignment.uniform import uniform_times
from motionary.pipeline.features import sample_times
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

_HOVER = (
    "%{customdata[0]:.2f} s of it at %{x:.2f} s of the reference, "
    "%{customdata[1]:+.2f} s ahead of one only stretched"
)


@dataclass(frozen=True, eq=False)
class ClipWarp:
    """A row of `alignments` in seconds; R frames of the reference, N nodes.

    Parameters
    ----------
    clip_id, reference_id : str
    reference_seconds, clip_seconds, matched_seconds : array (R,)
        For each reference frame its time, the clip's time shown at it, and what would be shown if the clip
        were only stretched to the reference's length.
    node_reference_seconds, node_clip_seconds : array (N,)
        Where the ends of CoTW's segments came to lie; with open ends perhaps outside the reference.
    """

    clip_id: str
    reference_id: str
    reference_seconds: FloatArray
    clip_seconds: FloatArray
    matched_seconds: FloatArray
    node_reference_seconds: FloatArray
    node_clip_seconds: FloatArray

    @property
    def lead(self) -> FloatArray:
        """Seconds by which the clip is ahead of its stretched self (R,)."""
        return self.clip_seconds - self.matched_seconds


def warp_figure(catalog: Catalog, clip_ids: Sequence[str]) -> go.Figure:
    """Draw the warping paths of clips on the time of their cluster's reference.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.
    clip_ids : sequence of str
        Of one cluster, or of several: then each has its own reference's time.

    Returns
    -------
    plotly Figure
        Seconds on every axis.

    Raises
    ------
    CatalogError
        There is no such clip, or none is given.
    """
    import plotly.graph_objects as go

    warps = clip_warps(catalog, clip_ids)
    figure = go.Figure([_stretched(warps, "y"), _stretched(warps, "y2")])
    for number, warp in enumerate(warps, start=1):
        figure.add_traces(_path(number, warp))
    _arrange(figure, {warp.reference_id for warp in warps})
    return figure


def clip_warps(catalog: Catalog, clip_ids: Sequence[str]) -> list[ClipWarp]:
    """Read the warps of clips, in the order given.

    Raises
    ------
    CatalogError
        There is no such clip, or none is given.
    """
    if not clip_ids:
        raise CatalogError(f"no clip of {catalog.store.url} is given; name one or more")
    catalog.require(*clip_ids)
    rows = catalog.sql(
        "select alignments.*, clips.frames, clips.fps from alignments join clips using (clip_id) "
        "where list_contains(?, clip_id)",
        [list(clip_ids)],
    ).to_pylist()
    warps = {row["clip_id"]: _in_seconds(row) for row in rows}
    return [warps[clip_id] for clip_id in dict.fromkeys(clip_ids)]


def _in_seconds(row: dict[str, Any]) -> ClipWarp:
    rate, shown = row["frame_rate"], np.array(row["source_time"])
    last = len(sample_times(row["frames"], row["fps"], rate)) - 1
    stretch = last / max(len(shown) - 1, 1)  # of clip frames to reference frames
    nodes = np.array(row["nodes"])
    lengths = np.diff(nodes) + np.array(row["eta"])
    moved = row["first_frame"] + np.append(0, np.cumsum(lengths))
    return ClipWarp(
        clip_id=row["clip_id"],
        reference_id=row["reference_id"],
        reference_seconds=np.arange(len(shown)) / rate,
        clip_seconds=shown / rate,
        matched_seconds=uniform_times(last + 1, len(shown)) / rate,
        node_reference_seconds=moved / rate,
        node_clip_seconds=nodes * stretch / rate,
    )


def _stretched(warps: Sequence[ClipWarp], axis: str) -> go.Scatter:
    """Draw every clip as it would be if it were only stretched: the diagonal, and the level line below."""
    import plotly.graph_objects as go

    ends = [0, -1]
    x = [np.append(warp.reference_seconds[ends], np.nan) for warp in warps]
    y = [np.append(warp.matched_seconds[ends], np.nan) for warp in warps]
    return go.Scatter(
        x=np.concatenate(x),
        y=np.concatenate(y) if axis == "y" else np.zeros(3 * len(warps)),
        yaxis=axis,
        name="only stretched to the reference's length",
        legendgroup="stretched",
        showlegend=axis == "y",
        mode="lines",
        line={"color": GREY, "dash": "dot", "width": 1.5},
        hoverinfo="skip",
    )


def _path(number: int, warp: ClipWarp) -> list[go.Scatter]:
    import plotly.graph_objects as go

    style = line_style(number)
    line = {"color": style.colour, "dash": style.dash, "width": 2}
    inside = (warp.node_reference_seconds >= 0) & (
        warp.node_reference_seconds <= warp.reference_seconds[-1] + 1e-9
    )
    at = warp.node_reference_seconds[inside]
    marker = {"color": style.colour, "symbol": style.symbol, "size": 7}
    node_lead = warp.node_clip_seconds[inside] - np.interp(at, warp.reference_seconds, warp.matched_seconds)
    traces = []
    seconds, shown, lead = np.array([warp.reference_seconds, warp.clip_seconds, warp.lead], dtype=np.float32)
    for axis, values, nodes in (
        ("y", shown, warp.node_clip_seconds[inside]),
        ("y2", lead, node_lead),
    ):
        shared = {"yaxis": axis, "legendgroup": warp.clip_id}
        traces += [
            go.Scatter(
                x=seconds,
                y=values,
                name=short_text(warp.clip_id),
                mode="lines",
                line=line,
                showlegend=axis == "y",
                customdata=np.stack([shown, lead], axis=1),
                hovertemplate=_HOVER,
                hoverlabel={"namelength": -1},
                **shared,
            ),
            go.Scatter(
                x=at, y=nodes, mode="markers", marker=marker, showlegend=False, hoverinfo="skip", **shared
            ),
        ]
    return traces


def _arrange(figure: go.Figure, references: set[str]) -> None:
    own = "of each clip's own reference" if len(references) > 1 else f"of {short_text(references.pop())}"
    figure.update_layout(
        **CHART,
        height=620,
        margin={"l": 70, "r": 20, "t": 20, "b": 60},
        legend={"orientation": "h", "y": -0.12, "yanchor": "top"},
        xaxis={**AXIS, "title": f"seconds {own}", "anchor": "y2", "showline": True},
        yaxis={**AXIS, "title": "seconds of the clip", "domain": [0.4, 1], "showline": True},
        yaxis2={**AXIS, "title": "seconds ahead of that", "domain": [0, 0.33], "showline": True},
    )
