"""ASF: the skeleton that AMC files of one actor share (Acclaim).

A bone has a `direction` and a `length` in the world's axes at rest and so ends at its parent's end plus
direction x length. Here **a joint is the start of its bone** and carries the bone's name; bones that start at
one point have equal offsets; the ends of leaf bones are not joints. The first joint is `root`.

A bone's channels turn it about its own `axis` frame C: its local rotation is C M C^-1, M the product of the
`dof` rotations, the first listed applied first (`rx ry rz` is Rz Ry Rx); C likewise from the axis angles in
the order their line names. The root's `orientation` O turns the figure before its channels do: M O.

Lengths are inches over the stated `length` (VICON's convention, CMU's and HDM05's): `length 0.45` makes
one unit 2.54 / 0.45 = 5.6444 cm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from scipy.spatial.transform import Rotation

from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.text import read_lines, shown, to_numbers, without_comment

ROOT = "root"
DOFS = ("tx", "ty", "tz", "rx", "ry", "rz", "l")

_INCH = 0.0254  # metres


@dataclass
class AsfBone:
    """A bone of the :bonedata section, or the root.

    Parameters
    ----------
    name : str
    line : int
        Where it begins.
    direction : list of 3 floats
        At rest, in the world's axes; zeros for the root.
    length : float
    axis : list of 3 floats
        Angles of its frame (the root's orientation), in the file's angle unit.
    axis_order : str
        "xyz" turns about x first.
    dof : tuple of str
        Of DOFS, in the order of its values in an AMC line.
    """

    name: str
    line: int
    direction: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    length: float = 0.0
    axis: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    axis_order: str = "xyz"
    dof: tuple[str, ...] = ()


@dataclass(frozen=True)
class AsfSkeleton:
    """An ASF file.

    Parameters
    ----------
    bones : dict of str to AsfBone
        The root first, then every bone after its parent.
    parents : dict of str to str
        Every bone's parent; the root has none.
    position : list of 3 floats
        Added to the root's translation.
    degrees : bool
        Angle unit of the axes, and of an AMC that names none.
    unit : float or None
        Metres in one unit of length.
    """

    bones: dict[str, AsfBone]
    parents: dict[str, str]
    position: list[float]
    degrees: bool
    unit: float | None

    def frame(self, name: str) -> Rotation:
        """Return a bone's axis frame C, or the root's orientation."""
        bone = self.bones[name]
        return Rotation.from_euler(bone.axis_order, bone.axis, degrees=self.degrees)


def read_asf(path: Path) -> AsfSkeleton:
    """Read an ASF file.

    Raises
    ------
    ReadError
        A section, a bone or a value is missing or malformed, or the hierarchy is not one tree.
    """
    lines = read_lines(path)
    sections = _sections(path, lines)
    for name in (":root", ":bonedata", ":hierarchy"):
        if name not in sections:
            mend = "check that this is a whole ASF file"
            raise ReadError(path, len(lines), f"there is no {name} section", mend)
    degrees, unit = _units(path, sections.get(":units", []))
    root, position = _root(path, sections[":root"])
    bones = _bones(path, sections[":bonedata"])
    if ROOT in bones:
        raise ReadError(path, bones[ROOT].line, "a bone is called root", "rename it")
    bones = {ROOT: root, **bones}
    parents = _hierarchy(path, sections[":hierarchy"], bones)
    order = _depth_first(path, bones, parents)
    return AsfSkeleton({name: bones[name] for name in order}, parents, position, degrees, unit)


Rows = list[tuple[int, list[str]]]


def _sections(path: Path, lines: Sequence[str]) -> dict[str, Rows]:
    """Split into sections by the words that begin with a colon."""
    sections: dict[str, Rows] = {}
    current: Rows | None = None
    for number, line in enumerate(lines, 1):
        words = without_comment(line).split()
        if not words:
            continue
        if words[0].startswith(":"):
            current = sections.setdefault(words[0].lower(), [])
        elif current is None:
            mend = "an ASF begins with :version; check that this is an ASF file"
            raise ReadError(path, number, f"{shown(' '.join(words))} stands outside every section", mend)
        else:
            current.append((number, words))
    return sections


def _units(path: Path, rows: Rows) -> tuple[bool, float | None]:
    degrees, unit = True, None
    for line, words in rows:
        if words[0].lower() == "angle" and len(words) > 1:
            degrees = not words[1].lower().startswith("rad")
        if words[0].lower() == "length":
            scale = _values(path, line, words, 1)[0]
            if scale <= 0:
                raise ReadError(
                    path, line, f"the unit of length is {scale:g}", "it must be positive; 0.45 is usual"
                )
            unit = _INCH / scale
    return degrees, unit


def _root(path: Path, rows: Rows) -> tuple[AsfBone, list[float]]:
    root, position = AsfBone(ROOT, rows[0][0] if rows else 1), [0.0, 0.0, 0.0]
    for line, words in rows:
        match words[0].lower():
            case "order":
                root.dof = _dofs(path, line, words[1:])
            case "axis":
                root.axis_order = _axis_order(path, line, words[-1])
            case "position":
                position = _values(path, line, words, 3)
            case "orientation":
                root.axis = _values(path, line, words, 3)
    if not root.dof:
        raise ReadError(path, root.line, "the root has no order", "add `order TX TY TZ RX RY RZ`")
    return root, position


def _bones(path: Path, rows: Rows) -> dict[str, AsfBone]:
    bones: dict[str, AsfBone] = {}
    bone: AsfBone | None = None
    for line, words in rows:
        keyword = words[0].lower()
        if keyword == "begin":
            bone = AsfBone("", line)
        elif bone is None:
            raise ReadError(
                path, line, f"{shown(' '.join(words))} stands outside every bone", "look for a missing begin"
            )
        elif keyword == "end":
            if not bone.name or bone.name in bones:
                what = f"two bones are called {shown(bone.name)}" if bone.name else "a bone has no name"
                raise ReadError(path, bone.line, what, "give each bone a name of its own")
            bones[bone.name] = bone
            bone = None
        else:
            _bone_line(path, line, words, bone)
    if bone is not None:
        raise ReadError(
            path, bone.line, f"bone {shown(bone.name)} has no end", "the file may be cut short: copy it again"
        )
    return bones


def _bone_line(path: Path, line: int, words: list[str], bone: AsfBone) -> None:
    match words[0].lower():
        case "name":
            bone.name = " ".join(words[1:])
        case "direction":
            bone.direction = _values(path, line, words, 3)
        case "length":
            bone.length = _values(path, line, words, 1)[0]
        case "axis":
            bone.axis = _values(path, line, words[:4], 3)
            bone.axis_order = _axis_order(path, line, words[4] if len(words) > 4 else "XYZ")
        case "dof":
            bone.dof = _dofs(path, line, words[1:])


def _hierarchy(path: Path, rows: Rows, bones: dict[str, AsfBone]) -> dict[str, str]:
    parents: dict[str, str] = {}
    for line, words in rows:
        if words[0].lower() in ("begin", "end"):
            continue
        for name in words:
            if name not in bones:
                raise ReadError(
                    path, line, f"bone {shown(name)} is not in :bonedata", "add it, or mend its name"
                )
        for child in words[1:]:
            if child in parents or child == ROOT:
                raise ReadError(path, line, f"bone {shown(child)} has two parents", "name each child once")
            parents[child] = words[0]
    return parents


def _depth_first(path: Path, bones: dict[str, AsfBone], parents: dict[str, str]) -> list[str]:
    children: dict[str, list[str]] = {name: [] for name in bones}
    for child, parent in parents.items():
        children[parent].append(child)
    order, waiting = [], [ROOT]
    while waiting:
        order.append(waiting.pop())
        waiting += reversed(children[order[-1]])
    hung = set(order)
    lost = [bone for name, bone in bones.items() if name not in hung]
    if lost:
        mend = "add it to :hierarchy, below root"
        raise ReadError(path, lost[0].line, f"bone {shown(lost[0].name)} does not hang from the root", mend)
    return order


def _values(path: Path, line: int, words: list[str], count: int) -> list[float]:
    if len(words) != count + 1:
        raise ReadError(path, line, f"{shown(words[0])} has {len(words) - 1} values", f"it needs {count}")
    values: list[float] = to_numbers(path, [(line, words[1:])]).tolist()
    return values


def _axis_order(path: Path, line: int, word: str) -> str:
    if sorted(word.lower()) != ["x", "y", "z"]:
        raise ReadError(
            path, line, f"{shown(word)} is no order of axes", "use XYZ or another order of the three"
        )
    return word.lower()


def _dofs(path: Path, line: int, words: list[str]) -> tuple[str, ...]:
    dofs = tuple(word.lower() for word in words)
    for dof in dofs:
        if dof not in DOFS or dofs.count(dof) > 1:
            raise ReadError(
                path,
                line,
                f"degree of freedom {shown(dof)} is unknown or stands twice",
                f"use {' '.join(DOFS)}",
            )
    return dofs
