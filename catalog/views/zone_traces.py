"""What is drawn over a cost matrix: similar zones, the cover's, its paths, and the segments beside the axes.

Lines are bright over dark ones, and so stand out on any cost, in colour and in grey. A zone whose cheaper way
plays `b` backward has a dashed frame and a dotted path.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from motionary.catalog.explanation import CurvePoint, ExplainedClip, Span, Zone
from motionary.catalog.views.colours import GREY
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

Way = tuple[list[int], list[int], bool]
"""Compared frames of `a` and of `b` along a path, and whether it is backward."""

_DARK, _ZONE, _FORWARD, _BACKWARD = "#10151c", "#ffffff", "#E69F00", "#56B4E9"
_HOVER = (
    "a %{customdata[0]:.2f} to %{customdata[1]:.2f} s, b %{customdata[2]:.2f} to %{customdata[3]:.2f} s<br>"
    "B-DTW %{customdata[4]:.4f}"
)
BACKWARD_ZONE = "zone of the cover, b played backward"
"""What those zones are called in the legend."""


def zone_traces(point: CurvePoint, rate: float) -> list[go.Scatter]:
    """Frame all zones thinly, those of the cover thickly, and tell of each where its middle is hovered."""
    kinds = (
        ("similar zone, not needed", _ZONE, 1.0, "solid", lambda zone: not zone.chosen),
        ("zone of the cover", _ZONE, 2.5, "solid", lambda zone: zone.chosen and not zone.backward),
        (BACKWARD_ZONE, _BACKWARD, 2.5, "dash", lambda zone: zone.chosen and zone.backward),
    )
    traces = []
    for name, colour, width, dash, belongs in kinds:
        own = [zone for zone in point.zones if belongs(zone)]
        if own:
            traces += _frames(name, own, rate, {"color": colour, "width": width, "dash": dash})
    return traces


def rectangle(zone: Zone, rate: float) -> FloatArray:
    """Corners of a zone in seconds of `b` and `a`, the first once more, and a gap (6, 2)."""
    (bottom, top), (left, right) = _ends(zone.a, rate), _ends(zone.b, rate)
    corners = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    return np.array([*corners, (np.nan, np.nan)])


def path_traces(a: ExplainedClip, b: ExplainedClip, rate: float, ways: Sequence[Way]) -> list[go.Scatter]:
    """Draw paths through the middles of their cells."""
    import plotly.graph_objects as go

    middle_a, middle_b = (
        (np.array(clip.first_frame) + np.array(clip.last_frame)) / (2 * rate) for clip in (a, b)
    )
    traces = []
    for backward, name, colour, dash in (
        (False, "path", _FORWARD, "solid"),
        (True, "path, b played backward", _BACKWARD, "dot"),
    ):
        own = [(rows, columns) for rows, columns, back in ways if back == backward]
        if not own:
            continue
        x = np.concatenate([np.append(middle_b[columns], np.nan) for _, columns in own])
        y = np.concatenate([np.append(middle_a[rows], np.nan) for rows, _ in own])
        mode = "lines+markers" if min(len(rows) for rows, _ in own) == 1 else "lines"
        shared: dict[str, Any] = {"x": x.astype(np.float32), "y": y.astype(np.float32), "mode": mode}
        shared |= {"hoverinfo": "skip", "legendgroup": name}
        traces += [
            go.Scatter(**shared, line={"color": _DARK, "width": 5}, showlegend=False),
            go.Scatter(**shared, line={"color": colour, "width": 2.5, "dash": dash}, name=name),
        ]
    return traces


def segment_traces(point: CurvePoint, rate: float) -> list[go.Scatter]:
    """Draw the segments of both clips as bars beside the axes, every other one thinner."""
    import plotly.graph_objects as go

    traces = []
    for clip, segments in (("a", point.segments_a), ("b", point.segments_b)):
        along = np.array([[*_ends(one, rate), np.nan] for one in segments])
        for turn, width in ((0, 12), (1, 6)):
            own = along[turn::2].ravel()
            across = np.full(len(own), 0.5)
            x, y = (across, own) if clip == "a" else (own, across)
            traces.append(
                go.Scatter(
                    x=x,
                    y=y,
                    xaxis="x2" if clip == "a" else "x",
                    yaxis="y" if clip == "a" else "y2",
                    mode="lines",
                    line={"color": GREY, "width": width},
                    name="segments",
                    legendgroup="segments",
                    showlegend=clip == "a" and turn == 0,
                    hoverinfo="skip",
                )
            )
    return traces


def _frames(name: str, zones: Sequence[Zone], rate: float, line: dict[str, Any]) -> list[go.Scatter]:
    import plotly.graph_objects as go

    corners = np.stack([rectangle(zone, rate) for zone in zones]).astype(np.float32)
    x, y = corners.reshape(-1, 2).T
    shared: dict[str, Any] = {"mode": "lines", "hoverinfo": "skip", "legendgroup": name, "showlegend": False}
    # A white frame does not show in the legend of a white page: a square stands for it there.
    chosen = zones[0].chosen
    square: dict[str, Any] = {"symbol": "square" if chosen else "square-open", "size": 11, "color": GREY}
    square |= {"color": line["color"], "line": {"color": GREY, "width": 3}} if chosen else {}
    return [
        go.Scatter(x=x, y=y, line={"color": _DARK, "width": line["width"] + 2}, **shared),
        go.Scatter(x=x, y=y, line=line, **shared),
        go.Scatter(x=[None], y=[None], name=name, mode="markers", marker=square, legendgroup=name),
        go.Scatter(
            x=corners[:, :4, 0].mean(axis=1),
            y=corners[:, :4, 1].mean(axis=1),
            customdata=np.array([_told(zone) for zone in zones], dtype=np.float32),
            hovertemplate=f"{name}<br>{_HOVER}<extra></extra>",
            **(shared | {"mode": "markers", "marker": {"size": 9, "opacity": 0}, "hoverinfo": None}),
        ),
    ]


def _ends(span: Span, rate: float) -> tuple[float, float]:
    """When a stretch begins and ends, half a frame around its first and last."""
    return (span.first_frame - 0.5) / rate, (span.last_frame + 0.5) / rate


def _told(zone: Zone) -> tuple[float, ...]:
    """Return what `_HOVER` shows."""
    spans = (zone.a.start_seconds, zone.a.end_seconds, zone.b.start_seconds, zone.b.end_seconds)
    return (*spans, zone.distance)
