"""The level of a dendrogram that agrees best with the labels there are.

The measure is the reward-punish value [DC eq. 12-13] of the labelled clips: over ordered pairs in one
cluster, +1 for equal labels and -1 for different ones. A merge of clusters I and J that hold i_c and j_c
clips of class c adds

    2 (same - other) = 4 sum_c i_c j_c - 2 |I| |J|

so one walk up the tree gives the value at every level.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from motionary.pipeline.clustering.cut import LevelScores, best_level, merge_heights


def labels_suffice(labels: Sequence[str | None]) -> bool:
    """Tell whether labels can decide a cut: at least two classes have two labelled clips each."""
    return _classes_of_two(labels) >= 2


def label_cut(Z: NDArray[np.float64], labels: Sequence[str | None]) -> LevelScores:
    """Choose the number of clusters by the reward-punish value on the labelled clips.

    Parameters
    ----------
    Z : array (N-1, 4)
        SciPy linkage matrix.
    labels : sequence of str or None
        Label of every clip, None where there is none; such clips do not count.

    Returns
    -------
    LevelScores
        The choice, and the value of every kappa from N down to 1. Chosen among the levels that some threshold
        yields. Ties go to fewer clusters, so that unlabelled clips join labelled ones rather than stay alone.

    Raises
    ------
    ValueError
        The number of labels is not N, or `labels_suffice` does not hold.
    """
    clips = len(merge_heights(Z)) + 1
    if len(labels) != clips:
        raise ValueError(f"Z is of {clips} clips, and there are {len(labels)} labels")
    if not labels_suffice(labels):
        raise ValueError(
            f"{_classes_of_two(labels)} classes have two labelled clips or more; cutting by labels needs 2"
        )
    held = [Counter([label] if label is not None else []) for label in labels]
    score = [0]
    for left, right in Z[:, :2].astype(int).tolist():
        less, more = sorted((held[left], held[right]), key=len)
        same = sum(count * more[label] for label, count in less.items())
        score.append(score[-1] + 4 * same - 2 * less.total() * more.total())
        more.update(less)
        less.clear()
        held.append(more)
    return best_level(Z, np.arange(clips, 0, -1), np.array(score, dtype=np.float64))


def _classes_of_two(labels: Sequence[str | None]) -> int:
    return sum(count >= 2 for label, count in Counter(labels).items() if label is not None)
