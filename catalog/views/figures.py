"""Motions as figures for the player: places of joints in few bytes, and what is shown with them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from motionary.catalog.motions import stream_features, stream_motions
from motionary.catalog.places import rows_by_clip
from motionary.catalog.views.figure_body import (
    body_size,
    by_joint,
    canonical_body,
    contacts_of,
    first_heading,
    joints_between,
    kept_joints,
)
from motionary.catalog.views.figure_data import Figure, quantised, shares
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.canonical import Convention
from motionary.pipeline.features import at_rate
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.style.residual import pose_differences

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog

_RATE = 30.0
_WARP = ["reference_id", "frame_rate", "source_time"]

Layout = Literal["side", "overlaid"]
Colour = Literal["plain", "residual"]


def figure_of(
    motion: Motion,
    *,
    name: str | None = None,
    warp: Warp | None = None,
    warp_rate: float = _RATE,
    residual: FloatArray | None = None,
    rate: float = _RATE,
    joints: Sequence[str] | None = None,
    conventions: Sequence[Convention] = (),
) -> Figure:
    """Make a figure of a motion.

    Parameters
    ----------
    motion : Motion
        J joints.
    name : str, optional
        Shown with it; the motion's own when left out.
    warp : Warp, optional
        To the time of a reference, with which the player shows it aligned.
    warp_rate : float
        Frames a second of the warp's times, and of the reference.
    residual : array (reference frames, J), optional
        How far each joint is from the reference's, leg lengths; needs `warp`.
    rate : float
        Frames a second at most; never more than the motion's own.
    joints : sequence of str, optional
        Only these joints; the bones between them are drawn straight.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    Figure

    Raises
    ------
    ValueError
        The residual has another shape, or there is one without a warp.
    KeyError
        The motion has no joint of that name.
    """
    _check(residual, warp, motion)
    figure = _plain_figure(motion, rate, conventions)
    if name is not None:
        figure = replace(figure, name=name)
    if warp is not None:
        figure = replace(figure, warp_times=warp.source_time / warp_rate, warp_fps=float(warp_rate))
    if residual is not None:
        values, most = shares(residual)
        figure = replace(figure, residual=values, residual_max=most)
    return figure if joints is None else figure.only(kept_joints(motion.skeleton, joints))


def clip_figure(catalog: Catalog, clip_id: str, *, slim: bool = False) -> Figure:
    """Make a figure of a clip, with its warp to its cluster's reference and what it differs from that by.

    Parameters
    ----------
    catalog : Catalog
    clip_id : str
    slim : bool
        Without fingers, toes' ends and whatever else hangs from the 19 canonical joints.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    """
    return next(clip_figures(catalog, [clip_id], slim=slim))


def clip_figures(catalog: Catalog, clip_ids: Collection[str], *, slim: bool = False) -> Iterator[Figure]:
    """Make figures of clips, reading each table once; see `clip_figure`.

    Yields
    ------
    Figure
        In the order the clips are stored in.
    """
    catalog.require(*clip_ids)
    conventions = catalog.config.features.conventions
    found = rows_by_clip(catalog, "alignments", clip_ids, _WARP)
    alignments = {clip_id: rows.to_pylist()[0] for clip_id, rows in found}
    references = {row["reference_id"] for row in alignments.values()}
    features = dict(stream_features(catalog, references.union(clip_ids)))
    named = catalog.sql("select clip_id, label from clusters where clip_id in ?", [[*clip_ids]])
    labels = dict(zip(named["clip_id"].to_pylist(), named["label"].to_pylist(), strict=True))
    for motion in stream_motions(catalog, clip_ids):
        clip_id, alignment = motion.name, alignments[motion.name]
        reference = alignment["reference_id"]
        body = canonical_body(motion.skeleton, conventions)
        warp = Warp(np.array(alignment["source_time"]), len(features[clip_id]))
        differences = pose_differences(warp.apply(features[clip_id]), features[reference])
        figure = figure_of(
            motion,
            warp=warp,
            warp_rate=alignment["frame_rate"],
            residual=by_joint(np.linalg.norm(differences, axis=2), motion.skeleton, body) if body else None,
            joints=joints_between(motion.skeleton, body) if slim and body else None,
            conventions=conventions,
        )
        yield replace(figure, clip_id=clip_id, label=labels[clip_id], reference=reference)


def scene(
    figures: Sequence[Figure],
    *,
    layout: Layout = "side",
    aligned: bool = False,
    trails: Sequence[str] = (),
    colour: Colour = "plain",
) -> dict[str, Any]:
    """Put figures together, as the player takes them.

    Parameters
    ----------
    figures : sequence of Figure
        From the viewer's left.
    layout : {"side", "overlaid"}
        Side by side, or all beginning at one place.
    aligned : bool
        Whether it begins in the reference's time.
    trails : sequence of str
        Joints, canonical or the rig's, whose way is drawn.
    colour : {"plain", "residual"}
        By figure, or by how far each joint is from the reference's.

    Returns
    -------
    dict
        What JSON can hold.

    Raises
    ------
    ValueError
        No figure is given.
    """
    if not figures:
        raise ValueError("no figure is given; a scene has one or more")
    return {
        "figures": [figure.to_dict() for figure in figures],
        "layout": layout,
        "aligned": aligned,
        "trails": list(trails),
        "colour": colour,
    }


def _check(residual: FloatArray | None, warp: Warp | None, motion: Motion) -> None:
    if residual is None:
        return
    wanted = None if warp is None else (warp.reference_frames, len(motion.skeleton.names))
    if residual.shape != wanted:
        raise ValueError(f"residual has shape {residual.shape}; it needs a warp, and with this one {wanted}")


def _plain_figure(motion: Motion, rate: float, conventions: Sequence[Convention]) -> Figure:
    """Make a figure of all joints, in its own time."""
    shown = at_rate(motion, min(rate, _whole(motion.fps)))
    places = shown.positions()
    body = canonical_body(motion.skeleton, conventions)
    size = body_size(motion.skeleton) or float(np.ptp(places, axis=(0, 1)).max()) or 1.0
    values, scale, origin = quantised(places, size)
    return Figure(
        name=motion.name,
        joints=motion.skeleton.names,
        parents=motion.skeleton.parents,
        fps=shown.fps,
        source_fps=motion.fps,
        values=values,
        scale=scale,
        origin=origin,
        size=size,
        turn=first_heading(places, body),
        floor=float(places[..., 1].min()),
        body=body,
        contacts=contacts_of(shown, body, conventions),
    )


def _whole(fps: float) -> float:
    nearest = round(fps)
    return nearest if nearest and abs(fps - nearest) <= 1e-3 * nearest else fps
