"""AMC: the frames of a motion, a line of values per bone, for the skeleton of an ASF file.

The ASF is the one in the same folder whose stem is the longest that begins the AMC's stem
(`HDM_bk_sneak_006_120.AMC` belongs to `HDM_bk.asf`). Bones may come in any order. A bone that the file never
names rests and is noted; one that only some frames name is an error. Translations of bones other than
the root, and changes of length (`l`), are left out and noted.

The format holds no rate: it is a common capture rate at the end of the name (`_120`), else 120.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.readers.asf import ROOT, AsfSkeleton, read_asf
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.euler import quaternions_from_euler
from motionary.pipeline.readers.text import read_lines, shown, to_count, to_numbers

Frame = dict[str, tuple[int, list[str]]]  # bone -> its line number and its values

_RATE_IN_NAME = re.compile(r"_(100|120|200|240|250)$")
_USUAL_RATE = 120.0  # CMU and HDM05


def read_amc(path: Path, *, skeleton: Path | None = None) -> Motion:
    """Read an AMC file and the ASF it belongs to.

    Parameters
    ----------
    path : Path
    skeleton : Path, optional
        The ASF; by default found by its name.

    Returns
    -------
    Motion
        One joint per bone, at the bone's start, after `root`; lengths in the ASF's units.

    Raises
    ------
    ReadError
        There is no ASF, or one of the two files is malformed, cut short or does not fit the other.
    """
    lines = read_lines(path)
    asf = read_asf(skeleton or _skeleton_of(path))
    degrees = _in_degrees(lines, asf.degrees)
    frames, starts = _frames(path, lines, {name: len(bone.dof) for name, bone in asf.bones.items()})
    notes = _check_complete(path, frames, starts, asf)
    channels = {name: to_numbers(path, [frame[name] for frame in frames]) for name in frames[0]}
    values = {name: array.reshape(len(frames), -1) for name, array in channels.items()}
    rotations = [_local_rotation(asf, name, values.get(name), degrees, len(frames)) for name in asf.bones]
    named = rate_in_name(path.stem)
    rate_note = "by the file's name" if named else "assumed: the format holds no rate"
    fps = named or _USUAL_RATE
    return Motion(
        name=path.stem,
        skeleton=_skeleton(asf),
        fps=fps,
        root_position=_root_position(asf, values[ROOT]),
        rotations=np.stack([turn.as_quat() for turn in rotations], axis=1),
        unit=asf.unit,
        source=str(path),
        notes=(f"{fps:g} frames a second {rate_note}", *notes, *_left_out(asf, values)),
    )


def rate_in_name(stem: str) -> float | None:
    """Return the frames a second that an AMC's name ends with, if it does."""
    match = _RATE_IN_NAME.search(stem)
    return float(match[1]) if match else None


def find_skeleton(stem: str, candidates: Iterable[Path]) -> Path | None:
    """Choose an AMC's ASF: the longest stem that begins `stem`, among equals the first by name."""
    fitting = [path for path in candidates if stem.startswith(path.stem)]
    return min(fitting, key=lambda path: (-len(path.stem), path.name), default=None)


def skeletons_in(folder: Path) -> list[Path]:
    """List the ASF files of a folder, `.ASF` in capitals too; none where the folder may not be listed."""
    try:
        return sorted(path for path in folder.iterdir() if path.suffix.lower() == ".asf")
    except OSError:
        return []


def _skeleton_of(path: Path) -> Path:
    candidates = skeletons_in(path.parent)
    found = find_skeleton(path.stem, candidates)
    if found is None:
        there = ", ".join(p.name for p in candidates[:10]) or "none"
        mend = "put its ASF beside it, named as the AMC's name begins, or give skeleton="
        raise ReadError(path, 1, f"no ASF belongs to it (ASF files in its folder: {there})", mend)
    return found


def _in_degrees(lines: Sequence[str], default: bool) -> bool:
    for line in lines:
        match line.strip().lower():
            case ":degrees":
                return True
            case ":radians":
                return False
            case word if word.isdigit():
                break
    return default


