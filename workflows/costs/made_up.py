"""Made-up clips by the hundred, to time what grows with the square of the clips.

They are copies of sampled clips at a little distance from each other. So they fall into clusters as the
sample does, and the tables of their pairs are read and linked as those of a library are.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog.store import Store
from motionary.pipeline.alignment import similarity_index
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.cluster import cluster
from motionary.pipeline.stages.cluster_pruned import cluster_pruned
from motionary.pipeline.stages.clustered_pairs import ClusteredPairs
from motionary.pipeline.stages.columns import matrix, pair_places, places_by_clip
from motionary.pipeline.tables import TABLES

CLIPS = (400, 1200)
"""Clips whose clustering is timed: at two sizes, to tell what each pair takes from what it takes at all."""

_PART = 1 << 16
_APART = 0.05  # of the mean distance: how far copies of one clip lie from each other, at most
_ALIKE, _FRAMES = 500, 64  # of the clips whose similarity index is timed


@dataclass(frozen=True)
class Squares:
    """What grows with the square of the clips takes, in seconds.

    Parameters
    ----------
    clusterings : tuple of (int, float)
        Clips, and what their clustering takes.
    passing : float
        What it takes to pass a pair by, where distances inside clusters are looked for.
    similarity : float
        What the similarity index takes for two clips of one cluster and a frame of them.
    """

    clusterings: tuple[tuple[int, float], ...]
    passing: float
    similarity: float


def time_squares(
    store: Store, ingested: pa.Table, pairs: pa.Table, features: pa.Table, config: PipelineConfig
) -> Squares:
    """Time it on made-up clips.

    Parameters
    ----------
    store : Store
        Takes the made-up pairs.
    ingested, pairs, features : pyarrow.Table
        Of the sample: at least two clips, their pairs, and frames. A pair that was left out is taken for
        infinitely far.
    config : PipelineConfig
        Linkage and cut, and which pairs are left out.
    """
    stage = cluster if config.most_distance is None else cluster_pruned
    nothing = pa.table({"clip_id": pa.array([], pa.string())}), TABLES["labels"].empty_table()
    clusterings = []
    for count in CLIPS:
        clips = _copies(ingested, count)
        parts = _pairs_of_copies(store, ingested, pairs, count, config.most_distance)
        start = time.perf_counter()
        stage(clips, parts, *nothing, config.clusters)
        clusterings.append((count, time.perf_counter() - start))
    return Squares(tuple(clusterings), _passing(clips, parts), _similarity(features))


def _copies(ingested: pa.Table, count: int) -> pa.Table:
    copies = ingested.take(pa.array(np.arange(count) % len(ingested)))
    return copies.set_column(0, ingested.schema.field("clip_id"), pa.array(_names(count)))


def _names(count: int) -> list[str]:
    return [f"made-up/{number:06d}.bvh" for number in range(count)]


def _pairs_of_copies(
    store: Store, ingested: pa.Table, pairs: pa.Table, count: int, most: float | None
) -> Parts:
    names, (i, j) = pa.array(_names(count)), np.triu_indices(count, 1)
    distances = _distances_of_copies(ingested, pairs, i, j)
    if most is not None:
        near = distances["weighted"] <= most
        i, j, distances = i[near], j[near], {name: values[near] for name, values in distances.items()}
    keys = []
    for start in range(0, len(i), _PART):
        part = slice(start, start + _PART)
        rows = {"clip_a": names.take(pa.array(i[part])), "clip_b": names.take(pa.array(j[part]))}
        rows |= {name: pa.array(values[part]) for name, values in distances.items()}
        rows["curve"] = pa.FixedSizeListArray.from_arrays(np.repeat(distances["weighted"][part], 8), 8)
        columns = {name: rows[name] for name in TABLES["pairs"].names}
        keys.append(f"made-up-{count}-{start}")
        store.save(keys[-1], {"pairs": pa.table(columns, schema=TABLES["pairs"])})
    return Parts(lambda key, wanted: store.load(key, "pairs", wanted), keys)


def _distances_of_copies(ingested: pa.Table, pairs: pa.Table, i: NDArray, j: NDArray) -> dict[str, NDArray]:
    apart = np.random.default_rng(0).random(len(i)) * _APART
    a, b = pair_places(pairs, places_by_clip(ingested["clip_id"]))
    i, j = i % len(ingested), j % len(ingested)
    distances = {}
    for name in ("dtw", "b_dtw", "weighted", "fuzzy_low", "fuzzy_high"):
        square = np.full((len(ingested), len(ingested)), np.inf)
        np.fill_diagonal(square, 0.0)
        square[a, b] = square[b, a] = pairs[name].to_numpy()
        mean = square[np.isfinite(square)].mean()
        distances[name] = (square[i, j] + apart * mean).astype(np.float32)
    return distances


def _passing(clips: pa.Table, parts: Parts) -> float:
    alone = np.arange(len(clips))
    start = time.perf_counter()
    ClusteredPairs(parts, clips["clip_id"], alone).distances_to(alone, "weighted")
    return (time.perf_counter() - start) / (len(clips) * (len(clips) - 1) / 2)


def _similarity(features: pa.Table) -> float:
    frames = matrix(features["feature"])[:_FRAMES, :POSE_COLUMNS]
    draw = np.random.default_rng(0)
    clips = frames + draw.normal(0, 0.01, (_ALIKE, *frames.shape)).astype(np.float32)
    start = time.perf_counter()
    similarity_index(clips)
    return (time.perf_counter() - start) / (_ALIKE**2 * len(frames))
