"""A motion at a glance: a strip of stick figures, time running to the right, as a small SVG.

The way that the joints go is cut into equal parts, and of each the pose is shown that is least like those
before it, the first being the one least like the mean. Rivals: poses at equal times show the standing before
and after an action again and again; poses at equal parts of the way fall in step with a walk, and show one
moment of it five times. Every pose is seen from one place, turned as the first frame faces: three quarters to
the right, so that the swing of a leg shows as well as that of an arm. The pelvis is drawn where its turn in
the strip is, not where it has travelled; heights are kept.

The colours show on light and on dark ground, for an SVG in an `<img>` knows nothing of the page. Left and
right are told apart by colour, and what is further from the viewer is drawn thinner.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog
from motionary.catalog.views.colours import COLOURS, GREY
from motionary.catalog.views.figure_body import body_size, canonical_body
from motionary.pipeline.canonical import CANONICAL_JOINTS, Convention
from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.normalise import headings, turn_about_vertical

WIDTH, HEIGHT = 160, 90

_TURNED = np.radians(50)  # from facing the viewer to the right
_MARGIN = 4.0
_MOST_SAMPLES = 240
_INSIDE = 0.4  # of a part of the way, from its middle: at its ends two poses could be one
_HEAD = 0.045  # radius, of the figure's size
_LEAST_BONE = 0.03  # of an unknown skeleton that is drawn, of the figure's size
_LEFT, _RIGHT, _MIDDLE = COLOURS[0], COLOURS[3], GREY
_NEAR, _FAR = 3, 1.8  # width of lines

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def thumbnail_svg(catalog: Catalog, clip_id: str, *, poses: int = 5) -> str:
    """Draw a clip of a catalog at a glance; see `thumbnail_of`.

    Raises
    ------
    CatalogError
        The catalog has no such clip.
    """
    try:
        conventions = catalog.config.features.conventions
    except CatalogError:  # another motionary's settings: its pictures are drawn nevertheless
        conventions = ()
    return thumbnail_of(catalog.motion(clip_id), poses=poses, conventions=conventions)


def thumbnail_of(motion: Motion, *, poses: int = 5, conventions: Sequence[Convention] = ()) -> str:
    """Draw a motion at a glance.

    Parameters
    ----------
    motion : Motion
        Of any skeleton, or of markers. Where no convention fits, all but the shortest bones are drawn, turned
        as they are.
    poses : int
        How many figures.
    conventions : sequence of Convention
        A user's own joint-name conventions.

    Returns
    -------
    str
        An SVG element of 160 x 90 with the motion's name and length as its title; to be put into a page as it
        is, or served as a file.

    Raises
    ------
    ValueError
        `poses` is below 1.
    """
    if poses < 1:
        raise ValueError(f"poses is {poses}; a thumbnail has at least 1")
    body = _body_of(motion.skeleton, conventions)
    joints = _seen(motion, body)
    joints = joints[_telling(joints, poses)]
    size = float(np.ptp(joints[..., 1], axis=1).max()) or float(np.ptp(joints, axis=1).max()) or 1.0
    places, scale = _in_the_strip(joints / size)
    head = scale * _HEAD
    floor = f'<path d="M{_MARGIN:g} {HEIGHT - 2}H{WIDTH - _MARGIN:g}" stroke="{GREY}" stroke-opacity=".5"/>'
    figures = "".join(
        _figure(at, depth, body, head) for at, depth in zip(places, joints[..., 2], strict=True)
    )
    name = escape(_NOT_XML.sub("\ufffd", motion.name))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
        f'height="{HEIGHT}" role="img" fill="none" stroke-linecap="round" stroke-linejoin="round">'
        f"<title>\u2068{name}\u2069: {poses} poses in {motion.seconds:.1f} s</title>{floor}{figures}</svg>"
    )


@dataclass(frozen=True)
class _Body:
    """How a skeleton is drawn: the joints to look at, and lines along them.

    Parameters
    ----------
    joints : array (K,)
        Indices into the skeleton.
    lines : tuple of (str, tuple of int)
        A colour, and a line's joints among those K.
    head : int or None
        Where a head is drawn.
    known : bool
        Whether they are the canonical joints, so that the figure can be turned.
    """

    joints: NDArray[np.intp]
    lines: tuple[tuple[str, tuple[int, ...]], ...]
    head: int | None
    known: bool


def _body_of(skeleton: Skeleton, conventions: Sequence[Convention]) -> _Body:
    body = canonical_body(skeleton, conventions)
    if not body:
        return _Body(np.arange(len(skeleton.names)), _branches(skeleton), None, known=False)
    return _Body(np.array([*body.values()]), _CANONICAL_LINES, _HEAD_JOINT, known=True)


def _line(colour: str, joints: str) -> tuple[str, tuple[int, ...]]:
    return colour, tuple(CANONICAL_JOINTS.index(one) for one in joints.split())


_CANONICAL_LINES = (
    _line(_LEFT, "chest left_shoulder left_elbow left_wrist"),
    _line(_LEFT, "pelvis left_hip left_knee left_ankle left_toe"),
    _line(_MIDDLE, "pelvis spine chest neck head"),
    _line(_RIGHT, "chest right_shoulder right_elbow right_wrist"),
    _line(_RIGHT, "pelvis right_hip right_knee right_ankle right_toe"),
)
_HEAD_JOINT = CANONICAL_JOINTS.index("head")


def _branches(skeleton: Skeleton) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Part a tree into lines from where each branches off to its end, leaving out the shortest bones."""
    lengths = np.linalg.norm(skeleton.offsets, axis=1)
    least = _LEAST_BONE * body_size(skeleton)
    lines: dict[int, list[int]] = {}  # by the joint that each has come to
    ended = []
    for joint in range(1, len(lengths)):
        if lengths[joint] < least:
            continue
        line = lines.pop(skeleton.parents[joint], [skeleton.parents[joint]])
        lines[joint] = [*line, joint]
        ended = [*lines.values()]
    return tuple((_MIDDLE, tuple(line)) for line in ended)


