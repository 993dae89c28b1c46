"""BVH: a hierarchy of joints and a line of channels per frame.

A joint's local transform is its translation, then its rotations in the order of its channels, each about
the axes the former ones turned (intrinsic; `Zrotation Yrotation Xrotation` is Rz Ry Rx). Where positions
stand among the channels does not matter. End Sites are not joints and are not kept.

**Position rule.** The format does not say whether a position channel is added to its joint's OFFSET or
replaces it, and both are found:

- position channels on two joints or more: they *replace* the OFFSETs (Bandai-Namco, and every exporter
  that writes six channels a joint: adding would double each bone);
- on one joint only, they are *added* to its OFFSET (Character Creator through iClone) unless the first
  frame already holds more than half of the OFFSET along the OFFSET's own direction: then the OFFSET is
  the rest or the first position, the channels are absolute, and they *replace* it (MotionBuilder).

`position_rule` overrides this. A joint below the pelvis keeps the median of its translation as constant
offset; a deviation of more than a thousandth of the longest bone is noted.

**Rate.** A frame time is a rounded number: the whole rate that rounds to it at the digits given is taken
(.0083333 is 120), else 1 / frame time.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.readers.bvh_hierarchy import BvhJoint, Hierarchy, parse_hierarchy
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.euler import quaternions_from_euler
from motionary.pipeline.readers.pelvis import PelvisTree, find_pelvis
from motionary.pipeline.readers.text import read_lines, shown, to_count, to_numbers, without_comment

PositionRule = Literal["add", "replace"]

SLOWEST = 2.0
"""Seconds between two frames at most: a figure that is sampled more rarely is not in motion, and a frame time
of a million seconds would grow by thirty million times when the motion is brought to the common rate."""

_FRAMES = re.compile(r"\s*frames\s*:?\s*(\S*)\s*$", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*frame\s*time\s*:?\s*(\S*)\s*$", re.IGNORECASE)


def read_bvh(path: Path, *, position_rule: PositionRule | None = None) -> Motion:
    """Read a BVH file.

    Parameters
    ----------
    path : Path
    position_rule : {"add", "replace"}, optional
        Overrides the module's rule for position channels, on every joint that has them.

    Returns
    -------
    Motion
        In the file's units and axes; `unit` is unknown.

    Raises
    ------
    ReadError
        The file is no BVH, is cut short, or holds values that are not numbers.
    """
    lines = read_lines(path)
    hierarchy = parse_hierarchy(path, lines)
    channels, frame_time = _motion_section(path, lines, hierarchy)
    names, notes = _distinct_names([joint.name for joint in hierarchy.joints])
    tree = find_pelvis(names, [joint.parent for joint in hierarchy.joints])
    notes += tree.notes
    translations, rule_notes = _translations(hierarchy.joints, channels, position_rule)
    rotations = _rotations(hierarchy.joints, channels)
    place, turn = _compose(tree, translations, rotations)
    offsets, offset_notes = _constant_offsets(tree, names, translations)
    local = rotations[:, tree.kept]
    local[:, 0] = turn.as_quat()
    return Motion(
        name=path.stem,
        skeleton=Skeleton(tuple(names[j] for j in tree.kept), tree.parents, offsets),
        fps=_rate(frame_time),
        root_position=place,
        rotations=local,
        source=str(path),
        notes=(*notes, *rule_notes, *offset_notes),
    )


def _motion_section(path: Path, lines: Sequence[str], hierarchy: Hierarchy) -> tuple[FloatArray, str]:
    """Return the channels (T, C) and the frame time as it is written."""
    rows: list[tuple[int, list[str]]] = []
    header: list[tuple[int, str]] = []
    for number in range(hierarchy.motion_line + 1, len(lines) + 1):
        line = without_comment(lines[number - 1])
        if not line or line.isspace():
            continue
        if len(header) < 2:
            header.append((number, line))
        else:
            rows.append((number, line.split()))
    count = _frame_count(path, header, hierarchy.motion_line)
    frame_time = _frame_time(path, header, hierarchy.motion_line)
    _check_rows(path, rows, count, hierarchy.columns, header[1][0])
    return to_numbers(path, rows).reshape(count, hierarchy.columns), frame_time


def _frame_count(path: Path, header: list[tuple[int, str]], motion_line: int) -> int:
    line, text = header[0] if header else (motion_line, "")
    match = _FRAMES.match(text)
    count = to_count(match[1]) if match else None
    if count is None:
        raise ReadError(path, line, f"expected `Frames: N` and found {shown(text)}", "export the file again")
    if count == 0:
        raise ReadError(path, line, "the file has no frames", "export it with its motion")
    return count


def _frame_time(path: Path, header: list[tuple[int, str]], motion_line: int) -> str:
    line, text = header[1] if len(header) > 1 else (motion_line, "")
    match = _FRAME_TIME.match(text)
    if match is None or not match[1]:
        mend = "write the seconds between two frames there, as in `Frame Time: 0.0083333`"
        raise ReadError(path, line, f"expected `Frame Time: S` and found {shown(text)}", mend)
    value = float(to_numbers(path, [(line, [match[1]])])[0])
    if not 1e-6 <= value <= SLOWEST:
        mend = "write the seconds between two frames there, as in `Frame Time: 0.0083333`"
        raise ReadError(path, line, f"a frame time of {shown(match[1])} s is impossible", mend)
    return match[1]


def _check_rows(
    path: Path, rows: list[tuple[int, list[str]]], count: int, columns: int, header_line: int
) -> None:
    for frame, (line, words) in enumerate(rows[:count]):
        if len(words) != columns:
            cut = frame == len(rows) - 1 and len(words) < columns
            what = f"frame {frame} has {len(words)} values and the hierarchy {columns} channels"
            mend = (
                "the file is cut short: copy or export it again"
                if cut
                else "one line a frame, one value a channel"
            )
            raise ReadError(path, line, what, mend)
    if len(rows) != count:
        # The fault shows where the frames end too early, or at the first frame too many.
        line = rows[count][0] if len(rows) > count else rows[-1][0] if rows else header_line
        mend = f"copy or export the file again, or write `Frames: {len(rows)}` if nothing is missing"
        raise ReadError(path, line, f"the file declares {count} frames and holds {len(rows)}", mend)


def _rate(frame_time: str) -> float:
    seconds = float(frame_time)
    whole = max(round(1 / seconds), 1)
    exponent = Decimal(frame_time).as_tuple().exponent
    last_digit = 10.0**exponent if isinstance(exponent, int) else 0.0
    rounded = abs(seconds - 1 / whole) < last_digit and abs(seconds * whole - 1) < 0.02
    return float(whole) if rounded else 1 / seconds


def _distinct_names(names: list[str]) -> tuple[list[str], list[str]]:
    """Give a name that stands again a number, and say so."""
    taken, distinct, notes = set(names), [], []
    seen: dict[str, int] = {}  # the number that a name's last repetition got
    for name in names:
        new = name
        if name in seen:
            number = seen[name] + 1
            while (new := f"{name}_{number}") in taken:
                number += 1
            taken.add(new)
            seen[name] = number
            notes.append(f"joint name {name!r} stands again: renamed to {new!r}")
        else:
            seen[name] = 1
        distinct.append(new)
    return distinct, notes


def _translations(
    joints: list[BvhJoint], channels: FloatArray, rule: PositionRule | None
) -> tuple[FloatArray, list[str]]:
    """Return every joint's local translation (T, J, 3), and a note where an OFFSET had to be judged."""
    offsets = np.array([joint.offset for joint in joints])
    translations = np.repeat(offsets[None], len(channels), axis=0)
    moving = [j for j, joint in enumerate(joints) if any(kind == "position" for kind, _, _ in joint.channels)]
    single = len(moving) == 1 and offsets[moving[0]].any()
    for j in moving:
        columns = {axis: column for kind, axis, column in joints[j].channels if kind == "position"}
        axes = list(columns)
        values = channels[:, list(columns.values())]
        chosen = rule or (_rule_of_one(offsets[j][axes], values[0]) if single else "replace")
        translations[:, j, axes] = values + (offsets[j][axes] if chosen == "add" else 0)
    if not single:
        return translations, []
    x, y, z = offsets[moving[0]]
    verb, other = ("added to", "replace") if chosen == "add" else ("taken instead of", "add")
    note = f"position channels of {joints[moving[0]].name!r} {verb} its OFFSET {x:g} {y:g} {z:g}"
    return translations, [f"{note} (position_rule={other!r} does the other)"]


