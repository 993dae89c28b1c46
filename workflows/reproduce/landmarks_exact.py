"""What a catalog's run made of all pairs, and its distances, counted as they are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.catalog import Catalog
from motionary.catalog.own_pairs import refuse_without_all_pairs
from motionary.catalog.ranked_distance import ranked_distance
from motionary.pipeline.clustering import OWN_LABEL_SOURCES
from motionary.pipeline.clustering.condensed import places_of
from motionary.pipeline.config import ClusterConfig
from motionary.pipeline.tables import TABLES
from motionary.workflows.errors import UserError

LEAST_CLIPS = 32
PUBLISHED, AUTOMATIC = "as published", "automatic"


@dataclass(frozen=True, eq=False)
class ExactClusters:
    """What a catalog's run made of all pairs.

    Parameters
    ----------
    url : str
        Of the catalog.
    digests : list of str (N,)
        Of the clips' bytes; clips stand in clip_id order, here as everywhere.
    channels : array (channels, N(N-1)/2) float32
        The primary distance, condensed.
    config : ClusterConfig
        Linkage and cut.
    labels : list of str or None (N,)
        What the run's cut was chosen by.
    classes : list of str or None (N,), or None
        What clusters are scored by; None where there is no such column.
    clusters : mapping of str to array (N,)
        Of every cut that is studied the clusters.
    """

    url: str
    digests: list[str]
    channels: NDArray[np.float32]
    config: ClusterConfig
    labels: list[str | None]
    classes: list[str | None] | None
    clusters: dict[str, NDArray[np.int64]]


class CountedDistances:
    """Condensed distances, asked for as `cluster_by_landmarks` does, that remember which pairs were."""

    def __init__(self, channels: NDArray[np.float32], clips: int) -> None:
        self._channels, self._clips = channels, clips
        self._asked = np.zeros(channels.shape[1], dtype=bool)

    def __call__(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NDArray[np.float32]:
        """Return the distances (channels, rows, columns) of clips given by their places."""
        distances = np.zeros((len(self._channels), len(rows), len(columns)), dtype=np.float32)
        for number, row in enumerate(rows):
            others = np.flatnonzero(columns != row)
            low, high = np.minimum(row, columns[others]), np.maximum(row, columns[others])
            places = places_of(low, high, self._clips)
            distances[:, number, others] = self._channels[:, places]
            self._asked[places] = True
        return distances

    @property
    def share(self) -> float:
        """Of all pairs, those that were asked for."""
        return float(self._asked.mean())


def read_exact_clusters(catalog: Catalog, label_column: str) -> ExactClusters:
    """Read a catalog's clusters, labels and distances.

    Raises
    ------
    UserError, CatalogError
        As for `study_landmarks`.
    """
    refuse_without_all_pairs(catalog, "an experiment on landmarks")
    clips = catalog.clips.to_pandas().sort_values("clip_id")
    if len(clips) < LEAST_CLIPS:
        raise UserError(
            f"{catalog.store.url} has {len(clips)} clips, and a study of landmarks needs {LEAST_CLIPS}: "
            "run on a larger library"
        )
    known = catalog.clusters.to_pandas().set_index("clip_id").loc[clips["clip_id"]]
    own = known["label_source"].isin(OWN_LABEL_SOURCES)
    cut = catalog.sql('select method, metric, published_rule from cuts where "primary"').to_pylist()[0]
    clusters = {PUBLISHED: known["cluster_id"].to_numpy()}
    if cut["published_rule"] != "modularity":
        asked = "select cluster from partitions where method = $method and metric = $metric order by clip_id"
        of_cut = {name: cut[name] for name in ("method", "metric")}
        clusters[AUTOMATIC] = catalog.sql(asked, of_cut)["cluster"].to_numpy()
    scored = label_column in clips and label_column not in TABLES["ingested"].names
    classes = [one or None for one in clips[label_column]] if scored else None
    return ExactClusters(
        catalog.store.url,
        clips["digest"].tolist(),
        _channels(catalog, clips["clip_id"].tolist()),
        catalog.config.clusters,
        [label if mine else None for label, mine in zip(known["label"], own, strict=True)],
        classes if classes and any(classes) else None,
        clusters,
    )


def _channels(catalog: Catalog, clip_ids: list[str]) -> NDArray[np.float32]:
    """Read the primary distance; the clips' places are found by DuckDB, for the names take more room."""
    ranked = ranked_distance(catalog.config)
    pairs = catalog.sql(
        f"""
        with places as (select unnest($clips) as clip, generate_subscripts($clips, 1) - 1 as place)
        select a.place as a, b.place as b, {", ".join(ranked.columns)}
        from pairs join places a on clip_a = a.clip join places b on clip_b = b.clip
        """,
        {"clips": clip_ids},
    )
    a, b = (pairs[side].to_numpy().astype(np.int64) for side in ("a", "b"))
    places = places_of(np.minimum(a, b), np.maximum(a, b), len(clip_ids))
    channels = np.empty((len(ranked.columns), len(places)), dtype=np.float32)
    for channel, column in zip(channels, ranked.columns, strict=True):
        channel[places] = pairs[column].to_numpy()
    return channels
