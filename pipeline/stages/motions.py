"""Motions in and out of the tables `clips` (their skeletons) and `frames` or `aligned` (their poses).

Of a motion of markers, which has no rotations, the column `rotations` holds the places of its joints from the
root, x y z, joint by joint: three values a joint of its skeleton instead of four.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pyarrow as pa

from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.stages.columns import matrix, per_clip, vectors
from motionary.pipeline.tables import TABLES


def motion_rows(clip_id: str, motion: Motion) -> pa.Table:
    """Write a motion as rows of `frames`; `aligned` has the same columns."""
    frames = motion.frames
    root = motion.root_position.astype(np.float32).reshape(-1)
    joints = motion.rotations if motion.places is None else motion.places
    columns = {
        "clip_id": pa.repeat(clip_id, frames),
        "frame": np.arange(frames, dtype=np.int32),
        "root_position": pa.FixedSizeListArray.from_arrays(root, 3),
        "rotations": vectors(joints.astype(np.float32).reshape(frames, -1)),
    }
    return pa.table(columns, schema=TABLES["frames"])


def skeleton_record(skeleton: Skeleton) -> dict[str, list]:
    """Write a skeleton as a value of the column `skeleton`."""
    return {
        "joints": list(skeleton.names),
        "parents": list(skeleton.parents),
        "offsets": skeleton.offsets.ravel().tolist(),
    }


def read_motions(clips: pa.Table, frames: pa.Table) -> Iterator[tuple[str, Motion]]:
    """Read the motions of a batch, in the order of its clips."""
    rows = per_clip(frames)
    for clip in clips.to_pylist():
        yield clip["clip_id"], read_motion_rows(clip, rows[clip["clip_id"]], clip["fps"])


def read_motion_rows(clip: Mapping, rows: pa.Table, fps: float) -> Motion:
    """Read one motion.

    Parameters
    ----------
    clip : mapping
        Its row of `clips`.
    rows : pyarrow.Table
        Its rows of `frames` or `aligned`.
    fps : float
        Frames a second of those rows.
    """
    record = clip["skeleton"]
    skeleton = Skeleton(
        tuple(record["joints"]), tuple(record["parents"]), np.array(record["offsets"]).reshape(-1, 3)
    )
    joints = matrix(rows["rotations"])
    of_markers = joints.shape[1] == 3 * len(skeleton.names)
    return Motion(
        name=clip["clip_id"],
        skeleton=skeleton,
        fps=fps,
        root_position=matrix(rows["root_position"]),
        rotations=np.empty((len(rows), 0, 4)) if of_markers else joints.reshape(len(rows), -1, 4),
        places=joints.reshape(len(rows), -1, 3) if of_markers else None,
        unit=clip["unit"],
        source=clip["path"],
        notes=tuple(clip["notes"]),
    )
