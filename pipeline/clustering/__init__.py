"""Hierarchical clustering: linkage, where to cut, and what the clusters are called [DC 5].

The estimator stands on scikit-learn, which takes a second to import; so it is imported when it is asked for.
"""

from typing import TYPE_CHECKING, Any

from motionary.pipeline.clustering.choice import Cut, CutRule, choose_cut
from motionary.pipeline.clustering.cut import (
    LevelScores,
    Strip,
    cut_tree,
    strip_of,
    threshold_strips,
    widest_strip,
)
from motionary.pipeline.clustering.labels import label_cut, labels_suffice
from motionary.pipeline.clustering.linkage import (
    average_linkage,
    complete_linkage,
    fuzzy_linkage,
    ward_linkage,
)
from motionary.pipeline.clustering.modularity import modularity_cut, nearest_neighbour_graph
from motionary.pipeline.clustering.naming import OWN_LABEL_SOURCES, LabelSource, Names, name_clusters

if TYPE_CHECKING:
    from motionary.pipeline.clustering.estimator import MotionClusterer

__all__ = [
    "OWN_LABEL_SOURCES",
    "Cut",
    "CutRule",
    "LabelSource",
    "LevelScores",
    "MotionClusterer",
    "Names",
    "Strip",
    "average_linkage",
    "choose_cut",
    "complete_linkage",
    "cut_tree",
    "fuzzy_linkage",
    "label_cut",
    "labels_suffice",
    "modularity_cut",
    "name_clusters",
    "nearest_neighbour_graph",
    "strip_of",
    "threshold_strips",
    "ward_linkage",
    "widest_strip",
]


def __getattr__(name: str) -> Any:
    if name != "MotionClusterer":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from motionary.pipeline.clustering.estimator import MotionClusterer

    return MotionClusterer
