"""Why two clips are together or apart: the DTW-Curve of a pair taken apart, in frames and in seconds.

Distances are computed and not looked up, so that a file can be asked about too; they are those of table
`pairs`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from motionary.catalog.example import ClipOrFile, Example, example_of
from motionary.catalog.explanation import CurvePoint, ExplainedClip, Explanation, Span, Zone
from motionary.catalog.ranked_distance import ranked_distance
from motionary.catalog.warp_pieces import make_warp
from motionary.pipeline.config import Metric
from motionary.pipeline.motion import FloatArray

if TYPE_CHECKING:
    from motionary.catalog.query import Catalog
    from motionary.pipeline.distances.explain import ExplainedThreshold, ExplainedZone


def explain(
    catalog: Catalog,
    a: ClipOrFile,
    b: ClipOrFile,
    metric: Metric | None = None,
) -> Explanation:
    """Take the distances of two clips apart.

    Parameters
    ----------
    catalog : Catalog
    a, b : str, path or Example
        Clips of the catalog, or files, read as the run's settings say, or what `example_of` made of one.
    metric : {"dtw", "b_dtw", "weighted", "fuzzy"}, optional
        The distance to explain; by default the one that the published clusters are made of.

    Raises
    ------
    CatalogError
        There is no such clip or file, or no such metric.
    ReadError, SkeletonError
        A file cannot be read, or its skeleton is not known.
    """
    from motionary.pipeline.distances.explain import explain_pair, feature_parts

    config = catalog.config
    distance = ranked_distance(config, metric)
    one, other = example_of(catalog, a), example_of(catalog, b)
    pair = explain_pair(
        one.features, other.features, feature_parts(config.features.kind), distance.thresholds
    )
    scale = _Scale(one, other, pair.parts, config.features.frame_rate)
    first, second = (_clip(catalog, example) for example in (one, other))
    return Explanation(
        a=first,
        b=second,
        metric=distance.metric,
        features=config.features.kind,
        frame_rate=config.features.frame_rate,
        distances=pair.distances,
        contributions={name: scale.named(values) for name, values in pair.contributions.items()},
        curve=[scale.point(threshold) for threshold in pair.thresholds],
        warp=make_warp(
            pair.forward if distance.metric == "dtw" else pair.cheaper,
            scale.edges(one),
            scale.edges(other),
        ),
    )


class _Scale:
    """Turns what is told in compared frames and in order of the parts into seconds and names."""

    def __init__(self, a: Example, b: Example, parts: tuple[str, ...], frame_rate: float) -> None:
        self.a, self.b, self.parts, self.frame_rate = a, b, parts, frame_rate

    def named(self, contributions: FloatArray) -> dict[str, float]:
        return dict(zip(self.parts, contributions.tolist(), strict=True))

    def edges(self, example: Example) -> FloatArray:
        """When every compared frame begins, and when the last one ends (frames + 1,)."""
        return np.append(example.first_frame, example.last_frame[-1]) / self.frame_rate

    def span(self, example: Example, first: int, last: int) -> Span:
        begin, end = int(example.first_frame[first]), int(example.last_frame[last])
        return Span(first, last, begin, end, begin / self.frame_rate, end / self.frame_rate)

    def zone(self, zone: ExplainedZone) -> Zone:
        top, bottom, left, right = zone.rectangle
        return Zone(
            a=self.span(self.a, top, bottom),
            b=self.span(self.b, left, right),
            segment_a=zone.row_segment,
            segment_b=zone.column_segment,
            chosen=zone.chosen,
            backward=zone.path.backward,
            distance=zone.path.distance,
            path_a=zone.path.cells[:, 0].tolist(),
            path_b=zone.path.cells[:, 1].tolist(),
            contributions=self.named(zone.path.contributions),
        )

    def point(self, one: ExplainedThreshold) -> CurvePoint:
        return CurvePoint(
            threshold=one.threshold,
            weight=one.weight,
            limit=one.limit,
            distance=one.distance,
            segments_a=[self.span(self.a, *ends) for ends in one.row_segments.tolist()],
            segments_b=[self.span(self.b, *ends) for ends in one.column_segments.tolist()],
            zones=[self.zone(zone) for zone in one.zones],
            contributions=self.named(one.contributions),
        )


def _clip(catalog: Catalog, example: Example) -> ExplainedClip:
    rows = catalog.sql(
        "select cluster_id, label from clusters where clip_id = ?", [example.clip_id]
    ).to_pylist()
    return ExplainedClip(
        name=example.name,
        clip_id=example.clip_id,
        **(rows[0] if rows else {"cluster_id": None, "label": None}),
        seconds=example.seconds,
        first_frame=example.first_frame.tolist(),
        last_frame=example.last_frame.tolist(),
    )
