"""Merging of low-motion frames, against a reading of the paper's rule word by word."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.resample import merge_low_motion


def naive_groups(values: np.ndarray, epsilon: float, criterion: str) -> list[tuple[int, int]]:
    """Grow each group as long as the rule allows, recomputing its differences every time."""
    groups, start = [], 0
    while start < len(values):
        end = start
        while end + 1 < len(values):
            inner = [float(np.linalg.norm(values[k + 1] - values[k])) for k in range(start, end + 1)]
            bound = sum(inner) if criterion == "sum" else sum(inner) / len(inner)
            if not bound < epsilon:
                break
            end += 1
        groups.append((start, end))
        start = end + 1
    return groups


@pytest.mark.parametrize("criterion", ["sum", "mean"])
@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    frames=st.integers(1, 30),
    epsilon=st.sampled_from([0.0, 0.3, 1.0, 2.5, 1e9]),
)
def test_groups_are_the_longest_runs(criterion, seed, frames, epsilon):
    # Quarters are exact in binary, so that both ways of summing agree at a boundary.
    values = np.random.default_rng(seed).integers(-2, 3, size=(frames, 1)) / 4.0
    made = merge_low_motion(values, epsilon, criterion)
    assert list(zip(made.first.tolist(), made.last.tolist(), strict=True)) == naive_groups(
        values, epsilon, criterion
    )
    for mean, first, last in zip(made.values, made.first, made.last, strict=True):
        np.testing.assert_allclose(mean, values[first : last + 1].mean(axis=0), atol=1e-6)


def test_standing_becomes_one_frame_and_moving_stays():
    standing, moving = np.zeros((50, 3)), np.cumsum(np.ones((5, 3)), axis=0)
    made = merge_low_motion(np.concatenate([standing, moving]), 0.1)
    assert made.last.tolist() == [49, 50, 51, 52, 53, 54]
    assert made.values.dtype == np.float32


def test_only_the_driving_columns_decide():
    values = np.array([[0.0, 0.0], [0.0, 9.0], [0.0, 18.0]])
    assert len(merge_low_motion(values, 0.1).values) == 3
    assert merge_low_motion(values, 0.1, driving=1).values.tolist() == [[0.0, 9.0]]


def test_the_sum_starts_anew_in_each_group():
    values = np.array([0.0, 0.06, 0.12, 0.18, 0.24])[:, None]
    assert merge_low_motion(values, 0.1).first.tolist() == [0, 2, 4]
