"""Distances between clips: DTW, B-DTW, S-DTW, the DTW-Curve and what is made of it [DC 3-5].

The modules hold compiled kernels, and Numba alone takes half a second to import; so each is imported when
one of its names is first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionary.pipeline.distances.cost import cost_matrix
    from motionary.pipeline.distances.curve import (
        THRESHOLDS,
        dtw_curve,
        fuzzy_distance,
        random_thresholds,
        weighted_distance,
    )
    from motionary.pipeline.distances.dtw import bidirectional_dtw_distance, dtw_distance, dtw_path
    from motionary.pipeline.distances.dtw_pairs import pairwise_dtw
    from motionary.pipeline.distances.pairwise import PairwiseDistances, compare_clips, pairwise_distances
    from motionary.pipeline.distances.segment_dtw import segment_dtw_distance
    from motionary.pipeline.distances.zones import similar_zones

_MODULE_OF = {
    "THRESHOLDS": "curve",
    "PairwiseDistances": "pairwise",
    "bidirectional_dtw_distance": "dtw",
    "compare_clips": "pairwise",
    "cost_matrix": "cost",
    "dtw_curve": "curve",
    "dtw_distance": "dtw",
    "dtw_path": "dtw",
    "fuzzy_distance": "curve",
    "pairwise_distances": "pairwise",
    "pairwise_dtw": "dtw_pairs",
    "random_thresholds": "curve",
    "segment_dtw_distance": "segment_dtw",
    "similar_zones": "zones",
    "weighted_distance": "curve",
}

__all__ = [
    "THRESHOLDS",
    "PairwiseDistances",
    "bidirectional_dtw_distance",
    "compare_clips",
    "cost_matrix",
    "dtw_curve",
    "dtw_distance",
    "dtw_path",
    "fuzzy_distance",
    "pairwise_distances",
    "pairwise_dtw",
    "random_thresholds",
    "segment_dtw_distance",
    "similar_zones",
    "weighted_distance",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
