"""Measures of warping paths: definitions summed row by row, hand-made paths, what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motionary.pipeline.evaluation.paths import longest_stay, path_deviation, path_error

DIAGONAL = np.repeat(np.arange(9)[:, None], 2, axis=1)
FRAMES = st.floats(-50, 50, width=32) | st.integers(-5, 5).map(float)


@st.composite
def two_paths(draw):
    sequences = draw(st.integers(1, 4))
    return [draw(arrays(np.float64, (draw(st.integers(1, 12)), sequences), elements=FRAMES)) for _ in "ab"]


def slow_path_error(path_a, path_b):
    def directed(here, there):
        return sum(min(math.dist(row, other) for other in there) for row in here)

    return (directed(path_a, path_b) + directed(path_b, path_a)) / (len(path_a) + len(path_b))


@settings(max_examples=200, deadline=None)
@given(two_paths())
def test_path_error_is_equation_9_row_by_row(paths):
    path_a, path_b = paths
    expected = slow_path_error(path_a.tolist(), path_b.tolist())
    assert path_error(path_a, path_b) == pytest.approx(expected, abs=1e-9)
    assert path_error(path_b, path_a) == pytest.approx(expected, abs=1e-9)
    assert path_error(path_a, np.repeat(path_a, 2, axis=0)) == 0


def test_path_error_of_hand_made_paths():
    below = [(0, 0), (1, 0), (2, 1), (3, 2), (3, 3)]
    straight = [(0, 0), (1, 1), (2, 2), (3, 3)]
    assert path_error(below, straight) == pytest.approx(((0 + 1 + 1 + 1 + 0) + (0 + 1 + 1 + 0)) / 9)
    # A path of other length and the same rows is no error; three sequences are as good as two.
    assert path_error(straight, [(0, 0), *straight, (3, 3)]) == 0
    assert path_error([(0, 0, 0)], [(1, 2, 2), (2, 3, 6)]) == pytest.approx((3 + 3 + 7) / 3)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(FRAMES, FRAMES), min_size=1, max_size=20))
def test_path_deviation_is_equation_3_frame_by_frame(rows):
    source_a, source_b = (np.array(column) for column in zip(*rows, strict=True))
    expected = sum(abs(a - b) for a, b in rows) / len(rows)
    assert path_deviation(source_a, source_b) == pytest.approx(expected)
    assert path_deviation(source_a, source_a) == 0


def test_longest_stay_counts_steps_in_which_one_sequence_stands_still():
    assert longest_stay(DIAGONAL) == 0
    assert longest_stay([(0, 0)]) == 0
    assert longest_stay([(0, 0), (0, 1), (1, 2), (2, 2), (3, 2), (4, 2), (5, 3)]) == 3
    assert longest_stay([(0, 0), (0, 1), (0, 2), (1, 2), (2, 2)]) == 2  # round a corner: two stays of two


@settings(max_examples=200, deadline=None)
@given(st.lists(st.sampled_from([(0, 1), (1, 0), (1, 1)]), max_size=30))
def test_longest_stay_against_a_walk_along_the_path(steps):
    path = np.cumsum([(0, 0), *steps], axis=0)
    longest = 0
    for still in ((0, 1), (1, 0)):
        run = 0
        for step in steps:
            run = run + 1 if step == still else 0
            longest = max(longest, run)
    assert longest_stay(path) == longest


@pytest.mark.parametrize(
    ("path", "what"),
    [
        (np.zeros((0, 2)), r"path_a has shape \(0, 2\)"),
        (np.zeros(5), r"path_a has shape \(5,\)"),
        (np.zeros((3, 3)), "path_a has 3 sequences and path_b 2"),
        (np.array([[0, 0], [1, np.nan]]), "path_a holds nan at frame 1, DOF 1"),
        (np.array([["0", "1"]]), "real numbers"),
    ],
)
def test_path_error_refuses_what_is_no_path(path, what):
    with pytest.raises(ValueError, match=what):
        path_error(path, DIAGONAL)


def test_path_deviation_refuses_other_targets():
    with pytest.raises(ValueError, match="3 target frames and source_b 4"):
        path_deviation(np.zeros(3), np.zeros(4))
    with pytest.raises(ValueError, match="source_b holds inf at frame 2"):
        path_deviation(np.zeros(3), np.array([0, 0, np.inf]))
    with pytest.raises(ValueError, match=r"source_a has shape \(3, 2\); it needs one time a target frame"):
        path_deviation(np.zeros((3, 2)), np.zeros(3))
    with pytest.raises(ValueError, match="source_a has shape .* at least one"):
        path_deviation(np.zeros(0), np.zeros(3))


def test_longest_stay_refuses_a_path_that_falls():
    with pytest.raises(ValueError, match=r"falls from \(1.0, 1.0\) to \(2.0, 0.0\) after cell 1"):
        longest_stay([(0, 0), (1, 1), (2, 0)])
