"""How good a result is: clusters against known classes, paths and warped sequences against known ones."""

from motionary.pipeline.evaluation.alignments import AlignmentScores, alignment_scores
from motionary.pipeline.evaluation.clusters import (
    Purity,
    adjusted_rand_index,
    best_reward_punish,
    normalised_mutual_information,
    purity,
    reward_punish,
)
from motionary.pipeline.evaluation.paths import longest_stay, path_deviation, path_error
from motionary.pipeline.evaluation.trajectories import (
    jerk,
    joint_trajectories,
    kendall_tau_similarity,
    mean_distance,
)

__all__ = [
    "AlignmentScores",
    "Purity",
    "adjusted_rand_index",
    "alignment_scores",
    "best_reward_punish",
    "jerk",
    "joint_trajectories",
    "kendall_tau_similarity",
    "longest_stay",
    "mean_distance",
    "normalised_mutual_information",
    "path_deviation",
    "path_error",
    "purity",
    "reward_punish",
]
