"""The HIERARCHY section of a BVH file.

A statement is a brace, or the words of a line between braces; names may hold blanks. Each joint keeps
its channels as pairs of kind and axis in the file's order, so any Euler order, mixed per joint, and
rotations before positions are all read by the same code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.text import shown, to_count, to_numbers, without_comment

_CHANNELS = {
    f"{axis}{kind}": (kind, "xyz".index(axis)) for axis in "xyz" for kind in ("position", "rotation")
}
_END_SITE = -2


@dataclass
class BvhJoint:
    """A joint as its block in the file states it.

    Parameters
    ----------
    name : str
    parent : int
        Index of the joint whose block this one stands in; -1 for the root.
    line : int
        Where the block begins.
    offset : tuple of 3 floats, or None until its OFFSET is read
    channels : list of (kind, axis, column)
        Kind "position" or "rotation", axis 0 to 2, column of the frame line.
    """

    name: str
    parent: int
    line: int
    offset: tuple[float, ...] | None = None
    channels: list[tuple[str, int, int]] = field(default_factory=list)


@dataclass(frozen=True)
class Hierarchy:
    """Joints in file order, parents before children; channels of all; the line that says MOTION."""

    joints: list[BvhJoint]
    columns: int
    motion_line: int


def parse_hierarchy(path: Path, lines: Sequence[str]) -> Hierarchy:
    """Parse the lines down to MOTION.

    Raises
    ------
    ReadError
        No HIERARCHY, no ROOT or no MOTION; braces that do not pair; a joint without OFFSET; CHANNELS that
        are unknown or do not number what they say.
    """
    statements = _statements(lines)
    line, words = next(statements, (1, [""]))
    if words[0].upper() != "HIERARCHY":
        mend = "a BVH begins with HIERARCHY; check that this is a BVH file"
        raise ReadError(path, line, f"the file begins with {shown(' '.join(words))}", mend)
    builder = _Builder(path)
    for line, words in statements:
        if words[0].upper() == "MOTION":
            builder.close(line)
            return Hierarchy(builder.joints, builder.columns, line)
        builder.take(line, words)
    raise ReadError(
        path, len(lines), "there is no MOTION section", "the file is cut short: copy or export it again"
    )


def _statements(lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(lines, 1):
        words: list[str] = []
        for word in without_comment(line).replace("{", " { ").replace("}", " } ").split():
            if word in "{}":
                if words:
                    yield number, words
                yield number, [word]
                words = []
            else:
                words.append(word)
        if words:
            yield number, words


class _Builder:
    """Takes statements one by one; `stack` has the open blocks, `opening` one that waits for its brace."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.joints: list[BvhJoint] = []
        self.columns = 0
        self.stack: list[int] = []
        self.opening: int | None = None

    def take(self, line: int, words: list[str]) -> None:
        keyword = words[0].upper()
        if self.opening is not None and keyword != "{":
            raise self.error(
                line, f"a {{ is missing before {shown(' '.join(words))}", "open the joint's block"
            )
        match keyword:
            case "{":
                self.open_block(line)
            case "}":
                self.close_block(line)
            case "ROOT" | "JOINT":
                self.begin_joint(line, keyword, " ".join(words[1:]))
            case "END":
                self.current(line, "End Site")
                self.opening = _END_SITE
            case "OFFSET":
                self.offset(line, words[1:])
            case "CHANNELS":
                self.channels(line, words[1:])
            case _ if self.joints and not self.stack:
                what = f"expected MOTION and found {shown(' '.join(words))}"
                raise self.error(line, what, "the MOTION line is missing, or a } too many stands above")
            case _:
                known = "expected ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION"
                raise self.error(line, f"{shown(' '.join(words))} is not part of a hierarchy", known)

    def close(self, line: int) -> None:
        if self.stack or self.opening is not None:
            index = self.stack[0] if self.stack else self.opening
            name = self.joints[index].name if index is not None and index >= 0 else "End Site"
            what = f"{max(len(self.stack), 1)} block(s) are still open at MOTION, the outermost {shown(name)}"
            raise self.error(line, what, "close every { with a }")
        if not self.joints:
            raise self.error(line, "the hierarchy has no ROOT", "export the file again")
        if self.columns == 0:
            raise self.error(
                line, "no joint has a channel, so nothing can move", "export the file with its motion"
            )

    def open_block(self, line: int) -> None:
        if self.opening is None:
            raise self.error(line, "this { opens no joint", "remove it, or name the joint before it")
        self.stack.append(self.opening)
        self.opening = None

    def close_block(self, line: int) -> None:
        if not self.stack:
            raise self.error(
                line, "this } closes nothing", "remove it, or look for a { that is missing above"
            )
        index = self.stack.pop()
        if index != _END_SITE and self.joints[index].offset is None:
            raise self.error(line, f"joint {shown(self.joints[index].name)} has no OFFSET", "give it one")

    def begin_joint(self, line: int, keyword: str, name: str) -> None:
        if keyword == "ROOT" and self.joints:
            raise self.error(line, f"a second ROOT, {shown(name)}", "put each figure into a file of its own")
        if not name:
            raise self.error(line, f"{keyword} without a name", "name the joint")
        parent = -1 if keyword == "ROOT" else self.current(line, f"joint {shown(name)}")
        self.joints.append(BvhJoint(name, parent, line))
        self.opening = len(self.joints) - 1

    def offset(self, line: int, words: list[str]) -> None:
        if len(words) != 3:
            raise self.error(line, f"OFFSET has {len(words)} values", "it needs 3: x y z")
        place = tuple(to_numbers(self.path, [(line, words)]).tolist())
        if not self.stack:
            raise self.error(line, "OFFSET outside every joint", "look for a { or a } out of place above")
        if self.stack[-1] != _END_SITE:
            self.joints[self.stack[-1]].offset = place

    def channels(self, line: int, words: list[str]) -> None:
        joint = self.joints[self.current(line, "CHANNELS")]
        count = to_count(words[0]) if words else None
        names = words[1:]
        if count is None or count != len(names):
            raise self.error(
                line, f"CHANNELS says {shown(' '.join(words[:1]))} and names {len(names)}", "make them agree"
            )
        if joint.channels:
            raise self.error(
                line, f"joint {shown(joint.name)} has CHANNELS twice", "keep one of the two lines"
            )
        for name in names:
            if name.lower() not in _CHANNELS:
                raise self.error(line, f"channel {shown(name)} is unknown", "use Xposition .. Zrotation")
            kind, axis = _CHANNELS[name.lower()]
            if kind == "position" and any(other[:2] == (kind, axis) for other in joint.channels):
                raise self.error(line, f"channel {name} stands twice", "keep one of the two")
            joint.channels.append((kind, axis, self.columns))
            self.columns += 1

    def current(self, line: int, what: str) -> int:
        if not self.stack or self.stack[-1] == _END_SITE:
            place = "in an End Site" if self.stack else "outside every joint"
            raise self.error(line, f"{what} {place}", "look for a { or a } out of place above")
        return self.stack[-1]

    def error(self, line: int, what: str, mend: str) -> ReadError:
        return ReadError(self.path, line, what, mend)
