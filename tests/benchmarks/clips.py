"""The clips that are compared: real ones where they lie beside the project, else the embedded library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import motion_features
from motionary.pipeline.motion import Motion
from motionary.pipeline.readers import read_motion
from motionary.pipeline.readers.library import scan_library
from motionary.pipeline.synthetic import synthetic_library

REAL_CLIPS = Path(__file__).resolve().parents[3] / "shared" / "data" / "hdm05"
EPSILONS = {"unmerged": 0.0, "merged": FeatureConfig().epsilon}

Clip = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class ClipSet:
    """Clips as one kind of features.

    Parameters
    ----------
    name : str
        What everybody calls it.
    clips : list of array (frames, d) float32
        The same values go to every contestant.
    """

    name: str
    clips: list[Clip]

    @property
    def pairs(self) -> int:
        """N (N-1) / 2."""
        return len(self.clips) * (len(self.clips) - 1) // 2

    @property
    def cells(self) -> int:
        """Cells of all pairs' cost matrices."""
        return sum(len(a) * len(b) for a, b in combinations(self.clips, 2))

    @property
    def dimensions(self) -> int:
        """Values a frame."""
        return self.clips[0].shape[1]

    def described(self) -> dict[str, object]:
        """Return the figures that a reader needs to judge a time."""
        lengths = [len(clip) for clip in self.clips]
        return {
            "clips": len(lengths),
            "pairs": self.pairs,
            "cells": self.cells,
            "mean_frames": float(np.mean(lengths)),
            "longest": max(lengths),
            "dimensions": self.dimensions,
        }


def load_library(embedded: bool, most: int | None) -> tuple[str, dict[str, ClipSet]]:
    """Read a library and compute its features, unmerged and merged.

    Parameters
    ----------
    embedded : bool
        Take the embedded library even where the real clips are.
    most : int, optional
        Take at most so many clips, spread over the library.

    Returns
    -------
    str, dict of ClipSet
        The library's name; its clips by the names in `EPSILONS`.
    """
    name, motions = _motions(embedded or not REAL_CLIPS.is_dir(), most)
    return name, {
        kind: ClipSet(kind, [motion_features(motion, FeatureConfig(epsilon=epsilon)) for motion in motions])
        for kind, epsilon in EPSILONS.items()
    }


def spread(items: Sequence, most: int | None) -> list:
    """Take at most so many items, at equal distances."""
    if most is None or most >= len(items):
        return list(items)
    return [items[index * len(items) // most] for index in range(most)]


def _motions(embedded: bool, most: int | None) -> tuple[str, list[Motion]]:
    if embedded:
        return "the embedded library", [take.motion for take in spread(synthetic_library(), most)]
    sources = spread(scan_library(REAL_CLIPS), most)
    return "HDM05, real clips", [read_motion(source.files[0]) for source in sources]
