"""The rules of naming, one by one."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from motionary.pipeline.clustering import name_clusters


def named(labels, overrides=None, clusters=None, distances=None, reach=1.5):
    clips = len(labels)
    return name_clusters(
        [0] * clips if clusters is None else clusters,
        labels,
        [None] * clips if overrides is None else overrides,
        np.ones(clips) if distances is None else distances,
        reach,
    )


def test_an_override_wins_over_a_supplied_label():
    names = named(["walk", "walk", None], overrides=["run", None, "jump"])
    assert names.label == ("run", "walk", "jump")
    assert names.label_source == ("override", "supplied", "override")
    assert_array_equal(names.confidence, [1, 1, 1])


def test_overrides_count_for_the_name_of_the_cluster_in_place_of_what_they_replace():
    names = named(["walk", "walk", "run", None], overrides=["run", None, None, None])
    assert names.cluster_name == {0: "run"}
    assert names.label[3] == "run"


def test_a_propagated_label_is_the_most_frequent_with_its_confidence():
    names = named(["walk", "walk", "run", None])
    assert names.label[3] == "walk"
    assert names.label_source[3] == "propagated"
    assert names.confidence[3] == 2 / 4


def test_ties_are_alphabetical():
    assert named(["walk", "run", None]).cluster_name == {0: "run"}


def test_own_labels_stand_against_the_cluster():
    names = named(["walk", "walk", "run"])
    assert names.label == ("walk", "walk", "run")
    assert names.confidence[2] == 1


def test_a_cluster_without_labels_has_no_name():
    names = named(["walk", None, None], clusters=[0, 7, 7])
    assert names.cluster_name == {0: "walk", 7: None}
    assert names.label == ("walk", None, None)
    assert names.label_source[1:] == ("unassigned", "unassigned")
    assert_array_equal(names.confidence, [1, 0, 0])


def test_a_clip_out_of_reach_is_unassigned():
    names = named(["walk", "walk", "run", None, None], distances=[0, 1.0, 2.0, 3.0, 3.1])
    assert names.label_source[3:] == ("propagated", "unassigned")
    assert named(["walk", None], distances=[1.0, 3.1], reach=4).label[1] == "walk"


def test_own_labels_hold_at_any_distance():
    assert named(["walk", "run"], overrides=[None, "hop"], distances=[0.0, 99.0]).label == ("walk", "hop")


def test_reach_is_measured_in_the_clips_own_cluster():
    names = named(["walk", None, "run", None], clusters=["a", "a", "b", "b"], distances=[1.0, 2.0, 10.0, 2.0])
    assert names.label == ("walk", None, "run", "run")


@settings(max_examples=200, deadline=None)
@given(
    clips=st.lists(
        st.tuples(
            st.integers(0, 2),
            st.sampled_from(["a", "b", None]),
            st.sampled_from(["a", "c", None, None]),
            st.integers(0, 4),
        ),
        max_size=12,
    )
)
def test_all_rules_together(clips):
    names = name_clusters(*([clip[field] for clip in clips] for field in range(4)))
    for i, (cluster, supplied, override, distance) in enumerate(clips):
        own = [(o or s, d) for c, s, o, d in clips if c == cluster and (o or s)]
        ranked = sorted(Counter(label for label, _ in own).items(), key=lambda item: (-item[1], item[0]))
        assert names.cluster_name[cluster] == (ranked[0][0] if ranked else None)
        if override or supplied:
            expected = (override or supplied, "override" if override else "supplied", 1.0)
        elif ranked and distance <= 1.5 * max(d for _, d in own):
            expected = (ranked[0][0], "propagated", ranked[0][1] / (len(own) + 1))
        else:
            expected = (None, "unassigned", 0.0)
        assert (names.label[i], names.label_source[i], names.confidence[i]) == expected


def test_wrong_input_is_refused():
    with pytest.raises(ValueError, match="2 clusters, 1 labels, 2 overrides and 2 distances"):
        name_clusters([0, 0], ["a"], [None, None], [1.0, 1.0])
    with pytest.raises(ValueError, match="label of clip 1 is ''"):
        named(["a", ""])
    with pytest.raises(ValueError, match="override of clip 0 is nan"):
        named(["a", None], overrides=[np.nan, None])
    with pytest.raises(ValueError, match="distance of clip 1 to its reference is nan"):
        named(["a", None], distances=[0, np.nan])