def _seen(motion: Motion, body: _Body) -> FloatArray:
    """Sample the joints (S, K, 3) as the viewer sees them: x to the right, y up, z nearer; pelvis over 0."""
    shown = min(motion.frames, _MOST_SAMPLES)
    times = np.linspace(0, motion.frames - 1, shown).round()
    joints = motion.sampled(times).positions()[:, body.joints]
    heading = headings(joints[:1])[0] if body.known else 0.0
    joints = joints - joints[:, :1] * [1.0, 0.0, 1.0]
    return turn_about_vertical(joints, np.full(len(joints), _TURNED - heading))


def _telling(joints: FloatArray, poses: int) -> list[int]:
    """Choose a sample of each of equal parts of the joints' way; of the time, where nothing moves."""
    step = np.sqrt(np.mean(np.diff(joints, axis=0) ** 2, axis=(1, 2)))
    way = np.concatenate([[0.0], np.cumsum(step)])
    if way[-1] <= 1e-6 * np.ptp(joints):
        way = np.arange(len(joints), dtype=np.float64)
    part = poses * way / (way[-1] or 1.0)
    chosen: list[int] = []
    for number in range(poses):
        inside = np.flatnonzero(np.abs(part - number - 0.5) <= _INSIDE)
        if not len(inside):
            inside = np.array([np.abs(part - number - 0.5).argmin()])
        others = joints[chosen] if chosen else joints.mean(axis=0, keepdims=True)
        unlike = np.square(joints[inside, None] - others).sum(axis=(2, 3)).min(axis=1)
        chosen.append(int(inside[unlike.argmax()]))
    return chosen


def _in_the_strip(joints: FloatArray) -> tuple[FloatArray, float]:
    """Place the poses side by side (P, K, 2), as far apart as there is room and as large as fits.

    Returns the places in pixels and what a length of 1 became.
    """
    room = np.array([WIDTH - 2 * _MARGIN, HEIGHT - 2 * _MARGIN])
    low, high = joints[..., 0].min(axis=1), joints[..., 0].max(axis=1)
    tall = float(np.ptp(joints[..., 1])) + 2 * _HEAD
    apart = (tall * room[0] / room[1] + low[0] - high[-1]) / max(len(joints) - 1, 1)
    apart = max(apart, 0.6 * float((high - low).max()))
    places = joints[..., :2] + np.arange(len(joints))[:, None, None] * [apart, 0.0]
    corner, end = places.min(axis=(0, 1)), places.max(axis=(0, 1)) + [0.0, 2 * _HEAD]
    scale = float(np.min(room / np.maximum(end - corner, 1e-9)))
    left = (WIDTH - scale * (end[0] - corner[0])) / 2
    x = left + scale * (places[..., 0] - corner[0])
    y = HEIGHT - _MARGIN - scale * (places[..., 1] - corner[1])
    return np.stack([x, y], axis=-1), scale


def _figure(at: FloatArray, depth: FloatArray, body: _Body, head: float) -> str:
    """Draw one pose, what is further away first; `head` is the radius of one."""
    middle = float(depth.mean())
    drawn = []
    for colour, line in body.lines:
        place = float(depth[list(line)].mean())
        width = _NEAR if place >= middle or colour == _MIDDLE else _FAR
        points = "L".join(f"{x:.1f} {y:.1f}" for x, y in at[list(line)])
        drawn.append((place, f'<path d="M{points}" stroke="{colour}" stroke-width="{width}"/>'))
    lines = "".join(text for _, text in sorted(drawn))
    if body.head is None:
        return lines
    x, y = at[body.head]
    return f'{lines}<circle cx="{x:.1f}" cy="{y:.1f}" r="{head:.1f}" fill="{GREY}"/>'
