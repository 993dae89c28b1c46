"""The sequences that are aligned: made-up smooth ones, and the poses of real clips by action."""

from __future__ import annotations

import csv
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment import select_reference
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import POSE_COLUMNS, frame_features
from motionary.pipeline.readers import read_motion
from tests.benchmarks.clips import REAL_CLIPS

REAL_DATA = REAL_CLIPS.parent
DATASETS = ("hdm05", "bandai-1", "bandai-2", "cmu-iclone")

Poses = NDArray[np.float32]
Classes = dict[tuple[str, str], list[Poses]]
Pair = tuple[NDArray, NDArray]
"""The sequence to be warped and its reference."""


def smooth_sequence(frames: int, dofs: int, seed: int, harmonics: int = 5) -> NDArray[np.float64]:
    """Return random harmonics of one period (frames, dofs)."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 1, frames)[:, None]
    phases, sizes = rng.random((harmonics, dofs)), rng.normal(size=(harmonics, dofs))
    turns = [(f + 1) * time + phase for f, phase in enumerate(phases)]
    return sum(size * np.sin(2 * np.pi * turn) for size, turn in zip(sizes, turns, strict=True))


def load_classes(most: int | None) -> Classes:
    """Read the real clips' poses as a run aligns them, by data set and action.

    Parameters
    ----------
    most : int, optional
        At most so many of an action.

    Returns
    -------
    dict of (data set, action) to list of array (frames, 57)
        At 30 frames a second, not merged, in the order of `labels.csv`.
    """
    config, paths = FeatureConfig(epsilon=0.0), defaultdict[tuple[str, str], list[str]](list)
    with (REAL_DATA / "labels.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if row["dataset"] in DATASETS:
                paths[row["dataset"], row["action"]].append(row["path"])
    classes: Classes = {}
    for key, members in paths.items():
        features = [frame_features(read_motion(REAL_DATA / path), config) for path in members[:most]]
        classes[key] = [one.values[:, :POSE_COLUMNS] for one in features]
    return classes


def to_references(classes: Classes, dataset: str, action: str | None = None) -> list[Pair]:
    """Pair every clip of a data set, or of one action of it, with the reference of its action."""
    pairs: list[Pair] = []
    for (of, what), poses in classes.items():
        if of == dataset and action in (None, what):
            reference = poses[select_reference(poses)]
            pairs += [(one, reference) for one in poses]
    return pairs


def long_pairs(classes: Classes, count: int, least: int, most: int) -> list[Pair]:
    """Draw ordered pairs within the actions of all data sets but HDM05, the reference of some length.

    Parameters
    ----------
    classes : dict
    count : int
        At most so many are drawn, by seed 0.
    least, most : int
        Frames of the reference.
    """
    pairs = [
        (moving, reference)
        for (dataset, _), poses in classes.items()
        if dataset != "hdm05"
        for moving in poses
        for reference in poses
        if moving is not reference and least <= len(reference) <= most
    ]
    chosen = np.random.default_rng(0).permutation(len(pairs))[:count]
    return [pairs[place] for place in chosen]
