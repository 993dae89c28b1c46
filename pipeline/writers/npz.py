"""NPZ out of a motion: arrays that NumPy reads with nothing else installed, and without pickle.

| array | is |
|---|---|
| positions (T, J, 3) float32 | joints in the world, Y up, source units |
| rotations (T, J, 4) float32 | local unit quaternions x, y, z, w; the root's turns it into the world |
| root_position (T, 3) float32 | the root joint in the world, source units |
| joint_names (J,) text | the root first |
| parents (J,) int32 | -1 for the root |
| offsets (J, 3) float64 | each joint in its parent's frame, source units |
| fps () float64 | frames a second |
| unit () float64 | metres in one source unit; not a number where unknown |
| name, label () text | of the clip; an empty label where it has none |

A motion of markers has no rotations: (T, 0, 4), and its offsets say no more than how long the bones are.
"""

from __future__ import annotations

import os

import numpy as np

from motionary.pipeline.motion import Motion
from motionary.pipeline.writers.whole import whole_file


def write_npz(motion: Motion, path: str | os.PathLike[str], *, label: str | None = None) -> None:
    """Write a motion as a compressed NPZ of the arrays that this module's page lists.

    Parameters
    ----------
    motion : Motion
    path : path
        Replaced in one step once the whole file is written.
    label : str, optional
        What the motion is called.
    """
    skeleton = motion.skeleton
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file,
            positions=motion.positions().astype(np.float32),
            rotations=motion.rotations.astype(np.float32),
            root_position=motion.root_position.astype(np.float32),
            joint_names=np.array(skeleton.names),
            parents=np.array(skeleton.parents, dtype=np.int32),
            offsets=skeleton.offsets,
            fps=np.float64(motion.fps),
            unit=np.float64(np.nan if motion.unit is None else motion.unit),
            name=np.array(motion.name),
            label=np.array(label or ""),
        )
