"""Readers: a file of motion capture becomes a `Motion`, and nothing downstream asks which format it was.

`FORMATS` is the registry: suffix -> name of the format. `read_motion` chooses by it; `scan_library` finds
the clips of a folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Literal

from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import Convention
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers.amass import read_amass
from motionary.pipeline.readers.amc import read_amc
from motionary.pipeline.readers.bvh import PositionRule, read_bvh
from motionary.pipeline.readers.c3d import read_c3d
from motionary.pipeline.readers.errors import ReadError
from motionary.pipeline.readers.first_frame import drop_rest_frame
from motionary.pipeline.readers.library import FORMATS, Source, scan_library
from motionary.pipeline.readers.zipped import as_files, members_of

__all__ = ["FORMATS", "ReadError", "Source", "read_motion", "scan_library"]


def read_motion(
    path: str | os.PathLike[str],
    *,
    unit: float | None = None,
    fps: float | None = None,
    position_rule: PositionRule | None = None,
    skeleton: str | os.PathLike[str] | None = None,
    up: Literal["y", "z"] = "y",
    keep_first_frame: bool = False,
    conventions: Iterable[Convention] = (),
) -> Motion:
    """Read a motion capture file, by its suffix: see this folder's README. Capitals count as small letters.

    Parameters
    ----------
    path : path
        What lies in a zip too: `takes.zip/walk/01.bvh`.
    unit : float, optional
        Metres in one unit of the file; by default what the file says (an ASF does, a BVH does not).
    fps : float, optional
        Frames a second; by default what the file says. An AMC says nothing: see `readers.amc`.
    position_rule : {"add", "replace"}, optional
        BVH: whether position channels are added to OFFSETs or replace them; by default judged from the
        file, see `readers.bvh`.
    skeleton : path, optional
        AMC: its ASF; by default found by its name, see `readers.amc`.
    up : {"y", "z"}
        BVH, AMC: the file's axis that points up. "z" turns the world by -90 degrees about X: +Z becomes up,
        and a figure facing -Y faces +Z. Neither format says which it is. Files whose root joint itself turns
        Z-up into Y-up (iClone's RL_BoneRoot) need no "z".
    keep_first_frame : bool
        BVH, AMC: keep a rest pose in frame 0 that would be dropped, see `readers.first_frame`.
    conventions : iterable of Convention
        C3D: a user's own marker sets, tried before the built-in ones, see `readers.markers`.

    Returns
    -------
    Motion
        T frames of J joints, Y up, the pelvis first; `notes` says what was assumed or changed. An option
        that does not concern the file's format is passed over, so that one set serves a mixed library.

    Raises
    ------
    ReadError
        The file cannot be read: path, line, what is wrong, how to mend it.
    ValueError
        An option has a value it cannot have.
    """
    _check_options(unit, fps, position_rule, up)
    source = Path(path)
    with as_files(source, Path(skeleton) if skeleton is not None else None) as (file, beside):
        motion = _read(file, beside, position_rule, conventions)
    if file != source:  # of a zip; `replace` would normalise the rotations again, and change their last bits
        object.__setattr__(motion, "name", source.stem)
        object.__setattr__(motion, "source", str(source))
    says_little = FORMATS[source.suffix.lower()] in ("bvh", "asf/amc")
    if says_little and not keep_first_frame:
        motion = drop_rest_frame(motion)
    if says_little and up == "z":
        motion = _z_up_to_y_up(motion)
    if fps is not None:
        motion = replace(
            motion, fps=fps, notes=(*motion.notes, f"{fps:g} frames a second as the caller says")
        )
    return replace(motion, unit=unit) if unit is not None else motion


def _read(
    path: Path,
    skeleton: Path | None,
    position_rule: PositionRule | None,
    conventions: Iterable[Convention],
) -> Motion:
    match FORMATS.get(path.suffix.lower()):
        case "bvh":
            return read_bvh(path, position_rule=position_rule)
        case "asf/amc":
            return read_amc(path, skeleton=skeleton)
        case "amass":
            return read_amass(path)
        case "c3d":
            return read_c3d(path, conventions)
        case "zip":
            members_of(path)
            mend = f"name one of them, as in {path.name}/walk.bvh"
            raise ReadError(path, None, "a zip is a folder of motions, not one", mend)
        case _:
            known = ", ".join(one for one in sorted(FORMATS) if one != ".zip")
            what = f"files of type {path.suffix or 'none'} are not read"
            raise ReadError(path, None, what, f"give one of type {known} (an .asf comes with its .amc)")


def _check_options(unit: float | None, fps: float | None, rule: str | None, up: str) -> None:
    for name, value in (("unit", unit), ("fps", fps)):
        if value is not None and not (value > 0 and math.isfinite(value)):
            raise ValueError(f"{name} is {value}; it must be a positive number")
    if rule not in (None, "add", "replace"):
        raise ValueError(f"position_rule is {rule!r}; it must be 'add', 'replace' or None")
    if up not in ("y", "z"):
        raise ValueError(f"up is {up!r}; it must be 'y' or 'z'")


def _z_up_to_y_up(motion: Motion) -> Motion:
    turn = Rotation.from_euler("X", -90, degrees=True)
    rotations = motion.rotations.copy()
    rotations[:, 0] = (turn * Rotation.from_quat(rotations[:, 0])).as_quat()
    note = "world turned by -90 degrees about X: the file is Z-up as the caller says"
    return replace(
        motion,
        root_position=turn.apply(motion.root_position),
        rotations=rotations,
        notes=(*motion.notes, note),
    )
