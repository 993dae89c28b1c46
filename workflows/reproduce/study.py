"""A study: distances and linkages scored on many sets of the same clips, and what that comes to on average.

The sets are the same for every combination, so differences are taken set by set. Intervals are 95 in a
hundred of the normal distribution around the mean over draws (1.96 standard errors). They say how much the
draw matters, not how other people's clips would score: all draws come from one catalog and share clips.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.combinations import StudiedDistance, pairs_among
from motionary.workflows.reproduce.draws import RULES, WHOLE, draw
from motionary.workflows.reproduce.scores import MEASURES, score_set


@dataclass(frozen=True)
class Combination:
    """What a motion is compared by, and clustered by."""

    features: str
    distance: str
    linkage: str


@dataclass(frozen=True)
class Mean:
    """A mean over sets with its interval; a single set has none."""

    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False)
class Study:
    """Scores of every combination on every set.

    Parameters
    ----------
    combinations : tuple of Combination (C,)
        In the order they were given.
    sets : array (S,) of str
        The rule each set was drawn by.
    values : array (S, C, measures)
        In the order of `MEASURES`.
    """

    combinations: tuple[Combination, ...]
    sets: NDArray[np.str_]
    values: NDArray[np.float64]

    def mean(
        self, rule: str, combination: Combination, measure: str, minus: Combination | None = None
    ) -> Mean:
        """Average a measure over the sets of one rule, or its difference from another combination's."""
        values = self._column(rule, combination, measure)
        return mean_of(values if minus is None else values - self._column(rule, minus, measure))

    def to_arrow(self) -> pa.Table:
        """Return a row for every rule and combination, with mean and interval of every measure."""
        fields = [
            table_field("clips_drawn", pa.string(), "rule the sets were drawn by"),
            table_field("sets", pa.int32(), "how many"),
            table_field("features", pa.string(), "what a frame is compared by"),
            table_field("distance", pa.string(), "distance of two clips"),
            table_field("linkage", pa.string(), "what clusters them"),
        ]
        for name, meaning in MEASURES.items():
            fields.append(table_field(name, pa.float64(), f"mean of: {meaning}", nullable=True))
            for end in ("low", "high"):
                fields.append(table_field(f"{name}_{end}", pa.float64(), "95% interval", nullable=True))
        rows = [self._row(rule, one) for rule in (*RULES, WHOLE) for one in self.combinations]
        return pa.Table.from_pylist(rows, schema=pa.schema(fields))

    def _row(self, rule: str, combination: Combination) -> dict[str, object]:
        row: dict[str, object] = {
            "clips_drawn": rule,
            "sets": int((self.sets == rule).sum()),
            "features": combination.features,
            "distance": combination.distance,
            "linkage": combination.linkage,
        }
        for name in MEASURES:
            mean = self.mean(rule, combination, name)
            value = None if np.isnan(mean.value) else mean.value
            row |= {name: value, f"{name}_low": mean.low, f"{name}_high": mean.high}
        return row

    def _column(self, rule: str, combination: Combination, measure: str) -> NDArray[np.float64]:
        place = self.combinations.index(combination), list(MEASURES).index(measure)
        return self.values[self.sets == rule, place[0], place[1]]


def mean_of(values: NDArray[np.float64]) -> Mean:
    """Average over sets, those without a value left out."""
    known = values[~np.isnan(values)]
    if not known.size:
        return Mean(float("nan"), None, None)
    mean = float(known.mean())
    if known.size == 1:
        return Mean(mean, None, None)
    half = 1.96 * float(known.std(ddof=1)) / np.sqrt(known.size)
    return Mean(mean, mean - half, mean + half)


def run_study(
    distances: Mapping[str, Sequence[StudiedDistance]],
    classes: NDArray[np.object_],
    subjects: NDArray[np.object_] | None,
    draws: int,
    seed: int,
    advance: Callable[[], None],
) -> Study:
    """Score every distance on `draws` sets of every rule, and on all clips.

    Parameters
    ----------
    distances : mapping of str to sequence of StudiedDistance
        For every kind of features its distances, of all clips.
    classes : array (N,)
        Class of every clip.
    subjects : array (N,), optional
        Who moves.
    draws : int
        Sets a rule.
    seed : int
        Of the draws.
    advance : callable
        Called after every set.
    """
    combinations = tuple(
        Combination(features, distance.name, linkage)
        for features, several in distances.items()
        for distance in several
        for linkage in distance.linkage_names
    )
    sets = [(rule, number) for rule in RULES for number in range(draws)] + [(WHOLE, 0)]
    values = np.empty((len(sets), len(combinations), len(MEASURES)))
    for row, (rule, number) in enumerate(sets):
        chosen = draw(classes, rule, seed, number)
        pairs = pairs_among(chosen, len(classes))
        known, who = classes[chosen], None if subjects is None else subjects[chosen]
        scores = [
            [by_measure[name] for name in MEASURES]
            for several in distances.values()
            for distance in several
            for by_measure in score_set(distance.among(pairs), known, who).values()
        ]
        values[row] = scores
        advance()
    return Study(combinations, np.array([rule for rule, _ in sets]), values)
