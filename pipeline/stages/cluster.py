"""All pairs -> dendrograms, cuts, and the clusters that are published [DC 5]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.clustering import Cut, choose_cut, cut_tree, fuzzy_linkage, labels_suffice
from motionary.pipeline.clustering.linkage import LINKAGES
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.evaluation import adjusted_rand_index, best_reward_punish, reward_punish
from motionary.pipeline.stages.columns import condensed, condensed_places
from motionary.pipeline.tables import LABEL_COLUMNS, TABLES

VERSION = 2
MAKES = ("clips", "linkage", "partitions", "cuts", "groups")

_METRICS = ("dtw", "b_dtw", "weighted")


@dataclass(frozen=True, eq=False)
class Dendrogram:
    """A linkage of the clips by one distance, cut with the labels hidden.

    Parameters
    ----------
    method, metric : str
        Linkage and distance.
    distances : array (N (N - 1) / 2,)
        What the linkage works on, condensed; for fuzzy linkage its merge key.
    linkage : array (N - 1, 4)
        SciPy linkage matrix.
    cut : Cut
        Automatic, labels hidden; by the modularity of this distance's own nearest-neighbour graph.
    """

    method: str
    metric: str
    distances: NDArray[np.float64]
    linkage: NDArray[np.float64]
    cut: Cut


def cluster(
    ingested: pa.Table, pairs: pa.Table, labels: pa.Table, overrides: pa.Table, config: ClusterConfig
) -> dict[str, pa.Table]:
    """Cluster the clips of a library by all distances and linkages, and publish one of the partitions.

    Parameters
    ----------
    ingested : pyarrow.Table
        Every clip.
    pairs : pyarrow.Table
        Every pair of them.
    labels : pyarrow.Table
        clip_id and text columns; clips without a row have no supplied labels.
    overrides : pyarrow.Table
        clip_id and label of the clips that a person named; the cut goes by these names first.
    config : ClusterConfig
        Linkage, distance, cut and the label column.

    Returns
    -------
    dict of str to pyarrow.Table
        `clips` (with their supplied labels), `linkage`, `partitions`, `cuts` and `groups`; clips stand in
        clip_id order.
    """
    clips = join_labels(ingested.sort_by("clip_id"), labels)
    if len(clips) == 0:
        return {name: TABLES[name].empty_table() for name in MAKES} | {"clips": clips}
    classes = _classes(clips, overrides, config.label_column)
    dendrograms = _dendrograms(clips["clip_id"], pairs, config)
    primary = next(one for one in dendrograms if _is_primary(one, config))
    published = choose_cut(primary.linkage, primary.distances, config, labels=classes)
    return {
        "clips": clips,
        "linkage": pa.concat_tables([_linkage_rows(one) for one in dendrograms]),
        "partitions": pa.concat_tables([_partition_rows(one, clips["clip_id"]) for one in dendrograms]),
        "cuts": pa.concat_tables(
            [_cut_row(one, classes, published if one is primary else None) for one in dendrograms]
        ),
        "groups": pa.table(
            {"clip_id": clips["clip_id"], "group": pa.array(published.labels, pa.int32())},
            schema=TABLES["groups"],
        ),
    }


def own_labels(clips: pa.Table, column: str) -> list[str | None]:
    """Return the label supplied with every clip, None where there is none."""
    if column not in clips.column_names:
        return [None] * len(clips)
    return [label or None for label in clips[column].to_pylist()]


def own_overrides(clips: pa.Table, overrides: pa.Table) -> list[str | None]:
    """Return what a person called every clip, None where nobody did."""
    named = dict(zip(overrides["clip_id"].to_pylist(), overrides["label"].to_pylist(), strict=True))
    return [named.get(clip_id) for clip_id in clips["clip_id"].to_pylist()]


def _classes(clips: pa.Table, overrides: pa.Table, column: str) -> list[str | None] | None:
    both = zip(own_labels(clips, column), own_overrides(clips, overrides), strict=True)
    classes = [label if override is None else override for label, override in both]
    return classes if any(one is not None for one in classes) else None


def join_labels(ingested: pa.Table, labels: pa.Table) -> pa.Table:
    """Give every clip its supplied labels; a label column named like one of a clip's own is left out."""
    own = set(TABLES["ingested"].names)
    wanted = labels.drop_columns([name for name in labels.column_names if name in own - {"clip_id"}])
    joined = ingested.select(["clip_id"]).join(wanted, "clip_id", join_type="left outer").sort_by("clip_id")
    clips = ingested
    for name in (*LABEL_COLUMNS, *(name for name in wanted.column_names if name not in LABEL_COLUMNS)):
        if name != "clip_id":
            known = name in joined.column_names
            column = joined[name].cast(pa.string()) if known else pa.nulls(len(clips), pa.string())
            clips = clips.append_column(name, column)
    return clips


