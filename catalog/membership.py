"""Which cluster a new motion belongs to, what it is called there, and whether it belongs to any.

The rule: a motion belongs to the cluster of the clip that is nearest to it by the distance that the clusters
are made of. Its rivals, held against it on takes that were held out (`motionary reproduce assign`): the least
*mean* distance to a cluster's clips finds names as well, but must know every distance, where the nearest clip
is found without; the nearest *reference* finds fewer.

It stays unassigned beyond either of two reaches. As an unlabelled clip of a run does, where it lies further
from that cluster's reference than `reach` (1.5 by default) times the furthest clip of the cluster; a cluster
of one clip so takes nothing but copies of it. And where even the nearest clip is further away than `reach`
times what 95% of the clips are from theirs, copies aside, of 200 clips spread evenly. Motions of a class that
the catalog has never seen often lie within one of them, and seldom within both. A motion gets the cluster's
name only where it lies no further from the reference than `reach` times the furthest clip with a label of its
own.

The degree of membership is that of fuzzy c-means (Bezdek 1981) with m = 2, the references as centres and
d_k = low + tau (high - low) of the fuzzy distance to the k-th:

    degree = 1 / sum over k of (d / d_k)^2

The degrees of all clusters add up to 1; a motion at distance 0 of c references is c times of degree 1/c.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from motionary.catalog.example import library_features
from motionary.catalog.ranked_distance import RankedDistance, ranked_distance
from motionary.pipeline.config import PipelineConfig

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog
    from motionary.pipeline.distances.nearest import PackedLibrary


_MOST, _LOOKED_AT = 0.95, 200


@dataclass(frozen=True, eq=False)
class Clusters:
    """The K clusters of N clips, ready for motions to be placed among them.

    Parameters
    ----------
    ids, names : sequences (K,)
        Number of each, and its name, None where it has none.
    confidence : sequence (K,) of float
        How sure the name is of a clip that has none of its own.
    reach, name_reach : sequences (K,) of float
        How far from the reference a member may lie, and one that gets the name; less than 0 for none.
    nearest_reach : float
        How far from its nearest clip a member may lie.
    references : sequence (K,) of array (frames, d)
        Their features.
    clip_ids : sequence (N,) of str
    cluster_of : array (N,) of int
        Which cluster each clip is in, 0 .. K-1.
    library : PackedLibrary
        The clips.
    config : PipelineConfig
        The settings that they were compared by.
    """

    ids: Sequence[int]
    names: Sequence[str | None]
    confidence: Sequence[float]
    reach: Sequence[float]
    name_reach: Sequence[float]
    nearest_reach: float
    references: Sequence[NDArray[np.float32]]
    clip_ids: Sequence[str]
    cluster_of: NDArray[np.int64]
    library: PackedLibrary
    config: PipelineConfig


@dataclass(frozen=True)
class Membership:
    """Where one motion belongs; the fields are described in `motionary.catalog.assign.ASSIGNMENTS`."""

    status: Literal["assigned", "unassigned"]
    cluster_id: int | None
    label: str | None
    confidence: float
    nearest_clip: str
    distance: float
    distance_to_reference: float
    second_cluster: int | None
    second_distance: float | None
    fuzzy_low: float
    fuzzy_high: float
    degree: float
    reason: str | None


def read_clusters(catalog: Catalog) -> Clusters:
    """Read the clusters of a catalog, with all that placing motions among them needs.

    Raises
    ------
    CatalogError
        The catalog has no clips.
    """
    from motionary.catalog.neighbours import packed_library

    library, reach = library_features(catalog), catalog.config.clusters.reach
    packed, ranked = packed_library(catalog), ranked_distance(catalog.config)
    found = catalog.sql(_CLUSTERS).to_pydict()
    of_clip = catalog.sql("select clip_id, cluster_id from clusters").to_pydict()
    cluster_of = dict(zip(of_clip["clip_id"], of_clip["cluster_id"], strict=True))
    place = {clip_id: number for number, clip_id in enumerate(library.clip_ids)}
    return Clusters(
        ids=found["cluster_id"],
        names=found["label"],
        confidence=found["confidence"],
        reach=[reach * furthest for furthest in found["furthest"]],
        name_reach=[reach * furthest for furthest in found["furthest_labelled"]],
        nearest_reach=reach * _usual_distance(library.clips, packed, ranked),
        references=[library.clips[place[clip_id]] for clip_id in found["clip_id"]],
        clip_ids=library.clip_ids,
        cluster_of=np.searchsorted(found["cluster_id"], [cluster_of[one] for one in library.clip_ids]),
        library=packed,
        config=catalog.config,
    )


def place(clusters: Clusters, features: NDArray[np.float32]) -> Membership:
    """Find where one motion belongs.

    Parameters
    ----------
    clusters : Clusters
    features : array (frames, d)
        See `motionary.pipeline.features.motion_features`.

    Raises
    ------
    ValueError
        The motion has more frames than can be compared.
    """
    from motionary.pipeline.distances import compare_clips
    from motionary.pipeline.distances.nearest import nearest_clips

    settings, ranked = clusters.config.clusters, ranked_distance(clusters.config)
    near = nearest_clips(
        features,
        clusters.library,
        k=2,
        metric=ranked.metric,
        thresholds=ranked.thresholds,
        tau=ranked.tau,
        groups=clusters.cluster_of,
    )
    k, *others = clusters.cluster_of[near.index]
    found = compare_clips([features], clusters.references, ranked.thresholds)
    low, high = found.fuzzy_low[0], found.fuzzy_high[0]
    # In the tables' bits, so that the reach of a cluster of equal clips holds one more of them.
    to_reference = float(np.float32(getattr(found, settings.metric)[0, k]))
    beyond = _beyond(clusters, int(k), float(near.distance[0]), to_reference)
    inside = beyond is None
    named = inside and clusters.names[k] is not None and to_reference <= clusters.name_reach[k]
    return Membership(
        status="assigned" if inside else "unassigned",
        cluster_id=clusters.ids[k] if inside else None,
        label=clusters.names[k] if named else None,
        confidence=clusters.confidence[k] if named else 0.0,
        nearest_clip=clusters.clip_ids[near.index[0]],
        distance=float(near.distance[0]),
        distance_to_reference=to_reference,
        second_cluster=clusters.ids[others[0]] if others else None,
        second_distance=float(near.distance[1]) if others else None,
        fuzzy_low=float(low[k]),
        fuzzy_high=float(high[k]),
        degree=degree_of_membership(low + ranked.tau * (high - low), int(k)),
        reason=beyond,
    )


def degree_of_membership(distances: NDArray[np.float64], k: int) -> float:
    """Return the degree to which a motion at these distances (K,) from the references is of cluster k."""
    if distances[k] == 0:
        return 1 / int((distances == 0).sum())
    with np.errstate(divide="ignore"):
        return float(1 / ((distances[k] / distances) ** 2).sum())


def _beyond(clusters: Clusters, k: int, to_clip: float, to_reference: float) -> str | None:
    """Say which reach a motion lies beyond; None where it lies within both."""
    if to_clip > clusters.nearest_reach:
        return f"it is unlike any clip: the nearest is {to_clip:.3g} away, over {clusters.nearest_reach:.3g}"
    if to_reference > clusters.reach[k]:
        return (
            f"its nearest clip is of cluster {clusters.ids[k]}, but from the reference of that it is "
            f"{to_reference:.3g} away, over {clusters.reach[k]:.3g}"
        )
    return None


def _usual_distance(
    clips: Sequence[NDArray[np.float32]], packed: PackedLibrary, ranked: RankedDistance
) -> float:
    """Return what most clips are at most away from their nearest; infinity where none has any but copies."""
    from motionary.pipeline.distances.nearest import nearest_clips
    from motionary.pipeline.distances.tiles import usable_processors

    every = np.arange(len(clips))
    if len(every) == 1:
        return np.inf

    def to_nearest(one: int) -> float:
        others = np.delete(every, one)
        found = nearest_clips(
            clips[one], packed, 1, ranked.metric, ranked.thresholds, tau=ranked.tau, among=others
        )
        return float(found.distance[0])

    some = np.unique(np.linspace(0, len(every) - 1, _LOOKED_AT).astype(np.int64))
    with ThreadPoolExecutor(usable_processors()) as threads:
        found = np.array(list(threads.map(to_nearest, some)))
    return float(np.quantile(found[found > 0], _MOST)) if (found > 0).any() else np.inf


_CLUSTERS = """
select r.cluster_id, r.clip_id, r.label, max(distance_to_reference) as furthest,
       coalesce(max(distance_to_reference) filter (own), -1) as furthest_labelled,
       count(*) filter (own and c.label = r.label) / (count(*) filter (own) + 1) as confidence
from "references" r join (select *, label_source in ('supplied', 'override') as own from clusters) c
using (cluster_id) group by all order by r.cluster_id
"""
