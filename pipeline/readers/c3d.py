"""C3D: markers in space, and no skeleton. What comes of it is a motion of markers: places without rotations.

Which markers make which joint says a marker set, see `motionary.pipeline.readers.markers`. The axis that
points up is that of the parameter POINT:Y_SCREEN, else Z, the format's usual one (c3d.org); +Z goes to +Y by
-90 degrees about X. Units and rate are the file's. A marker that is unseen for up to half a second is filled
in along a straight line, or held at the ends; over longer gaps a take is refused.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.canonical import CANONICAL_JOINTS, CANONICAL_PARENTS, Convention
from motionary.pipeline.motion import FloatArray, Motion, Skeleton
from motionary.pipeline.readers.errors import ReadError, opening
from motionary.pipeline.readers.extent import check_extent
from motionary.pipeline.readers.markers import joints_of
from motionary.pipeline.readers.text import LARGEST, shown

_KEY = 0x50  # second byte of every C3D
_UNITS = {"mm": 0.001, "cm": 0.01, "m": 1.0}
_TO_Y = {
    "+Z": ("X", -90), "-Z": ("X", 90), "+Y": ("X", 0), "-Y": ("X", 180), "+X": ("Z", 90), "-X": ("Z", -90),
}  # fmt: skip
_SECONDS, _SECONDS_PER_BYTE = 60, 1e-6
_AGAIN = "copy the file again, or export it again from the capture software"


def read_c3d(path: Path, conventions: Iterable[Convention] = ()) -> Motion:
    """Read a C3D file.

    Parameters
    ----------
    path : Path
    conventions : iterable of Convention
        A user's own, which may be marker sets; they come before the built-in sets.

    Returns
    -------
    Motion
        Of markers: the 19 canonical joints by their canonical names, Y up.

    Raises
    ------
    ReadError
        ezc3d is not installed, or cannot read the file; no marker set fits, or a marker is unseen for long.
    """
    file = _points(path)
    points, fps = np.asarray(file["points"], dtype=np.float64), float(file["rate"])
    check_extent(path, len(points), fps)
    usable = np.abs(points) <= LARGEST  # false for what is not a number
    unseen = ~np.asarray(usable.all(axis=2) & points.any(axis=2))  # some programs write 0 0 0
    points = np.where(unseen[..., None], np.nan, points)
    joints, notes = joints_of(path, file["labels"].tolist(), points, fps, conventions)
    stated = str(file["up"]).upper()
    up = next((axis for axis in _TO_Y if stated in (axis, axis.removeprefix("+"))), "+Z")
    axis, angle = _TO_Y[up]
    joints = Rotation.from_euler(axis, angle, degrees=True).apply(joints.reshape(-1, 3)).reshape(joints.shape)
    said = "as the file says" if stated else "assumed: the file does not say"
    return Motion(
        name=path.stem,
        skeleton=_skeleton(joints),
        fps=fps,
        root_position=joints[:, 0],
        rotations=np.empty((len(joints), 0, 4)),
        unit=_UNITS.get(str(file["unit"]).lower()),
        source=str(path),
        notes=(*notes, "places of joints only: it cannot be written as BVH", f"{up} is up, {said}"),
        places=joints - joints[:, :1],
    )


def _skeleton(joints: FloatArray) -> Skeleton:
    """Return the canonical tree; an offset's length is the bone's median one, its direction means nothing."""
    offsets = np.zeros((len(CANONICAL_JOINTS), 3))
    for joint, parent in enumerate(CANONICAL_PARENTS[1:], 1):
        offsets[joint, 1] = np.median(np.linalg.norm(joints[:, joint] - joints[:, parent], axis=1))
    return Skeleton(CANONICAL_JOINTS, CANONICAL_PARENTS, offsets)


def _points(path: Path) -> Mapping[str, np.ndarray]:
    size = _checked_size(path)
    if importlib.util.find_spec("ezc3d") is None:
        mend = "install it: pip install 'motionary[c3d]'"
        what = "C3D files are read by ezc3d, which is not installed"
        raise ReadError(path, None, what, mend) from ModuleNotFoundError("ezc3d")
    program = Path(__file__).with_name("c3d_points.py")
    with tempfile.TemporaryDirectory(prefix="motionary-") as folder:
        out = Path(folder, "points.npz")
        try:
            done = subprocess.run(
                [sys.executable, "-I", program, path.absolute(), out],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_SECONDS + _SECONDS_PER_BYTE * size,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            what = f"ezc3d did not finish it in {error.timeout:.0f} seconds"
            raise ReadError(path, None, what, _AGAIN) from TimeoutError()
        except OSError as error:
            what = f"ezc3d could not be started ({error.strerror})"
            raise ReadError(path, None, what, "make room, and run again") from error
        if done.returncode or not out.exists():
            said = done.stderr.decode("utf-8", "replace").strip().splitlines()
            why = (
                shown(said[-1], 120)
                if said and done.returncode > 0
                else f"it ended by signal {-done.returncode}"
            )
            raise ReadError(path, None, f"ezc3d cannot read it ({why})", _AGAIN)
        with np.load(out, allow_pickle=False) as arrays:
            return dict(arrays)


def _checked_size(path: Path) -> int:
    """Return a file's size in bytes, once it is clear that it may be a C3D."""
    with opening(path):
        with path.open("rb") as file:
            start = file.read(2)
        size = path.stat().st_size
    if len(start) < 2 or start[1] != _KEY:
        raise ReadError(path, None, "this is no C3D: its second byte is another", _AGAIN)
    return size
