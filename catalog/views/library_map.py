"""Where the clips of a library lie on its map, read from their distances.

Up to 1,500 clips are laid out by all their distances. Of more, 1,500 landmarks are: the references of the
clusters, the largest first, and clips spread evenly over the library, of so many sides of tiles that some 30
million pairs are read, since the distances of a clip lie among those of its side. See
`motionary.catalog.views.embedding`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from motionary.catalog.own_pairs import (
    pairs_with_side,
    refuse_without_all_pairs,
    side_count,
    side_of,
    sides_to_read,
)
from motionary.catalog.query import Catalog
from motionary.catalog.ranked_distance import RankedDistance, ranked_distance
from motionary.catalog.views.embedding import NEIGHBOURS, laid_out, placed_among

LANDMARKS = 1500
_PAIRS = 30_000_000


def library_map(catalog: Catalog, places: NDArray[np.float64] | None = None) -> pa.Table:
    """Find a place in the plane for every clip, by the distance that the clusters are made of.

    Parameters
    ----------
    catalog : Catalog
        An opened catalog. Of ten thousand clips it takes seconds and some hundred megabytes.
    places : array (N, 2), optional
        Its `map_places`, where they are known already: they stay when labels change.

    Returns
    -------
    pyarrow.Table
        clip_id, in order; x and y, within -1 and 1; cluster_id; label (null: none); source: the library's
        root where several are watched, else the joint-name convention of the clip's skeleton.

    Raises
    ------
    CatalogError
        Another version of motionary made the snapshot, or its run did not compare all pairs; or a file is
        damaged.
    """
    clips = catalog.clusters.to_arrow().select(["clip_id", "cluster_id", "label"]).sort_by("clip_id")
    places = map_places(catalog) if places is None else places
    return pa.table(
        {
            "clip_id": clips["clip_id"],
            "x": places[:, 0],
            "y": places[:, 1],
            "cluster_id": clips["cluster_id"],
            "label": clips["label"],
            "source": _sources(catalog, clips["clip_id"]),
        }
    )


def map_places(catalog: Catalog) -> NDArray[np.float64]:
    """Find the places alone, (N, 2) in clip_id order; see `library_map`."""
    refuse_without_all_pairs(catalog, "the map")
    clip_ids = catalog.clusters.to_arrow()["clip_id"].combine_chunks().sort()
    distance = ranked_distance(catalog.config)
    if len(clip_ids) <= LANDMARKS:
        return laid_out(_all_distances(catalog, clip_ids, distance))
    chosen = _landmarks(catalog, clip_ids.to_pylist())
    among, nearest, far = _distances_to(catalog, clip_ids, chosen, distance)
    landmarks = laid_out(among)
    places = placed_among(landmarks, nearest, far)
    places[chosen.clips] = landmarks
    return places


def _all_distances(
    catalog: Catalog, clip_ids: pa.StringArray, distance: RankedDistance
) -> NDArray[np.float32]:
    pairs = catalog.sql(f"select clip_a, clip_b, {', '.join(distance.columns)} from pairs")
    distances = np.zeros((len(clip_ids), len(clip_ids)), np.float32)
    first, second = _numbers(pairs["clip_a"], clip_ids), _numbers(pairs["clip_b"], clip_ids)
    distances[first, second] = distances[second, first] = distance.of(pairs)
    return distances


@dataclass(frozen=True, eq=False)
class _Landmarks:
    """Clips that are laid out: their numbers among all clips, rising, and the sides that they are on."""

    clips: NDArray[np.intp]
    sides: list[int]


def _landmarks(catalog: Catalog, clip_ids: list[str]) -> _Landmarks:
    side, most = side_of(catalog), sides_to_read(catalog, _PAIRS)
    by_size = catalog.references.to_arrow().sort_by([("size", "descending"), ("cluster_id", "ascending")])
    references = by_size["clip_id"].to_pylist()[: LANDMARKS // 2]
    sides = list(dict.fromkeys(side[one] for one in references))[: most // 2]
    evenly = np.linspace(0, side_count(catalog) - 1, most - len(sides)).round()
    kept = {*sides, *evenly.astype(int).tolist()}
    there = np.array([side[one] in kept for one in clip_ids])
    wanted = set(references)
    first = np.flatnonzero(there & np.array([one in wanted for one in clip_ids]))
    others = np.setdiff1d(np.flatnonzero(there), first)
    room = min(LANDMARKS - len(first), len(others))
    spread = others[np.linspace(0, len(others) - 1, room).astype(int)]
    return _Landmarks(np.union1d(first, spread), sorted(kept))


def _distances_to(
    catalog: Catalog, clip_ids: pa.StringArray, chosen: _Landmarks, distance: RankedDistance
) -> tuple[NDArray[np.float32], NDArray[np.intp], NDArray[np.float32]]:
    """Read the landmarks' distances (M, M), and every clip's nearest landmarks (N, k) with the distances."""
    among = np.zeros((len(chosen.clips), len(chosen.clips)), np.float32)
    nearest = np.zeros((0, len(clip_ids)), np.intp)
    far = np.zeros((0, len(clip_ids)), np.float32)
    for rows, distances in _rows(catalog, clip_ids, chosen, distance):
        among[rows] = distances[:, chosen.clips]
        far = np.concatenate([far, distances])
        nearest = np.concatenate([nearest, np.repeat(rows[:, None], len(clip_ids), axis=1)])
        kept = np.argsort(far, axis=0, kind="stable")[:NEIGHBOURS]
        far, nearest = np.take_along_axis(far, kept, axis=0), np.take_along_axis(nearest, kept, axis=0)
    return among, nearest.T, far.T


def _rows(
    catalog: Catalog, clip_ids: pa.StringArray, chosen: _Landmarks, distance: RankedDistance
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float32]]]:
    """Read landmarks side by side: their numbers among the landmarks, their distances to all clips."""
    side = side_of(catalog)
    at = np.array([side[clip_ids[number].as_py()] for number in chosen.clips])
    for one in chosen.sides:
        rows = np.flatnonzero(at == one)
        if not len(rows):
            continue
        pairs = pairs_with_side(catalog, one, distance.columns)
        values = distance.of(pairs)
        row_of = np.full(len(clip_ids), -1)
        row_of[chosen.clips[rows]] = np.arange(len(rows))
        distances = np.zeros((len(rows), len(clip_ids)), np.float32)
        first, second = _numbers(pairs["clip_a"], clip_ids), _numbers(pairs["clip_b"], clip_ids)
        for own, other in ((first, second), (second, first)):
            there = row_of[own] >= 0
            distances[row_of[own[there]], other[there]] = values[there]
        yield rows, distances


def _numbers(names: pa.ChunkedArray, clip_ids: pa.StringArray) -> NDArray[np.intp]:
    return pc.index_in(names, clip_ids).to_numpy().astype(np.intp)


def _sources(catalog: Catalog, clip_ids: pa.ChunkedArray) -> pa.Array:
    inputs = catalog.inputs.to_arrow()
    several = pc.count_distinct(inputs["root"]).as_py() > 1
    table, column = (inputs, "root") if several else (catalog.clips.to_arrow(), "convention")
    of = dict(zip(table["clip_id"].to_pylist(), table[column].to_pylist(), strict=True))
    return pa.array([of[one] for one in clip_ids.to_pylist()], pa.string())
