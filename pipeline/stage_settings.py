"""What the results of each stage depend on beside what they read."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from motionary.pipeline.config import PipelineConfig
from motionary.pipeline.layout import digest_of_settings
from motionary.pipeline.stages import (
    align,
    cluster,
    compare,
    identify,
    ingest,
    name,
    represent,
    resample,
    style,
)

_MERGING = ("kind", "epsilon", "criterion")
"""Settings of the features that nothing depends on but what is compared."""


def stage_settings(config: PipelineConfig) -> dict[str, str]:
    """Return of every stage a digest of its version and of the settings that its results depend on."""
    reading = digest_of_settings(reading_settings(config))
    merging = digest_of_settings(
        "resample", resample.VERSION, reading, {name: getattr(config.features, name) for name in _MERGING}
    )
    drawn = config.distances.thresholds == "random"
    pruned = () if config.most_distance is None else (config.most_distance,)
    compared = digest_of_settings(
        "compare",
        compare.VERSION,
        merging,
        config.distances.thresholds,
        config.distances.seed * drawn,
        *pruned,
    )
    aligned = digest_of_settings(
        "align", align.VERSION, reading, asdict(config.alignment), config.features.frame_rate
    )
    return {
        "ingest": reading,
        "resample": merging,
        "compare": compared,
        "cluster": digest_of_settings("cluster", cluster.VERSION, compared, asdict(config.clusters)),
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
