"""Distances between clips: DTW, B-DTW, S-DTW, the DTW-Curve and what is made of it [DC 3-5]."""

from motionary.pipeline.distances.cost import cost_matrix
from motionary.pipeline.distances.curve import (
    THRESHOLDS,
    dtw_curve,
    fuzzy_distance,
    random_thresholds,
    weighted_distance,
)
from motionary.pipeline.distances.dtw import bidirectional_dtw_distance, dtw_distance, dtw_path
from motionary.pipeline.distances.pairwise import PairwiseDistances, compare_clips, pairwise_distances
from motionary.pipeline.distances.segment_dtw import segment_dtw_distance
from motionary.pipeline.distances.zones import similar_zones

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
    "random_thresholds",
    "segment_dtw_distance",
    "similar_zones",
    "weighted_distance",
]
