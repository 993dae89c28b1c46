"""Motions in the time of a reference: every method is ``method(moving, reference, ...) -> Warp``.

Of several sequences at once: ``method(sequences, ...)``, with one `Warp` a sequence. Frame by frame:
`OnlineAligner`. `ALIGNERS` has all methods for two sequences by name.
"""

from motionary.pipeline.alignment.adaptive import adaptive_dtw, constrained_dtw
from motionary.pipeline.alignment.canonical_time_warping import CanonicalWarp, canonical_time_warping
from motionary.pipeline.alignment.composed import in_time_of
from motionary.pipeline.alignment.correlation import mean_correlation
from motionary.pipeline.alignment.cotw import CotwWarp, cotw
from motionary.pipeline.alignment.dtw import derivative_dtw, dtw
from motionary.pipeline.alignment.generalized import GeneralizedWarping, generalized_time_warping
from motionary.pipeline.alignment.iterative import IterativeWarp, iterative_motion_warping
from motionary.pipeline.alignment.limited import limited_dtw
from motionary.pipeline.alignment.multiset_cca import Embedding, multiset_cca
from motionary.pipeline.alignment.online import OnlineAligner, online_warp
from motionary.pipeline.alignment.path_warp import PathWarp
from motionary.pipeline.alignment.postures import linearised_postures, posture_weights
from motionary.pipeline.alignment.procrustes import (
    ProcrustesMotionWarping,
    ProcrustesWarping,
    procrustes_derivative_dtw,
    procrustes_dtw,
    procrustes_motion_warping,
)
from motionary.pipeline.alignment.quadratic_programme import UnsolvedError
from motionary.pipeline.alignment.reference import (
    ReferenceScores,
    score_references,
    select_reference,
    similarity_index,
)
from motionary.pipeline.alignment.registry import ALIGNERS, Aligner
from motionary.pipeline.alignment.search import cotw_search
from motionary.pipeline.alignment.trajectories import computed_trajectories, roughness
from motionary.pipeline.alignment.uniform import uniform
from motionary.pipeline.alignment.warp import Warp
from motionary.pipeline.alignment.windows import Itakura, SakoeChiba
from motionary.pipeline.joint_weights import PRESETS, joint_weights

__all__ = [
    "ALIGNERS",
    "PRESETS",
    "Aligner",
    "CanonicalWarp",
    "CotwWarp",
    "Embedding",
    "GeneralizedWarping",
    "Itakura",
    "IterativeWarp",
    "OnlineAligner",
    "PathWarp",
    "ProcrustesMotionWarping",
    "ProcrustesWarping",
    "ReferenceScores",
    "SakoeChiba",
    "UnsolvedError",
    "Warp",
    "adaptive_dtw",
    "canonical_time_warping",
    "computed_trajectories",
    "constrained_dtw",
    "cotw",
    "cotw_search",
    "derivative_dtw",
    "dtw",
    "generalized_time_warping",
    "in_time_of",
    "iterative_motion_warping",
    "joint_weights",
    "limited_dtw",
    "linearised_postures",
    "mean_correlation",
    "multiset_cca",
    "online_warp",
    "posture_weights",
    "procrustes_derivative_dtw",
    "procrustes_dtw",
    "procrustes_motion_warping",
    "roughness",
    "score_references",
    "select_reference",
    "similarity_index",
    "uniform",
]
