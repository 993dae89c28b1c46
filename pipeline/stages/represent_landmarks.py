"""Clusters by landmarks -> the clip that represents each: as `represent`, by distances computed here.

Of a cluster not all pairs are stored. A reference takes one distance for each of its clips; a medoid, which
a cluster without a similarity index gets, all pairs of it, or in a large one those with a thousand clips.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.clustering.landmark_steps import LEAST_LANDMARKS, sample_clips
from motionary.pipeline.config import AlignmentConfig, ClusterConfig, DistanceConfig
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.clip_frames import Measure, frames_of
from motionary.pipeline.stages.clustered_pairs import rounded
from motionary.pipeline.stages.columns import matrices_by_clip, places_by_clip
from motionary.pipeline.stages.compare import thresholds_of
from motionary.pipeline.stages.represent import digests_of, represent_by


def represent_landmarks(
    members: pa.Table,
    ingested: pa.Table,
    centres: pa.Table,
    reference_features: pa.Table,
    resampled: Parts,
    features: Parts,
    kept: Mapping[int, str],
    distances: DistanceConfig,
    config: ClusterConfig,
    alignment: AlignmentConfig,
    room: int,
) -> dict[str, pa.Table]:
    """Choose each cluster's reference by the similarity index.

    Parameters
    ----------
    resampled : Parts
        The merged frames of all clips.
    distances : DistanceConfig
        The thresholds of the curve.
    members, ingested, centres, reference_features, features, kept, config, alignment, room
        As for `motionary.pipeline.stages.represent.represent`.

    Returns
    -------
    dict of str to pyarrow.Table
        `represented`, `centres` and `reference_features`.
    """
    digests, thresholds = digests_of(ingested), thresholds_of(distances)
    clusters = members["cluster_id"].to_numpy()
    inside = _ComparedInside(resampled, members["clip_id"], clusters, digests, thresholds)
    return represent_by(inside, digests, centres, reference_features, features, kept, config, alignment, room)


@dataclass(frozen=True, eq=False)
class _ComparedInside:
    """Distances inside clusters, computed when they are asked for; see `clustered_pairs.Inside`."""

    resampled: Parts
    clip_ids: pa.ChunkedArray
    clusters: NDArray[np.integer]
    digests: Mapping[str, str]
    thresholds: tuple[float, ...]

    def distances_to(self, reference: NDArray[np.int64], column: str) -> NDArray[np.float64]:
        ids, places = self.clip_ids.to_pylist(), places_by_clip(self.clip_ids)
        measure, distances = Measure((column,), self.thresholds), np.zeros(len(ids))
        representing = frames_of(self.resampled, [ids[place] for place in np.unique(reference).tolist()])
        for part in self.resampled.read(["clip_id", "feature"]):
            together: dict[int, dict[int, NDArray]] = {}
            for clip_id, frames in matrices_by_clip(part).items():
                place = places[clip_id]
                if reference[place] != place:
                    together.setdefault(int(reference[place]), {})[place] = frames
            for one, clips in together.items():
                found = measure.between([*clips.values()], [representing[ids[one]]])
                distances[[*clips]] = found[0, :, 0]
        return distances

    def sums(self, column: str, clusters: Collection[int]) -> NDArray[np.float64]:
        ids, sums = self.clip_ids.to_pylist(), np.zeros(len(self.clip_ids))
        measure = Measure((column,), self.thresholds)
        asked = np.flatnonzero(np.isin(self.clusters, [*clusters]))
        frames_by_clip = frames_of(self.resampled, [ids[place] for place in asked])
        for cluster_id in sorted(clusters):
            members = np.flatnonzero(self.clusters == cluster_id)
            own = [ids[place] for place in members]
            some = sample_clips([self.digests[one] for one in own], LEAST_LANDMARKS)
            frames = [frames_by_clip[one] for one in own]
            found = measure.between(frames, [frames[place] for place in some])[0]
            found[some, np.arange(len(some))] = 0
            sums[members] = rounded(found).sum(axis=1)
        return sums
