"""A joint's way before and after alignment, beside the reference's [CoTW figures 6, 8].

What is drawn is what alignment reads: the joint in leg lengths, across and forward from the pelvis in the
figure's own heading, and up from the clip's floor. *Before* is the clip stretched to the reference's length
(UTW) and nothing else; *after* is the motion that table `aligned` holds. Each direction tells its correlation
with the reference, which is what CoTW raises; a joint that is still in it has none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from motionary.catalog.motions import stream_features
from motionary.catalog.query import Catalog
from motionary.catalog.views.chart_text import short_text
from motionary.catalog.views.colours import AXIS, CHART, COLOURS, GREY
from motionary.pipeline.alignment import uniform
from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.features import frame_features
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    import plotly.graph_objects as go

DIRECTIONS = ("left", "up", "forward")
_SCALE = np.sqrt(len(CANONICAL_JOINTS))  # what features divide a joint's place by
_STILL = 1e-6  # leg lengths


@dataclass(frozen=True, eq=False)
class Trajectories:
    """A joint of a clip in its reference's time, and the reference's; T frames of the reference.

    Parameters
    ----------
    clip_id, reference_id, joint : str
    seconds : array (T,)
        Of the reference.
    before, after, reference : array (T, 3)
        Left, up and forward, leg lengths.
    """

    clip_id: str
    reference_id: str
    joint: str
    seconds: FloatArray
    before: FloatArray
    after: FloatArray
    reference: FloatArray


def trajectory_figure(catalog: Catalog, clip_id: str, joint: str) -> go.Figure:
    """Draw a joint of a clip before and after alignment, beside its reference.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog.
    clip_id : str
        A clip of it.
    joint : str
        One of the 19 canonical joints, such as `left_wrist`.

    Returns
    -------
    plotly Figure
        Three panels: left, up, forward.

    Raises
    ------
    CatalogError
        There is no such clip.
    ValueError
        There is no such joint; the message names them.
    """
    import plotly.graph_objects as go

    ways = trajectories(catalog, clip_id, joint)
    figure = go.Figure()
    for panel in range(len(DIRECTIONS)):
        figure.add_traces(_lines(ways, panel))
    _arrange(figure, ways)
    return figure


def trajectories(catalog: Catalog, clip_id: str, joint: str) -> Trajectories:
    """Read a joint's way; see `trajectory_figure`."""
    if joint not in CANONICAL_JOINTS:
        raise ValueError(f"there is no joint {joint!r}; it must be one of {', '.join(CANONICAL_JOINTS)}")
    catalog.require(clip_id)
    found = catalog.sql(
        "select reference_id, frame_rate from alignments where clip_id = ?", [clip_id]
    ).to_pylist()[0]
    features = dict(stream_features(catalog, {clip_id, found["reference_id"]}))
    columns = slice(3 * CANONICAL_JOINTS.index(joint), 3 * CANONICAL_JOINTS.index(joint) + 3)
    own, reference = (_SCALE * features[one][:, columns] for one in (clip_id, found["reference_id"]))
    aligned = frame_features(catalog.aligned(clip_id), catalog.config.features).values
    return Trajectories(
        clip_id=clip_id,
        reference_id=found["reference_id"],
        joint=joint,
        seconds=np.arange(len(reference)) / found["frame_rate"],
        before=uniform(own, reference).apply(own),
        after=_SCALE * aligned[:, columns],
        reference=reference,
    )


def correlation(one: FloatArray, other: FloatArray) -> float | None:
    """Return Pearson's correlation of two series, None where either is still (CoTW counts that as 0)."""
    if min(np.ptp(one), np.ptp(other)) < _STILL:
        return None
    return float(np.corrcoef(one, other)[0, 1])


def _lines(ways: Trajectories, panel: int) -> list[go.Scatter]:
    import plotly.graph_objects as go

    kinds = (
        (f"reference {short_text(ways.reference_id)}", ways.reference, GREY, "solid", 5),
        ("before: only stretched to its length", ways.before, COLOURS[3], "dot", 2),
        ("after: aligned", ways.after, COLOURS[0], "solid", 2),
    )
    return [
        go.Scatter(
            x=ways.seconds.astype(np.float32),
            y=values[:, panel].astype(np.float32),
            yaxis=f"y{panel + 1 if panel else ''}",
            name=name,
            legendgroup=name,
            showlegend=panel == 0,
            mode="lines" if len(values) > 1 else "markers",
            line={"color": colour, "dash": dash, "width": width},
            opacity=0.55 if width > 2 else 1,
            hovertemplate=f"{DIRECTIONS[panel]} %{{y:.3f}} leg lengths at %{{x:.2f}} s<extra></extra>",
        )
        for name, values, colour, dash, width in kinds
    ]


def _arrange(figure: go.Figure, ways: Trajectories) -> None:
    joint = ways.joint.replace("_", " ")
    figure.update_layout(
        **CHART,
        height=620,
        margin={"l": 70, "r": 20, "t": 50, "b": 60},
        title={"text": f"{joint} of {short_text(ways.clip_id)}", "font": {"size": 13}},
        legend={"orientation": "h", "y": -0.1, "yanchor": "top"},
        xaxis={**AXIS, "title": "seconds of the reference", "anchor": "y3", "showline": True},
    )
    for panel, direction in enumerate(DIRECTIONS):
        top = 1 - panel * 0.345
        axis = {**AXIS, "title": f"{direction}, leg lengths", "domain": [top - 0.28, top], "showline": True}
        figure.update_layout({f"yaxis{panel + 1 if panel else ''}": axis})
        figure.add_annotation(
            text=_agreement(ways, panel),
            xref="paper",
            yref="paper",
            x=1,
            y=top,
            xanchor="right",
            yanchor="bottom",
            showarrow=False,
        )


def _agreement(ways: Trajectories, panel: int) -> str:
    before, after = (
        correlation(values[:, panel], ways.reference[:, panel]) for values in (ways.before, ways.after)
    )
    if before is None or after is None:
        return f"{DIRECTIONS[panel]}: still, no correlation"
    before, after = (round(value, 2) + 0.0 for value in (before, after))  # no -0.00
    return f"{DIRECTIONS[panel]}: correlation {before:.2f} before, {after:.2f} after"
