"""Motions in the time of a reference: every method is ``method(moving, reference, ...) -> Warp``."""

from motionary.pipeline.alignment.correlation import mean_correlation
from motionary.pipeline.alignment.cotw import CotwWarp, cotw
from motionary.pipeline.alignment.path_warp import PathWarp, dtw
from motionary.pipeline.alignment.reference import (
    ReferenceScores,
    score_references,
    select_reference,
    similarity_index,
)
from motionary.pipeline.alignment.search import cotw_search
from motionary.pipeline.alignment.trajectories import computed_trajectories, roughness
from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.joint_weights import PRESETS, joint_weights

__all__ = [
    "PRESETS",
    "CotwWarp",
    "PathWarp",
    "ReferenceScores",
    "Warp",
    "computed_trajectories",
    "cotw",
    "cotw_search",
    "dtw",
    "joint_weights",
    "mean_correlation",
    "roughness",
    "score_references",
    "select_reference",
    "similarity_index",
    "uniform",
]
