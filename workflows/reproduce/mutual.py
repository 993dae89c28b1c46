"""Whether ranking by mutual proximity finds a clip's action better than the distance itself does.

Every labelled clip is asked for the others (leave one out), over all sources of the catalog mixed, by every
distance and every form of mutual proximity that Schnitzer et al. offer:

    counted               share of clips that are further from both
    independent, normal   product of the two clips' own shares, by a normal distribution
    independent, gamma    by a gamma distribution: what `motionary similar --rank mutual` takes

Equal proximities go by distance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rich.console import Group, RenderableType
from rich.text import Text
from scipy.spatial.distance import squareform
from scipy.stats import norm, rankdata

from motionary.catalog import Catalog
from motionary.catalog.mutual import UsualDistances, mutual_proximity
from motionary.catalog.own_pairs import refuse_without_all_pairs
from motionary.pipeline.retrieval import mean_average_precision, nearest_neighbour_accuracy
from motionary.pipeline.stages.columns import condensed, condensed_places
from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.labelled import labelled_clips
from motionary.workflows.tables import text_table

Square = NDArray[np.float64]

_METRICS = ("weighted", "b_dtw", "dtw")
_ROWS = pa.schema(
    [
        table_field("distance", pa.string(), "distance of two clips"),
        table_field("ranked_by", pa.string(), "the distance, or a form of mutual proximity"),
        table_field(
            "nearest_neighbour", pa.float64(), "share of clips whose nearest other is of their class"
        ),
        table_field("mean_average_precision", pa.float64(), "each clip ranks all others"),
    ]
)


@dataclass(frozen=True, eq=False)
class MutualStudy:
    """What every way of ranking is worth."""

    rows: pa.Table

    def to_arrow(self) -> pa.Table:
        """Return a row for every distance and way of ranking."""
        return self.rows


@dataclass(frozen=True, eq=False)
class MutualExperiment:
    """A study, and how many clips it was made on."""

    study: MutualStudy
    clips: int
    classes: int


def study_mutual(catalog: Catalog, label_column: str, draws: int, seed: int, show: Show) -> MutualExperiment:
    """Score every way of ranking on all labelled clips; nothing is drawn, whatever `draws` and `seed` are.

    Raises
    ------
    CatalogError
        The run compared some pairs alone.
    UserError
        The catalog has no such labels, or fewer than two that two clips have.
    """
    refuse_without_all_pairs(catalog, "an experiment on ranking")
    clips = labelled_clips(catalog, label_column)
    pairs, clip_ids = catalog.pairs.to_arrow(), catalog.clips.to_arrow()["clip_id"]
    places = condensed_places(pairs, clip_ids)
    known = np.isin(clip_ids.to_pylist(), clips.clip_ids)
    rows = []
    with show({"rank": len(_METRICS) * len(_FORMS)}) as advance:
        for metric in _METRICS:
            distances = squareform(condensed(pairs, metric, places))[np.ix_(known, known)]
            for form, proximity in _FORMS.items():
                ranks = _ranks(proximity(distances), distances)
                nearest = nearest_neighbour_accuracy(ranks, clips.classes)
                rows.append((metric, form, nearest, mean_average_precision(ranks, clips.classes)))
                advance("rank")
    columns = dict(zip(_ROWS.names, map(list, zip(*rows, strict=True)), strict=True))
    classes = len(set(clips.classes.tolist()))
    return MutualExperiment(MutualStudy(pa.table(columns, schema=_ROWS)), len(clips.clip_ids), classes)


def mutual_report(experiment: MutualExperiment) -> RenderableType:
    """Lay a study out for reading."""
    rows = [
        [row["distance"], row["ranked_by"], *(f"{row[name]:.3f}" for name in _ROWS.names[2:])]
        for row in experiment.study.rows.to_pylist()
    ]
    said = f"{experiment.clips} clips of {experiment.classes} classes, each asked for the others"
    return Group(text_table(["distance", "ranked by", "1-NN", "mAP"], rows), Text(said))


def _ranks(proximity: Square, distances: Square) -> Square:
    """Rank the others of every clip, the most proximate first; equals by distance, then together."""
    by_distance = rankdata(distances, method="dense", axis=1)
    order = rankdata(-proximity, method="dense", axis=1)
    return order * (by_distance.max() + 1.0) + by_distance


def _counted(distances: Square) -> Square:
    clips = len(distances)
    proximity = np.empty_like(distances)
    for clip in range(clips):
        further = (distances[clip] > distances[clip][:, None]) & (distances > distances[clip][:, None])
        proximity[clip] = further.sum(axis=1) / max(clips - 2, 1)
    return proximity


def _independent_normal(distances: Square) -> Square:
    usual = _usual(distances)
    further = np.asarray(norm.sf(distances, usual.mean[:, None], np.sqrt(usual.variance)[:, None]))
    return further * further.T


def _independent_gamma(distances: Square) -> Square:
    usual, proximity = _usual(distances), np.zeros_like(distances)
    for clip in range(len(distances)):
        others = np.delete(np.arange(len(distances)), clip)
        proximity[clip, others] = mutual_proximity(others, distances[clip, others], usual)
    return proximity


def _usual(distances: Square) -> UsualDistances:
    others = distances[~np.eye(len(distances), dtype=bool)].reshape(len(distances), -1)
    return UsualDistances(np.arange(len(distances)), others.mean(axis=1), others.var(axis=1))


_FORMS: dict[str, Callable[[Square], Square]] = {
    "distance": np.negative,
    "counted": _counted,
    "independent, normal": _independent_normal,
    "independent, gamma": _independent_gamma,
}
