"""CSV out of a motion: a row a frame, for spreadsheets, R, and whatever reads columns of numbers.

| column | is |
|---|---|
| frame | from 0 |
| seconds | from the first frame |
| x.JOINT, y.JOINT, z.JOINT | each joint in the world, Y up, source units |
| qx.JOINT, qy.JOINT, qz.JOINT, qw.JOINT | its local unit quaternion; the root's turns it into the world |

Numbers are the shortest that give the same 32-bit float back. A motion of markers has no rotations, and no
columns of them. The axis stands before the joint's name, so that no name of a column begins like a formula,
whatever a joint is called.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
from numpy.typing import NDArray

from motionary.pipeline.motion import Motion
from motionary.pipeline.writers.whole import whole_file


def write_csv(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write a motion as a CSV of the columns that this module's page lists.

    Parameters
    ----------
    motion : Motion
    path : path
        Replaced in one step once the whole file is written; UTF-8.
    """
    frames = np.arange(motion.frames)
    columns: dict[str, NDArray[Any]] = {"frame": frames, "seconds": frames / motion.fps}
    for axes, values in ((("x", "y", "z"), motion.positions()), (("qx", "qy", "qz", "qw"), motion.rotations)):
        numbers = values.astype(np.float32)
        for joint, name in enumerate(motion.skeleton.names[: values.shape[1]]):
            columns |= {f"{axis}.{name}": numbers[:, joint, place] for place, axis in enumerate(axes)}
    with whole_file(path) as temporary:
        pa.csv.write_csv(pa.table(columns), temporary)
