"""Takes held out of a catalog, assigned to clusters that are made of the others by one rule or another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import squareform

from motionary.catalog import Catalog
from motionary.catalog.motions import stream_features
from motionary.catalog.ranked_distance import ranked_distance
from motionary.pipeline.alignment import joint_weights, select_reference
from motionary.pipeline.clustering import choose_cut, name_clusters
from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.stages.columns import condensed, condensed_places
from motionary.workflows.reproduce.combinations import StudiedDistance, pairs_among

NEAREST, REFERENCE, MEAN = "nearest clip", "nearest reference", "mean over cluster"
RULES = (NEAREST, REFERENCE, MEAN)
FROM_REFERENCE, FROM_CLIP, BOTH = "from the reference", "from the nearest clip", "both"

USUAL = 0.95
"""Of the clips, whose distances from their nearest ones are usual."""

Places = NDArray[np.intp]

_PAIRS = """
select clip_a, clip_b, {columns} from pairs
where clip_a in (select unnest($clips)) and clip_b in (select unnest($clips))
"""


@dataclass(frozen=True, eq=False)
class KnownClips:
    """N labelled clips, every distance between them, and how the catalog's run clusters.

    Parameters
    ----------
    classes : array (N,) of str
    digests : array (N,) of str
        Of their bytes.
    distance : StudiedDistance
        The distance that clusters are made of and clips are ranked by.
    from_reference, weighted : arrays (N, N)
        The distance that reach is measured by, and the weighted one, which may choose a reference.
    poses : sequence of array (frames, 57)
    config : PipelineConfig
    """

    classes: NDArray[np.object_]
    digests: NDArray[np.object_]
    distance: StudiedDistance
    from_reference: FloatArray
    weighted: FloatArray
    poses: Sequence[NDArray[np.float32]]
    config: PipelineConfig


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of T takes under one rule and one reach.

    Parameters
    ----------
    rule, reach : str
        One of `RULES`; which reach refused them.
    known : array (T,) of bool
        Whether any clip that was not held out is of the take's class.
    right : array (T,) of bool
        Whether the chosen cluster has the name of its class, reach aside.
    within : array (T,) of bool
        Whether the reach holds it.
    confidence : array (T,) of float
        In the cluster's name.
    """

    rule: str
    reach: str
    known: NDArray[np.bool_]
    right: NDArray[np.bool_]
    within: NDArray[np.bool_]
    confidence: FloatArray


def read_known_clips(catalog: Catalog, clip_ids: Sequence[str], classes: NDArray[np.object_]) -> KnownClips:
    """Read what a catalog knows of some clips, given in clip_id order with their classes."""
    import pyarrow as pa

    config = catalog.config
    ranked = ranked_distance(config)
    columns = dict.fromkeys([*ranked.columns, config.clusters.metric, "weighted"])
    pairs = catalog.sql(_PAIRS.format(columns=", ".join(columns)), {"clips": list(clip_ids)})
    places = condensed_places(pairs, pa.array(clip_ids, pa.string()))
    of = {name: condensed(pairs, name, places) for name in columns}
    key = np.empty(len(places))
    key[places] = ranked.of(pairs)
    interval = (of["fuzzy_low"], of["fuzzy_high"]) if ranked.metric == "fuzzy" else None
    poses = {name: values[:, :POSE_COLUMNS] for name, values in stream_features(catalog, clip_ids)}
    clips = catalog.clips.to_arrow()
    digests = dict(zip(clips["clip_id"].to_pylist(), clips["digest"].to_pylist(), strict=True))
    return KnownClips(
        classes,
        np.array([digests[one] for one in clip_ids], object),
        StudiedDistance(ranked.metric, key, interval, ranked.tau),
        squareform(of[config.clusters.metric]),
        squareform(of["weighted"]),
        [poses[one] for one in clip_ids],
        config,
    )


def assign_held_out(clips: KnownClips, kept: Places, held_out: Places) -> list[Outcome]:
    """Make clusters of the clips that are kept, and assign those held out by every rule.

    Parameters
    ----------
    clips : KnownClips
    kept, held_out : arrays of int
        Places of two parts of the clips, each ascending.

    Returns
    -------
    list of Outcome
        The rules with the reach from the reference; the nearest clip also with the other and with both.
    """
    settings = clips.config.clusters
    cluster_of = _clusters(clips, kept)
    references = _references(clips, kept, cluster_of)
    to_own = clips.from_reference[kept, kept[references[cluster_of]]]
    classes = clips.classes[kept].tolist()
    named = name_clusters(cluster_of, classes, [None] * len(kept), to_own, settings.reach)
    names = np.array([named.cluster_name[k] for k in range(len(references))], object)
    each = [np.flatnonzero(cluster_of == k) for k in range(len(references))]
    furthest = np.array([to_own[members].max() for members in each])
    agree = np.array(
        [(clips.classes[kept[members]] == name).sum() for members, name in zip(each, names, strict=True)]
    )
    confidence = agree / (np.array([len(members) for members in each]) + 1)

    square = squareform(clips.distance.key)
    to_clips, among = square[np.ix_(held_out, kept)], square[np.ix_(kept, kept)]
    scores = {
        NEAREST: np.stack([to_clips[:, members].min(axis=1) for members in each], axis=1),
        REFERENCE: to_clips[:, references],
        MEAN: np.stack([to_clips[:, members].mean(axis=1) for members in each], axis=1),
    }
    np.fill_diagonal(among, np.inf)
    nearest = among.min(axis=1)
    usual = settings.reach * np.quantile(nearest[nearest > 0], USUAL) if (nearest > 0).any() else np.inf
    known = np.isin(clips.classes[held_out].astype(str), clips.classes[kept].astype(str))
    outcomes = []
    for rule, score in scores.items():
        chosen = score.argmin(axis=1)
        to_reference = clips.from_reference[held_out, kept[references[chosen]]]
        right = names[chosen] == clips.classes[held_out]
        reaches = {FROM_REFERENCE: to_reference <= settings.reach * furthest[chosen]}
        if rule == NEAREST:
            reaches[FROM_CLIP] = to_clips.min(axis=1) <= usual
            reaches[BOTH] = reaches[FROM_REFERENCE] & reaches[FROM_CLIP]
        outcomes += [
            Outcome(rule, reach, known, right, within, confidence[chosen])
            for reach, within in reaches.items()
        ]
    return outcomes


def _clusters(clips: KnownClips, kept: Places) -> NDArray[np.int64]:
    """Cluster the clips that are kept as a run of them would, all of them labelled."""
    settings = clips.config.clusters
    among = clips.distance.among(pairs_among(kept, len(clips.classes)))
    cut = choose_cut(among.dendrogram(settings.primary), among.key, settings, clips.classes[kept].tolist())
    return cut.labels


def _references(clips: KnownClips, kept: Places, cluster_of: NDArray[np.int64]) -> Places:
    """Choose every cluster's reference as a run does: places in `kept`."""
    weights = joint_weights(clips.config.alignment.weights)
    chosen = []
    for k in range(cluster_of.max() + 1):
        members = np.flatnonzero(cluster_of == k)
        members = members[np.argsort(clips.digests[kept[members]], kind="stable")]
        places = kept[members]
        chosen.append(
            members[
                select_reference(
                    [clips.poses[one] for one in places], weights, clips.weighted[np.ix_(places, places)]
                )
            ]
        )
    return np.array(chosen)
