"""A program of its own that reads the points of a C3D through ezc3d: `c3d_points.py TAKE.c3d POINTS.npz`.

ezc3d follows what a damaged file says: in a trial of ours (1.7.2, a few bytes of the header or parameters
changed) 20 files in 400 ended the process and 2 read on for ever. So it runs apart, with bounds on memory
and, set by its caller, on time; a file that it fails on costs this process and not a worker. It imports NumPy
and ezc3d only, since it starts anew for every file.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

_ALLOWANCE, _PER_BYTE = 2 << 30, 64  # ezc3d keeps an object a point, which in the file is 16 bytes


def main(take: str, points: str) -> None:
    """Write an NPZ of the points (T, N, 3), not a number where unseen, their labels, rate, unit, axis up."""
    import ezc3d

    _bound_memory(take)
    file = ezc3d.c3d(take)
    about = file["parameters"]["POINT"]
    labels = _texts(about, "LABELS", "LABELS2", "LABELS3", "LABELS4")
    np.savez(
        points,
        points=np.moveaxis(file["data"]["points"][:3], 0, -1).swapaxes(0, 1),
        labels=np.array(labels or [""]),
        rate=np.float64(about["RATE"]["value"][0]),
        unit=np.array("".join(_texts(about, "UNITS")[:1])),
        up=np.array("".join(_texts(about, "Y_SCREEN")[:1])),
    )


def _texts(group: Any, *names: str) -> list[str]:
    return [str(one).strip() for name in names if name in group for one in group[name]["value"]]


def _bound_memory(take: str) -> None:
    try:
        import resource
    except ImportError:  # not there on Windows
        return
    with open(take, "rb") as file:  # noqa: PTH123 - a handle is enough
        most = _ALLOWANCE + _PER_BYTE * file.seek(0, 2)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:
        sys.exit(f"{error}" or type(error).__name__)
