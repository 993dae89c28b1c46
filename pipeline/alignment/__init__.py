"""Motions in the time of a reference: every method is ``method(moving, reference, ...) -> Warp``."""

from motionary.pipeline.alignment.correlation import mean_correlation
from motionary.pipeline.alignment.cotw import CotwWarp, cotw, default_parameters
from motionary.pipeline.alignment.reference import (
    ReferenceScores,
    score_references,
    select_reference,
    similarity_index,
)
from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.weights import PRESETS, joint_weights

__all__ = [
    "PRESETS",
    "CotwWarp",
    "ReferenceScores",
    "Warp",
    "cotw",
    "default_parameters",
    "joint_weights",
    "mean_correlation",
    "score_references",
    "select_reference",
    "similarity_index",
    "uniform",
]
