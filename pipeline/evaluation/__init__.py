"""How good a result is: clusters against known classes."""

from motionary.pipeline.evaluation.clusters import (
    Purity,
    adjusted_rand_index,
    best_reward_punish,
    normalised_mutual_information,
    purity,
    reward_punish,
)

__all__ = [
    "Purity",
    "adjusted_rand_index",
    "best_reward_punish",
    "normalised_mutual_information",
    "purity",
    "reward_punish",
]
