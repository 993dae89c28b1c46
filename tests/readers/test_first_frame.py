"""The rest pose in frame 0: dropped where there is one, and nowhere else."""

from pathlib import Path

import numpy as np
import pytest

from motionary.pipeline.motion import Motion, Skeleton
from motionary.pipeline.readers import read_motion
from motionary.pipeline.readers.first_frame import drop_rest_frame

SKELETON = Skeleton(("hips", "leg", "spine"), (-1, 0, 0), np.array([[0, 0, 0], [0, -90, 0], [0, 60, 0]]))


def walk(frames: int, step: float, first_step: float, scale: float = 1.0) -> Motion:
    path = np.zeros((frames, 3))
    path[1:, 2] = first_step + step * np.arange(frames - 1)
    rotations = np.tile([0.0, 0, 0, 1], (frames, 3, 1))
    skeleton = Skeleton(SKELETON.names, SKELETON.parents, SKELETON.offsets * scale)
    return Motion("walk", skeleton, 30, path * scale, rotations)


@pytest.mark.parametrize("scale", [0.01, 1, 1000])
def test_a_jump_is_dropped_at_any_scale(scale: float) -> None:
    motion = drop_rest_frame(walk(20, step=2, first_step=200, scale=scale))
    assert motion.frames == 19
    assert motion.root_position[0, 2] == 200 * scale
    assert "frame 0 dropped" in motion.notes[0]


@pytest.mark.parametrize(
    ("frames", "step", "first_step"),
    [(20, 2, 2), (20, 50, 200), (20, 0.1, 10), (3, 2, 200), (1, 0, 0), (4, 0, 0)],
    ids=["steady", "fast", "small against the body", "too few frames", "one frame", "still"],
)
def test_no_jump_is_kept(frames: int, step: float, first_step: float) -> None:
    motion = walk(frames, step, first_step)
    assert drop_rest_frame(motion) is motion


@pytest.mark.parametrize("clip", ["cmu/007_03", "cmu/007_04", "cmu/007_12", "pairs/01_01"])
def test_real_rest_poses(shared_data: Path, clip: str) -> None:
    path = shared_data / f"{clip}.bvh"
    dropped, whole = read_motion(path), read_motion(path, keep_first_frame=True)
    assert dropped.frames == whole.frames - 1
    np.testing.assert_allclose(dropped.rotations, whole.rotations[1:], atol=1e-15)
    assert "frame 0 dropped" in dropped.notes[-1]