def _frames(path: Path, lines: Sequence[str], sizes: dict[str, int]) -> tuple[list[Frame], list[int]]:
    """Split the lines into frames and the lines they start at; `sizes` is each bone's number of values."""
    frames: list[Frame] = []
    starts: list[int] = []
    previous = -1
    for line, text in enumerate(lines, 1):
        words = text.split()
        if not words or text.lstrip().startswith(("#", "//", ":")):
            continue
        if len(words) == 1 and (number := to_count(words[0])) is not None:
            if frames and number != previous + 1:
                mend = "frames are missing or out of order: copy or export the file again"
                raise ReadError(path, line, f"frame {number} follows frame {previous}", mend)
            frames.append({})
            starts.append(line)
            previous = number
            continue
        bone = words[0]
        if not frames:
            mend = "an AMC has a frame number first; check that this is an AMC file"
            raise ReadError(path, line, f"{shown(text)} stands before the first frame", mend)
        if len(words) - 1 != sizes.get(bone):
            raise _bone_error(path, line, words, sizes, last=line >= len(lines) - 1)
        if bone in frames[-1]:
            raise ReadError(
                path, line, f"bone {shown(bone)} stands twice in frame {previous}", "keep one line"
            )
        frames[-1][bone] = (line, words[1:])
    if not frames:
        raise ReadError(path, len(lines), "the file has no frames", "copy or export it again")
    return frames, starts


def _bone_error(path: Path, line: int, words: list[str], sizes: dict[str, int], last: bool) -> ReadError:
    cut = "the file is cut short: copy or export it again"
    if words[0] not in sizes:
        what = f"bone {shown(words[0])} is not in the ASF"
        return ReadError(path, line, what, cut if last else "this AMC belongs to another ASF: give skeleton=")
    what = f"bone {shown(words[0])} has {len(words) - 1} values and {sizes[words[0]]} degrees of freedom"
    return ReadError(path, line, what, cut if last else "mend the line, or give the right ASF as skeleton=")


def _check_complete(path: Path, frames: list[Frame], starts: list[int], asf: AsfSkeleton) -> list[str]:
    """Raise unless all frames name the same bones; return a note on the bones that none names."""
    named = set().union(*frames)
    for place, (frame, start) in enumerate(zip(frames, starts, strict=True), 1):
        missing = sorted(named - frame.keys())
        if missing:
            end = ": the file is cut short there" if place == len(frames) else ""
            what = f"the {place}. frame has no line for bone {shown(missing[0])}{end}"
            raise ReadError(path, start, what, "copy or export the file again, or cut this frame off")
    if ROOT not in named:
        raise ReadError(path, starts[0], "no frame has a line for the root", "export the file again")
    resting = [name for name, bone in asf.bones.items() if bone.dof and name not in named]
    return [f"bones without a line, held at rest: {', '.join(resting)}"] if resting else []


def _local_rotation(
    asf: AsfSkeleton, name: str, values: FloatArray | None, degrees: bool, frames: int
) -> Rotation:
    turn = Rotation.identity(frames)
    if values is not None:
        dofs = asf.bones[name].dof
        # An intrinsic product begins with the outermost rotation; the one applied first is the innermost.
        columns = [i for i in reversed(range(len(dofs))) if dofs[i].startswith("r")]
        angles = np.radians(values[:, columns]) if degrees else values[:, columns]
        turn = Rotation.from_quat(quaternions_from_euler(["xyz".index(dofs[i][1]) for i in columns], angles))
    frame = asf.frame(name)
    return turn * frame if name == ROOT else frame * turn * frame.inv()


def _root_position(asf: AsfSkeleton, values: FloatArray) -> FloatArray:
    position = np.tile(np.array(asf.position), (len(values), 1))
    for dof, column in zip(asf.bones[ROOT].dof, values.T, strict=True):
        if dof.startswith("t"):
            position[:, "xyz".index(dof[1])] += column
    return position


def _skeleton(asf: AsfSkeleton) -> Skeleton:
    names = list(asf.bones)
    place = {name: number for number, name in enumerate(names)}
    ends = {name: np.array(bone.direction) * bone.length for name, bone in asf.bones.items()}
    parents = (-1, *(place[asf.parents[name]] for name in names[1:]))
    offsets = np.array([np.zeros(3), *(ends[asf.parents[name]] for name in names[1:])])
    return Skeleton(tuple(names), parents, offsets)


def _left_out(asf: AsfSkeleton, values: dict[str, FloatArray]) -> list[str]:
    notes = []
    for name, array in values.items():
        dofs = asf.bones[name].dof
        columns = [i for i, dof in enumerate(dofs) if dof == "l" or (dof[0] == "t" and name != ROOT)]
        if columns and array[:, columns].any():
            largest = np.abs(array[:, columns]).max()
            notes.append(f"translation or change of length of bone {name!r} left out, at most {largest:g}")
    return notes
