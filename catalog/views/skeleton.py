"""A moving stick figure, to turn, play and scrub."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.views.colours import CHART, COLOURS, GREY
from motionary.pipeline.canonical import UnknownSkeletonError, canonical_indices, find_convention
from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.normalise import headings, turn_about_vertical

if TYPE_CHECKING:
    import plotly.graph_objects as go

_RATE = 30.0
_APART = 0.9  # distance of two figures side by side, in body sizes


def moving_skeleton(*motions: Motion, max_frames: int = 100) -> go.Figure:
    """Draw motions as stick figures that move, side by side from the viewer's left.

    Every figure stands on the floor, begins at its own place facing the viewer, and is drawn at one size: its
    longest chain of bones measures 1. All run on one clock, and one that is over holds its last frame.

    Parameters
    ----------
    *motions : Motion
        One or more.
    max_frames : int
        Frames drawn at most, spread over the longest motion; never more than 30 a second.

    Returns
    -------
    plotly Figure
        With a button to play and a slider to scrub. Y is up and the axes are equal.

    Raises
    ------
    ValueError
        No motion is given.
    """
    import plotly.graph_objects as go

    if not motions:
        raise ValueError("no motion is given; moving_skeleton draws one or more")
    seconds = max(motion.seconds for motion in motions)
    count = max(1, min(max_frames, int(seconds * _RATE + 1e-6) + 1))
    times = np.linspace(0, seconds, count)
    points = [drawn(motion, times) for motion in motions]
    for index, lines in enumerate(points):
        lines[..., 0] += _APART * (index - (len(points) - 1) / 2)

    frames = [
        go.Frame(name=f"{time:.2f}", data=[_lines(lines[k]) for lines in points])
        for k, time in enumerate(times)
    ]
    first = [
        _lines(lines[0]).update(
            name=escape(motion.name), line={"color": COLOURS[index % len(COLOURS)], "width": 6}
        )
        for index, (motion, lines) in enumerate(zip(motions, points, strict=True))
    ]
    room = _room(points)
    figure = go.Figure([*first, _floor(room)], frames=frames)
    step = 1000 * seconds / max(count - 1, 1)
    figure.update_layout(**CHART, **_scene(room), **_controls(times, step), height=560, showlegend=True)
    return figure


def drawn(motion: Motion, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """Sample a motion's bones as lines, on the floor and at one size.

    Parameters
    ----------
    motion : Motion
        J joints.
    times : array (S,)
        Seconds; past the motion's end its last frame is held.

    Returns
    -------
    array (S, 3 (J - 1), 3)
        Parent, child, gap (not a number) of every bone; in the units of `body_size`, the lowest point at
        height 0 and the root beginning over the origin, facing +Z where the joints' names are known.
    """
    shown = motion.sampled(np.minimum(times * motion.fps, motion.frames - 1))
    joints = shown.positions()
    joints -= [joints[0, 0, 0], joints[..., 1].min(), joints[0, 0, 2]]
    joints /= body_size(motion.skeleton)
    joints = turn_about_vertical(joints, np.full(len(joints), -_first_heading(motion)))
    child = np.arange(1, joints.shape[1])
    parent = np.array(motion.skeleton.parents[1:], dtype=np.intp)
    ends = np.stack([joints[:, parent], joints[:, child], np.full_like(joints[:, child], np.nan)], axis=2)
    return ends.reshape(len(joints), -1, 3).astype(np.float32)


def _first_heading(motion: Motion) -> float:
    try:
        convention = find_convention(motion.skeleton.names)
    except UnknownSkeletonError:
        return 0.0
    return float(headings(motion.positions()[:, canonical_indices(motion.skeleton, convention)])[0])


def body_size(skeleton: Skeleton) -> float:
    """Return the length of the longest chain of bones from the root, in source units."""
    reach = np.zeros(len(skeleton.names))
    for joint in range(1, len(reach)):
        reach[joint] = reach[skeleton.parents[joint]] + np.linalg.norm(skeleton.offsets[joint])
    return float(reach.max()) or 1.0


def _lines(points: NDArray[np.float32]) -> go.Scatter3d:
    """Draw one frame; Plotly's vertical axis is z, so that X, Y, Z become its y, z, x."""
    import plotly.graph_objects as go

    x, y, z = (np.ascontiguousarray(column) for column in points.T)
    return go.Scatter3d(x=z, y=x, z=y, mode="lines", hoverinfo="skip")


@dataclass(frozen=True, eq=False)
class _Room:
    """The box (3,) to (3,) that holds every frame; its floor is at height 0."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]


def _room(points: list[NDArray[np.float32]]) -> _Room:
    every = np.concatenate([lines.reshape(-1, 3) for lines in points])
    low, high = np.nanmin(every, axis=0).astype(float), np.nanmax(every, axis=0).astype(float)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2 + 0.1, [0.5, 0.0, 0.5])
    return _Room(np.where([True, False, True], middle - half, -0.02), middle + half)


def _floor(room: _Room) -> go.Scatter3d:
    """Draw a square grid under the figures, a quarter of a body apart."""
    x, z = (np.arange(np.ceil(4 * room.low[k]), 4 * room.high[k]) / 4 for k in (0, 2))
    across = [[end, 0, line] for line in z for end in (room.low[0], room.high[0], np.nan)]
    along = [[line, 0, end] for line in x for end in (room.low[2], room.high[2], np.nan)]
    grid = _lines(np.array(across + along, dtype=np.float32))
    return grid.update(line={"color": GREY, "width": 1}, opacity=0.5, showlegend=False)


def _scene(room: _Room) -> dict[str, Any]:
    size = room.high - room.low
    aspect = 2.0 * size / np.linalg.norm(size)
    axes = {
        f"{name}axis": {"visible": False, "range": [float(room.low[k]), float(room.high[k])]}
        for name, k in (("x", 2), ("y", 0), ("z", 1))
    }
    return {
        "scene": {
            **axes,
            "aspectmode": "manual",
            "aspectratio": {name: float(aspect[k]) for name, k in (("x", 2), ("y", 0), ("z", 1))},
            "camera": {"eye": {"x": 1.7, "y": 0.8, "z": 0.5}},
        },
        "margin": {"l": 10, "r": 10, "t": 20, "b": 70},
        "legend": {"orientation": "h", "y": 1.0},
    }


def _controls(times: NDArray[np.float64], step: float) -> dict[str, Any]:
    at_once = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
    play = {
        "frame": {"duration": step, "redraw": True},
        "transition": {"duration": 0},
        "fromcurrent": True,
        "mode": "immediate",
    }
    buttons = [
        {"label": "Play", "method": "animate", "args": [None, play]},
        {"label": "Pause", "method": "animate", "args": [[None], at_once]},
    ]
    steps = [
        {"label": f"{time:.2f}", "method": "animate", "args": [[f"{time:.2f}"], at_once]} for time in times
    ]
    return {
        "updatemenus": [
            {"type": "buttons", "direction": "left", "buttons": buttons, "x": 0, "y": 0, "yanchor": "top"}
        ],
        "sliders": [
            {
                "steps": steps,
                "x": 0.18,
                "len": 0.8,
                "y": 0.02,
                "currentvalue": {"prefix": "seconds ", "xanchor": "right"},
            }
        ],
    }