def _rule_of_one(offset: FloatArray, first: FloatArray) -> PositionRule:
    return "replace" if first @ offset > 0.5 * (offset @ offset) else "add"


def _rotations(joints: list[BvhJoint], channels: FloatArray) -> FloatArray:
    """Return local quaternions (T, J, 4); joints of one Euler order are converted together."""
    quaternions = np.empty((len(channels), len(joints), 4))
    by_order: dict[tuple[int, ...], list[tuple[int, list[int]]]] = defaultdict(list)
    for j, joint in enumerate(joints):
        turns = [(axis, column) for kind, axis, column in joint.channels if kind == "rotation"]
        by_order[tuple(axis for axis, _ in turns)].append((j, [column for _, column in turns]))
    for order, members in by_order.items():
        angles = np.radians(channels[:, [columns for _, columns in members]])
        quaternions[:, [j for j, _ in members]] = quaternions_from_euler(order, angles)
    return quaternions


def _compose(
    tree: PelvisTree, translations: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, Rotation]:
    """Return the pelvis in the world: its places (T, 3) and its rotations."""
    place = translations[:, tree.chain[0]]
    turn = Rotation.from_quat(rotations[:, tree.chain[0]])
    for j in tree.chain[1:]:
        place = place + turn.apply(translations[:, j])
        turn = turn * Rotation.from_quat(rotations[:, j])
    return place, turn


def _constant_offsets(
    tree: PelvisTree, names: list[str], translations: FloatArray
) -> tuple[FloatArray, list[str]]:
    """Return the median offsets (joints, 3) below the pelvis, and the largest deviation where it matters."""
    below = translations[:, tree.kept]
    offsets = np.median(below, axis=0)
    offsets[0] = 0
    deviation = np.linalg.norm(below - offsets, axis=-1).max(axis=0)
    deviation[0] = 0
    worst = int(deviation.argmax())
    if deviation[worst] <= 1e-3 * np.linalg.norm(offsets, axis=-1).max() or math.isclose(deviation[worst], 0):
        return offsets, []
    name = names[tree.kept[worst]]
    return offsets, [
        f"joints below the pelvis moved in their parents' frames, at most {deviation[worst]:g} ({name!r}); "
        "their median offsets are kept"
    ]
