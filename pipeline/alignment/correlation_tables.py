"""How well every segment, stretched by every eta, fits at every place of the reference [CoTW 3.2, eq. 5].

A segment is stretched and centred once for all places, its products with the reference are computed four
places at a time, and the norms of the reference's windows come from one table, which a search shares between
all segment lengths. A table for the largest slack serves all smaller ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.alignment.matched import MatchedPair
from motionary.pipeline.alignment.nodes import Segments
from motionary.pipeline.motion import FloatArray


@dataclass(frozen=True, eq=False)
class TableLayout:
    """Where the cells of c segments' tables stand in one array, one table after another.

    A segment's table is [eta - least_eta, output frame of its first node - first].

    Parameters
    ----------
    start : array (c + 1,)
        Where each begins.
    least_eta, most_eta : array (c,)
        Rows.
    first, places : array (c,)
        Columns: the output frame of the first, and their number.
    """

    start: NDArray[np.int64]
    least_eta: NDArray[np.int64]
    most_eta: NDArray[np.int64]
    first: NDArray[np.int64]
    places: NDArray[np.int64]


def table_layout(segments: Segments) -> TableLayout:
    """Lay out tables for every stretch and output place that the segments can reach."""
    spans, low, high = np.diff(segments.nodes), segments.low, segments.high
    least_eta = np.maximum(-segments.slacks, low[1:] - high[:-1] - spans)
    most_eta = np.minimum(segments.slacks, high[1:] - low[:-1] - spans)
    places = high[:-1] - low[:-1] + 1
    start = np.append(0, np.cumsum((most_eta - least_eta + 1) * places))
    return TableLayout(start, least_eta, most_eta, low[:-1], places)


@dataclass(frozen=True, eq=False)
class CorrelationTables:
    """J of every segment, stretch and output place that a warp can reach.

    Parameters
    ----------
    values : array (cells,)
    layout : TableLayout
    """

    values: FloatArray
    layout: TableLayout


@dataclass(frozen=True, eq=False)
class Deviations:
    """Inverse norms of the reference's centred windows, spans from `least` on; one serves a whole search."""

    inverse: FloatArray
    least: int


def reference_deviations(pair: MatchedPair, least: int, most: int) -> Deviations:
    """Compute the inverse norms of all windows of `least` to `most` frames from end to end."""
    from motionary.pipeline.alignment.correlation_kernels import inverse_deviations

    most = max(least, min(most, pair.frames - 1))
    return Deviations(inverse_deviations(pair.target, pair.frames, pair.target_floor, least, most), least)


def correlation_tables(
    pair: MatchedPair, segments: Segments, deviations: Deviations | None = None
) -> CorrelationTables:
    """Compute J wherever the segments can go.

    Parameters
    ----------
    pair : MatchedPair
    segments : Segments
    deviations : Deviations, optional
        Of at least the spans needed; made here where not given.

    Returns
    -------
    CorrelationTables
        They serve smaller slacks and narrower ranges too: no cell depends on them.
    """
    from motionary.pipeline.alignment.correlation_kernels import fill_tables

    layout, spans = table_layout(segments), np.diff(segments.nodes)
    if deviations is None:
        least, most = (spans + layout.least_eta).min(), (spans + layout.most_eta).max()
        deviations = reference_deviations(pair, int(least), int(most))
    values = np.zeros(layout.start[-1])
    fill_tables(
        pair.source, pair.target, segments.nodes, segments.low, segments.high, layout.least_eta,
        layout.most_eta, layout.start, pair.weights, pair.source_floor, pair.target_floor,
        deviations.inverse, deviations.least, values,
    )  # fmt: skip
    return CorrelationTables(values, layout)
