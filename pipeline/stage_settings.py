"""What the results of each stage depend on beside what they read."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.layout import digest_of_settings
from motionary.pipeline.stages import (
    align,
    assign,
    cluster,
    compare,
    identify,
    ingest,
    name,
    refine,
    regroup,
    represent,
    resample,
    sample,
    stand,
    style,
)

_MERGING = ("kind", "epsilon", "criterion")
"""Settings of the features that nothing depends on but what is compared."""

_LINKING = ("primary", "metric", "fuzzy_tau")
"""Settings of the clusters that landmarks' neighbours depend on."""


def stage_settings(config: PipelineConfig) -> dict[str, str]:
    """Return of every stage a digest of its version and of the settings that its results depend on."""
    reading = digest_of_settings(reading_settings(config))
    merging = digest_of_settings(
        "resample", resample.VERSION, reading, {name: getattr(config.features, name) for name in _MERGING}
    )
    drawn = config.distances.thresholds == "random"
    some: tuple[Any, ...] = () if config.most_distance is None else (config.most_distance,)
    if config.distances.pairs == "landmarks":
        some = ("landmarks",)
    compared = digest_of_settings(
        "compare",
        compare.VERSION,
        merging,
        config.distances.thresholds,
        config.distances.seed * drawn,
        *some,
    )
    aligned = digest_of_settings(
        "align", align.VERSION, reading, asdict(config.alignment), config.features.frame_rate
    )
    clusters = asdict(config.clusters)
    if config.clusters.landmarks is None:
        del clusters["landmarks"]
    linked = [clusters[name] for name in _LINKING]
    stood, assigned, refined = (
        digest_of_settings(stage, module.VERSION, compared, linked)
        for stage, module in (("stand", stand), ("assign", assign), ("refine", refine))
    )
    return {
        "ingest": reading,
        "resample": merging,
        "compare": compared,
        "cluster": digest_of_settings("cluster", cluster.VERSION, compared, clusters),
        "sample": digest_of_settings("sample", sample.VERSION, merging),
        "stand": stood,
        "assign": assigned,
        "refine": refined,
        "regroup": digest_of_settings("regroup", regroup.VERSION, stood, assigned, refined),
        "identify": digest_of_settings("identify", identify.VERSION),
        "represent": digest_of_settings(
            "represent", represent.VERSION, compared, config.clusters.metric, config.alignment.weights
        ),
        "align": aligned,
        "style": digest_of_settings("style", style.VERSION, aligned),
        "name": digest_of_settings(
            "name", name.VERSION, config.clusters.label_column, config.clusters.reach
        ),
    }  # fmt: skip


def reading_settings(config: PipelineConfig) -> list[Any]:
    """Return what the content of a clip depends on beside its files, as JSON values."""
    features = asdict(config.features)
    read = {name: features[name] for name in features if name not in _MERGING}
    return ["ingest", ingest.VERSION, asdict(config.read), read]
