"""Clips whose distances are computed when they are asked for.

Their merged frames lie in a temporary file, of which the system keeps in memory what there is room for; so do
the distances. Of the process's own memory it takes a part of the frames, a block of distances, and what grows
with the number of clips alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.clustering.landmark_steps import Places
from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import matrices_by_clip, per_clip

_BLOCK = 128

Frames = Sequence[NDArray[np.float32]]
"""Of every clip, an array (frames, d)."""


@dataclass(frozen=True)
class Measure:
    """Which distances are wanted: the columns of `pairs`, by the lambdas of the curve."""

    columns: tuple[str, ...]
    thresholds: tuple[float, ...]

    def between(self, rows: Frames, columns: Frames) -> NDArray[np.float32]:
        """Compare every clip of one list with every one of another: an array (channels, a, b)."""
        distances = mapped_array((len(self.columns), len(rows), len(columns)), np.float32)
        for top in range(0, len(rows), _BLOCK):
            for left in range(0, len(columns), _BLOCK):
                here = (slice(None), slice(top, top + _BLOCK), slice(left, left + _BLOCK))
                distances[here] = self._block(rows[here[1]], columns[here[2]])
        return distances

    def among(self, clips: Frames) -> NDArray[np.float32]:
        """Compare every two of some clips: an array (channels, m, m), of a clip with itself 0."""
        distances = mapped_array((len(self.columns), len(clips), len(clips)), np.float32)
        for top in range(0, len(clips), _BLOCK):
            for left in range(top, len(clips), _BLOCK):
                rows, columns = slice(top, top + _BLOCK), slice(left, left + _BLOCK)
                block = self._block(clips[rows], clips[columns])
                distances[:, rows, columns] = block
                distances[:, columns, rows] = np.swapaxes(block, 1, 2)
        clip = np.arange(len(clips))
        distances[:, clip, clip] = 0
        return distances

    def _block(self, rows: Frames, columns: Frames) -> NDArray[np.float32]:
        from motionary.pipeline.distances import compare_clips

        found = compare_clips(rows, columns, self.thresholds)
        return np.stack([getattr(found, name) for name in self.columns])


def channels_of(config: ClusterConfig) -> tuple[str, ...]:
    """Name the columns of `pairs` that the primary linkage works on."""
    return ("fuzzy_low", "fuzzy_high") if config.primary == "fuzzy" else (config.metric,)


@dataclass(frozen=True, eq=False)
class ClipFrames:
    """The merged frames of clips, and how often each was compared.

    Parameters
    ----------
    frames : sequence of array (frames, d)
        Of every clip.
    measure : Measure
        What is asked for.
    compared : array (m,)
        Pairs that were computed for every clip, each counted for one of the two.
    """

    frames: Frames
    measure: Measure
    compared: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "compared", np.zeros(len(self.frames), np.int64))

    def __call__(self, rows: Places, columns: Places) -> NDArray[np.float32]:
        """Return the distances (channels, a, b) of clips by their places."""
        if np.array_equal(rows, columns):
            self.compared[rows] += np.arange(len(rows))
            return self.measure.among([self.frames[place] for place in rows])
        self.compared[rows] += len(columns)
        return self.measure.between(
            [self.frames[place] for place in rows], [self.frames[place] for place in columns]
        )


def frames_of(resampled: Parts, clip_ids: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """Read the merged frames of clips into a temporary file; the parts are read twice.

    Raises
    ------
    ValueError
        A clip has none; it is named.
    """
    lengths: dict[str, int] = dict.fromkeys(clip_ids, 0)
    for part in resampled.read(["clip_id"]):
        for clip_id, rows in per_clip(part).items():
            if clip_id in lengths:
                lengths[clip_id] = len(rows)
    for clip_id in (clip_id for clip_id, length in lengths.items() if not length):
        raise ValueError(f"{clip_id} has no merged frames among those that it is to be compared by")
    ends = np.cumsum([*lengths.values()], dtype=np.int64)
    start = dict(zip(lengths, ends - [*lengths.values()], strict=True))
    held: NDArray[np.float32] | None = None
    for part in resampled.read(["clip_id", "feature"]):
        for clip_id, frames in matrices_by_clip(part).items():
            if clip_id in lengths:
                if held is None:
                    held = mapped_array((int(ends[-1]), frames.shape[1]), np.float32)
                held[start[clip_id] : start[clip_id] + len(frames)] = frames
    return {} if held is None else _cut(held, start, lengths)


def _cut(
    held: NDArray[np.float32], start: Mapping[str, int], lengths: Mapping[str, int]
) -> dict[str, NDArray[np.float32]]:
    return {clip_id: held[start[clip_id] : start[clip_id] + length] for clip_id, length in lengths.items()}
