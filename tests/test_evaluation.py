"""Measures of agreement with classes: published values, definitions summed pair by pair, missing classes."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.metrics import adjusted_rand_score, average_precision_score, normalized_mutual_info_score

from motionary.pipeline.evaluation import (
    adjusted_rand_index,
    best_reward_punish,
    normalised_mutual_information,
    purity,
    reward_punish,
)
from motionary.pipeline.retrieval import mean_average_precision, nearest_neighbour_accuracy

# The paper's motions: basketball, soccer, boxing, jumping, running, walking.
PAPER_CLASSES = np.repeat(np.arange(6), (11, 6, 7, 17, 20, 19))

clips = st.lists(st.tuples(st.integers(0, 3), st.sampled_from(["a", "b", "c", None])), max_size=15)


def test_the_papers_best_value_is_1176():
    assert best_reward_punish(PAPER_CLASSES) == 1176
    assert reward_punish(PAPER_CLASSES, PAPER_CLASSES) == 1176


def test_extremes_of_the_papers_motions():
    assert reward_punish(np.arange(80), PAPER_CLASSES) == 0
    assert reward_punish(np.zeros(80), PAPER_CLASSES) == 1176 - (80 * 79 - 1176)


@settings(max_examples=200, deadline=None)
@given(clips)
def test_reward_punish_is_a_sum_over_ordered_pairs(clips):
    expected = 0
    for i, (cluster, kind) in enumerate(clips):
        for j, (other_cluster, other_kind) in enumerate(clips):
            if i != j and cluster == other_cluster and kind is not None and other_kind is not None:
                expected += 1 if kind == other_kind else -1
    value = reward_punish([c for c, _ in clips], [k for _, k in clips])
    assert value == expected
    assert isinstance(value, int)
    assert value <= best_reward_punish([k for _, k in clips])


@settings(max_examples=100, deadline=None)
@given(clips.filter(lambda clips: any(kind is not None for _, kind in clips)))
def test_purity_counts_the_commonest_class(clips):
    result = purity([c for c, _ in clips], [k for _, k in clips])
    best, total = 0, 0
    for cluster in {c for c, _ in clips}:
        held = [k for c, k in clips if c == cluster and k is not None]
        if not held:
            assert cluster not in result.by_cluster
            continue
        most = max(held.count(kind) for kind in held)
        assert result.by_cluster[cluster] == most / len(held)
        best, total = best + most, total + len(held)
    assert result.overall == best / total


def test_adjusted_rand_index_of_a_worked_example():
    # Of 15 pairs 7 are together in clusters, 4 in classes and 4 in both; by chance 7 * 4 / 15 would be.
    clusters, classes = [0, 0, 0, 0, 1, 1], ["a", "a", "a", "b", "c", "c"]
    together, expected = 4, 7 * 4 / 15
    assert adjusted_rand_index(clusters, classes) == pytest.approx(
        (together - expected) / ((7 + 4) / 2 - expected)
    )


@settings(max_examples=200, deadline=None)
@given(clips.filter(lambda clips: any(kind is not None for _, kind in clips)))
def test_indices_are_scikit_learns(clips):
    clusters, classes = [c for c, _ in clips], [k for _, k in clips]
    held = [(c, k) for c, k in clips if k is not None]
    known, found = [k for _, k in held], [c for c, _ in held]
    assert adjusted_rand_index(clusters, classes) == pytest.approx(
        adjusted_rand_score(known, found), abs=1e-12
    )
    information = normalised_mutual_information(clusters, classes)
    assert information == pytest.approx(normalized_mutual_info_score(known, found), abs=1e-7)
    assert 0 <= information <= 1 + 1e-12


@settings(max_examples=200, deadline=None)
@given(st.integers(2, 9), st.integers(0, 2**32 - 1), st.integers(1, 20))
def test_average_precision_is_scikit_learns(count, seed, levels):
    rng = np.random.default_rng(seed)
    square = rng.integers(0, levels, (count, count)) / 4.0
    square += square.T
    classes = rng.choice(["a", "b", None], count, p=[0.5, 0.3, 0.2]).tolist()
    precisions = []
    for clip, kind in enumerate(classes):
        others = [o for o in range(count) if o != clip and classes[o] is not None]
        same = [classes[o] == kind for o in others]
        if kind is not None and any(same):
            precisions.append(average_precision_score(same, -square[clip, others]))
    if precisions:
        assert mean_average_precision(square, classes) == pytest.approx(np.mean(precisions))
    else:
        with pytest.raises(ValueError, match="no class has two clips"):
            mean_average_precision(square, classes)


def test_average_precision_of_a_worked_example():
    place = np.array([0.0, 1.0, 3.0, 7.0])
    # The classes of the others, nearest first: b a b, a a b, b a b, a b a.
    distances = abs(place[:, None] - place)
    assert mean_average_precision(distances, ["a", "b", "a", "b"]) == pytest.approx(
        np.mean([1 / 2, 1 / 3, 1 / 2, 1 / 2])
    )


def test_clips_without_class_are_left_out():
    clusters, classes = [0, 0, 1, 1, 0, 2], ["a", "a", "b", "b", None, None]
    assert adjusted_rand_index(clusters, classes) == 1.0
    assert purity(clusters, classes).by_cluster == {0: 1.0, 1: 1.0}
    assert reward_punish(clusters, classes) == best_reward_punish(classes) == 4
    missing = pd.Series(["a", "a", "b", "b", None, np.nan])
    assert reward_punish(pd.Series(clusters), missing) == 4


def test_nearest_neighbours_of_the_same_class():
    place = np.array([0.0, 1.0, 1.5, 10.0, 11.5])
    distances = abs(place[:, None] - place)
    # Nearest: 0 -> 1, 1 -> 2, 2 -> 1, 3 -> 4, 4 -> 3.
    assert nearest_neighbour_accuracy(distances, ["a", "a", "b", "c", "c"]) == 3 / 5
    assert nearest_neighbour_accuracy(distances, ["a", "a", None, "c", "c"]) == 1.0


def test_with_groups_only_other_groups_answer():
    place = np.array([0.0, 1.0, 5.0, 6.0])
    distances = abs(place[:, None] - place)
    # In other groups the nearest is: 0 -> 2, 1 -> 2, 2 -> 1, 3 -> 1.
    classes, groups = ["a", "b", "b", "a"], ["x", "x", "y", "y"]
    assert nearest_neighbour_accuracy(distances, classes, groups) == 2 / 4
    assert nearest_neighbour_accuracy(distances, classes) == 0.0


def test_the_first_of_equally_near_neighbours_answers():
    assert nearest_neighbour_accuracy(np.ones((3, 3)), ["a", "a", "b"]) == 2 / 3


def test_a_clip_whose_neighbours_are_all_of_its_group_is_not_asked():
    assert nearest_neighbour_accuracy(np.ones((3, 3)), ["a", None, "a"], ["x", "y", "z"]) == 1.0
    with pytest.raises(ValueError, match="no clip with a class has a neighbour"):
        nearest_neighbour_accuracy(np.ones((3, 3)), ["a", None, "a"], ["x", "y", "x"])


def test_wrong_input_is_refused():
    with pytest.raises(ValueError, match="2 clips have a cluster and 3 a class"):
        reward_punish([0, 1], ["a", "b", "c"])
    with pytest.raises(ValueError, match="clip 1 has no cluster"):
        reward_punish([0, None], ["a", "b"])
    with pytest.raises(ValueError, match="no clip has a class"):
        purity([0, 1], [None, None])
    with pytest.raises(ValueError, match="no clip has a class"):
        adjusted_rand_index([0, 1], [None, None])
    with pytest.raises(ValueError, match=r"shape \(2, 2\)"):
        nearest_neighbour_accuracy(np.ones((2, 2)), ["a"])
    for measure in (nearest_neighbour_accuracy, mean_average_precision):
        with pytest.raises(ValueError, match="not a number"):
            measure(np.full((2, 2), np.nan), ["a", "a"])
    with pytest.raises(ValueError, match=r"shape \(2, 3\)"):
        mean_average_precision(np.ones((2, 3)), ["a", "a"])
    with pytest.raises(ValueError, match="no clip has a class"):
        normalised_mutual_information([0, 1], [None, None])
