"""Every clip of the shared data reads, with the frames and the rate its label says."""

import csv
from pathlib import Path

import numpy as np
import pytest

from motionary.pipeline.readers import read_motion

REST_POSES = {"cmu/007_03.bvh", "cmu/007_04.bvh", "cmu/007_12.bvh", "pairs/01_01.bvh"}


def check(shared_data: Path, step: int) -> None:
    with (shared_data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))[::step]
    dropped = set()
    for row in rows:
        motion = read_motion(shared_data / row["path"])
        if any("frame 0 dropped" in note for note in motion.notes):
            dropped.add(row["path"])
        assert motion.frames == int(row["frames"]) - (row["path"] in dropped), row["path"]
        assert motion.fps == float(row["fps"]), row["path"]
        assert motion.skeleton.names[0] in ("Hips", "CC_Base_Hip", "root")
        height = (
            0.01 * motion.positions()[:, :, 1]
            if motion.unit is None
            else motion.unit * motion.positions()[:, :, 1]
        )
        if row["path"] != "pairs/01_01.bvh":  # its unit is the ASF's, which a BVH does not say
            assert -0.2 < np.percentile(height.min(axis=1), 10) < 0.2, row[
                "path"
            ]  # metres: somebody stands there
    assert dropped == REST_POSES & {row["path"] for row in rows}


def test_a_sample_of_all_clips(shared_data: Path) -> None:
    check(shared_data, 12)


@pytest.mark.slow
def test_all_clips(shared_data: Path) -> None:
    check(shared_data, 1)
