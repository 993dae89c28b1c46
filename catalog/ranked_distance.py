"""The distance that clips are ranked by: which of them, and how table `pairs` holds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from motionary.catalog.errors import CatalogError
from motionary.pipeline.config import Metric, PipelineConfig
from motionary.pipeline.stages.compare import thresholds_of


@dataclass(frozen=True)
class RankedDistance:
    """A distance of two clips as one number.

    Parameters
    ----------
    metric : {"dtw", "b_dtw", "weighted", "fuzzy"}
        Fuzzy is an interval and ranks by low + tau (high - low).
    tau : float
        Of a fuzzy one.
    thresholds : tuple of float
        lambda of the curve.
    """

    metric: Metric
    tau: float
    thresholds: tuple[float, ...]

    @property
    def columns(self) -> list[str]:
        """The columns of `pairs` that hold it."""
        return ["fuzzy_low", "fuzzy_high"] if self.metric == "fuzzy" else [self.metric]

    def of(self, pairs: pa.Table) -> NDArray[np.float32]:
        """Compute it from those columns, to the bit as `nearest_clips` does."""
        if self.metric != "fuzzy":
            return pairs[self.metric].to_numpy()
        low, high = (pairs[column].to_numpy().astype(np.float64) for column in self.columns)
        return ((1.0 - self.tau) * low + self.tau * high).astype(np.float32)


def ranked_distance(config: PipelineConfig, metric: Metric | None = None) -> RankedDistance:
    """Choose a distance as a run computed it.

    Parameters
    ----------
    config : PipelineConfig
        The run's.
    metric : str, optional
        By default that of the run's published clusters.

    Raises
    ------
    CatalogError
        There is no such metric.
    """
    if metric not in (None, *get_args(Metric)):
        raise CatalogError(f"no metric {metric!r}; there are {', '.join(get_args(Metric))}")
    primary: Metric = "fuzzy" if config.clusters.primary == "fuzzy" else config.clusters.metric
    return RankedDistance(metric or primary, config.clusters.fuzzy_tau, thresholds_of(config.distances))