def _dendrograms(clip_ids: pa.ChunkedArray, pairs: pa.Table, config: ClusterConfig) -> list[Dendrogram]:
    made = []
    place = condensed_places(pairs, clip_ids)
    for metric in _METRICS:
        distances = condensed(pairs, metric, place)
        for method in dict.fromkeys(("complete", "ward", config.primary)):
            if method in LINKAGES:
                made.append(_dendrogram(method, metric, distances, LINKAGES[method](distances), config))
    low, high = (condensed(pairs, name, place) for name in ("fuzzy_low", "fuzzy_high"))
    key = low + config.fuzzy_tau * (high - low)
    made.append(_dendrogram("fuzzy", "fuzzy", key, fuzzy_linkage(low, high, tau=config.fuzzy_tau), config))
    return made


def _dendrogram(
    method: str, metric: str, distances: NDArray, linkage: NDArray, config: ClusterConfig
) -> Dendrogram:
    # A threshold or a count is asked of the published clusters; the others have heights of their own.
    automatic = replace(config, threshold=None, n_clusters=None)
    return Dendrogram(method, metric, distances, linkage, choose_cut(linkage, distances, automatic))


def _is_primary(dendrogram: Dendrogram, config: ClusterConfig) -> bool:
    return dendrogram.method == config.primary and dendrogram.metric in (config.metric, "fuzzy")


def _linkage_rows(dendrogram: Dendrogram) -> pa.Table:
    merges = len(dendrogram.linkage)
    left, right, height, size = dendrogram.linkage.T
    columns = {
        "method": [dendrogram.method] * merges,
        "metric": [dendrogram.metric] * merges,
        "step": np.arange(merges, dtype=np.int32),
        "left": left.astype(np.int32),
        "right": right.astype(np.int32),
        "height": height,
        "size": size.astype(np.int32),
    }
    return pa.table(columns, schema=TABLES["linkage"])


def _partition_rows(dendrogram: Dendrogram, clip_ids: pa.ChunkedArray) -> pa.Table:
    columns = {
        "method": [dendrogram.method] * len(clip_ids),
        "metric": [dendrogram.metric] * len(clip_ids),
        "clip_id": clip_ids,
        "cluster": dendrogram.cut.labels.astype(np.int32),
    }
    return pa.table(columns, schema=TABLES["partitions"])


def _cut_row(dendrogram: Dendrogram, classes: Sequence[str | None] | None, published: Cut | None) -> pa.Table:
    cut = dendrogram.cut
    row = {
        "method": dendrogram.method,
        "metric": dendrogram.metric,
        "primary": published is not None,
        "rule": cut.rule,
        "n_clusters": cut.n_clusters,
        "threshold": cut.threshold,
    }
    if published is not None:
        row |= {
            "published_rule": published.rule,
            "published_clusters": published.n_clusters,
            "published_threshold": published.threshold,
        }
    if cut.widest is not None:
        row |= {
            "strip_clusters": cut.widest.kappa,
            "strip_low": cut.widest.mu_low,
            "strip_high": cut.widest.mu_high,
        }
    if classes is not None and labels_suffice(classes):
        known = len({one for one in classes if one is not None})
        at_true = cut_tree(dendrogram.linkage, n_clusters=known)
        row |= {
            "reward_punish": reward_punish(cut.labels, classes),
            "reward_punish_best": best_reward_punish(classes),
            "ari": adjusted_rand_index(cut.labels, classes),
            "classes": known,
            "reward_punish_true": reward_punish(at_true, classes),
            "ari_true": adjusted_rand_index(at_true, classes),
        }
    return pa.Table.from_pylist([row], schema=TABLES["cuts"])
