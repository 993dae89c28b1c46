"""All pairs -> dendrograms, cuts, and the clusters that are published [DC 5].

Pairs are read part by part, once for each distance, into arrays in temporary files. Mapped at a time are
6 N^2 bytes at most for one distance (float32, and Ward's working copy) and 8 N^2 for the fuzzy one: 3.2 GB
for 20,000 clips, which the system may write out and take back. Of the process's own memory it takes N^2 / 16
bytes, a part of the pairs, and what grows with N alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.clustering import Cut, choose_cut, cut_tree, fuzzy_linkage, labels_suffice
from motionary.pipeline.clustering.condensed import blocks
from motionary.pipeline.clustering.linkage import LINKAGES
from motionary.pipeline.clustering.mapped import mapped_array
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.evaluation import adjusted_rand_index, best_reward_punish, reward_punish
from motionary.pipeline.parts import Parts
from motionary.pipeline.stages.columns import mapped_distances
from motionary.pipeline.tables import LABEL_COLUMNS, TABLES

VERSION = 2
MAKES = ("clips", "linkage", "partitions", "cuts", "groups")

_METRICS = ("dtw", "b_dtw", "weighted")

Classes = Sequence[str | None] | None
"""The label of every clip, None where it has none; None where no clip has one."""


@dataclass(frozen=True, eq=False)
class Dendrogram:
    """A linkage of the clips by one distance, cut with the labels hidden.

    Parameters
    ----------
    method, metric : str
        Linkage and distance.
    linkage : array (N - 1, 4)
        SciPy linkage matrix.
    cut : Cut
        Automatic, labels hidden; by the modularity of this distance's own nearest-neighbour graph.
    published : Cut or None
        Of the dendrogram whose clusters are published, the cut that the configuration asks for.
    """

    method: str
    metric: str
    linkage: NDArray[np.float64]
    cut: Cut
    published: Cut | None


class TooFewClipsError(ValueError):
    """Too few clips can be read for what is asked; the message says what to do."""


def cluster(
    ingested: pa.Table, pairs: Parts, labels: pa.Table, overrides: pa.Table, config: ClusterConfig
) -> dict[str, pa.Table]:
    """Cluster the clips of a library by all distances and linkages, and publish one of the partitions.

    Parameters
    ----------
    ingested : pyarrow.Table
        Every clip.
    pairs : Parts
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

    Raises
    ------
    TooFewClipsError
        More clusters are asked for.
    """
    clips = join_labels(ingested.sort_by("clip_id"), labels)
    if len(clips) == 0:
        return {name: TABLES[name].empty_table() for name in MAKES} | {"clips": clips}
    if config.n_clusters is not None and config.n_clusters > len(clips):
        raise TooFewClipsError(
            f"{config.n_clusters} clusters are asked for, and of the clips to cluster {len(clips)} can be "
            "read; ask for fewer clusters, or for none, and see in quarantine why the others cannot"
        )
    classes = classes_of(clips, overrides, config.label_column)
    dendrograms = _dendrograms(clips["clip_id"], pairs, config, classes)
    published = next(one.published for one in dendrograms if one.published is not None)
    return {
        "clips": clips,
        "linkage": pa.concat_tables([_linkage_rows(one) for one in dendrograms]),
        "partitions": pa.concat_tables(
            [partition_rows(one.method, one.metric, clips["clip_id"], one.cut.labels) for one in dendrograms]
        ),
        "cuts": pa.concat_tables([_cut_row(one, classes) for one in dendrograms]),
        "groups": groups_table(clips["clip_id"], published.labels),
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


def classes_of(clips: pa.Table, overrides: pa.Table, column: str) -> Classes:
    """Return what every clip is called: by a person, else by its label; None where none has a name."""
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


def _dendrograms(
    clip_ids: pa.ChunkedArray, pairs: Parts, config: ClusterConfig, classes: Classes
) -> list[Dendrogram]:
    made = [one for metric in _METRICS for one in _by_one_distance(metric, clip_ids, pairs, config, classes)]
    low, high = mapped_distances(pairs, ("fuzzy_low", "fuzzy_high"), clip_ids)
    linkage = fuzzy_linkage(low, high, config.fuzzy_tau, mapped_array)
    made.append(_cut("fuzzy", "fuzzy", linkage, _merge_key(low, high, config.fuzzy_tau), config, classes))
    return made


def _by_one_distance(
    metric: str, clip_ids: pa.ChunkedArray, pairs: Parts, config: ClusterConfig, classes: Classes
) -> list[Dendrogram]:
    (distances,) = mapped_distances(pairs, (metric,), clip_ids)
    methods = [one for one in dict.fromkeys(("complete", "ward", config.primary)) if one in LINKAGES]
    return [
        _cut(method, metric, LINKAGES[method](distances, mapped_array), distances, config, classes)
        for method in methods
    ]


def _merge_key(low: NDArray, high: NDArray, tau: float) -> NDArray[np.float64]:
    key = mapped_array(low.shape, np.float64)
    for block in blocks(len(key)):
        least = low[block].astype(np.float64)
        key[block] = least + tau * (high[block] - least)
    return key


def _cut(
    method: str, metric: str, linkage: NDArray, distances: NDArray, config: ClusterConfig, classes: Classes
) -> Dendrogram:
    # A threshold or a count is asked of the published clusters; the others have heights of their own.
    automatic = replace(config, threshold=None, n_clusters=None)
    is_published = method == config.primary and metric in (config.metric, "fuzzy")
    return Dendrogram(
        method,
        metric,
        linkage,
        choose_cut(linkage, distances, automatic),
        choose_cut(linkage, distances, config, labels=classes) if is_published else None,
    )


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


def partition_rows(method: str, metric: str, clip_ids: pa.ChunkedArray, labels: NDArray) -> pa.Table:
    """Write the cluster of every clip as rows of `partitions`."""
    columns = {
        "method": [method] * len(clip_ids),
        "metric": [metric] * len(clip_ids),
        "clip_id": clip_ids,
        "cluster": labels.astype(np.int32),
    }
    return pa.table(columns, schema=TABLES["partitions"])


def groups_table(clip_ids: pa.ChunkedArray, labels: NDArray) -> pa.Table:
    """Write the published cluster of every clip as `groups`."""
    columns = {"clip_id": clip_ids, "group": pa.array(labels, pa.int32())}
    return pa.table(columns, schema=TABLES["groups"])


def _cut_row(dendrogram: Dendrogram, classes: Classes) -> pa.Table:
    cut, published = dendrogram.cut, dendrogram.published
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
    if classes is not None and (found := scores(cut.labels, classes)):
        at_true = cut_tree(dendrogram.linkage, n_clusters=found["classes"])
        row |= found | {
            "reward_punish_true": reward_punish(at_true, classes),
            "ari_true": adjusted_rand_index(at_true, classes),
        }
    return pa.Table.from_pylist([row], schema=TABLES["cuts"])


def scores(labels: NDArray, classes: Classes) -> dict[str, Any]:
    """Score a partition against what the clips are called; nothing where too few have a name."""
    if classes is None or not labels_suffice(classes):
        return {}
    return {
        "reward_punish": reward_punish(labels, classes),
        "reward_punish_best": best_reward_punish(classes),
        "ari": adjusted_rand_index(labels, classes),
        "classes": len({one for one in classes if one is not None}),
    }
