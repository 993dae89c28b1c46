"""The scores of a warp, each against its definition written out."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import Warp, dtw, uniform
from motionary.pipeline.evaluation import alignment_scores


@given(n=st.integers(3, 25), m=st.integers(3, 25), seed=st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_every_score_is_that_of_its_definition(n, m, seed):
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(n, 4)).cumsum(axis=0), rng.normal(size=(m, 4)).cumsum(axis=0)
    moving[:, 2] = reference[:, 2] = 1.5  # moves in neither
    moving[:, 3] = 0.25  # moves in one alone, which counts as no correlation
    warp, plain = uniform(moving, reference), dtw(moving, reference)
    found = alignment_scores(moving, reference, warp, plain, 20.0)
    warped = warp.apply(moving)
    each = [np.corrcoef(warped[:, k], reference[:, k])[0, 1] for k in (0, 1)]
    assert found.correlation == pytest.approx(sum(each) / 3)
    assert found.distance == pytest.approx(
        sum(math.dist(one, other) for one, other in zip(warped, reference, strict=True)) / m
    )
    apart = sum(abs(warp.source_time[k] - plain.source_time[k]) for k in range(m)) / m
    assert found.from_dtw == pytest.approx(apart / 20)
    rough = []
    for k in (0, 1):
        steps = [warped[t + 1, k] - warped[t, k] for t in range(m - 1)]
        turns = [steps[t + 1] - steps[t] for t in range(m - 2)]
        rough.append(math.hypot(*turns) / math.hypot(*steps))
    assert found.roughness == pytest.approx(sum(rough) / 2)
    assert found.longest_still == 0


def test_standing_still_is_counted_in_steps_of_the_same_time():
    values = np.arange(10.0)[:, None]
    times = np.array([0, 1, 1 + 1e-9, 1, 1 + 1e-9, 2, 2, 3, 3.5, 9])
    warp = Warp(np.maximum.accumulate(times), 10)
    assert alignment_scores(values, values, warp, warp, 10.0).longest_still == pytest.approx(0.3)


def test_what_does_not_move_has_no_correlation_and_two_frames_no_roughness():
    still = np.ones((2, 3))
    warp = uniform(still, still)
    found = alignment_scores(still, still, warp, warp, 30.0)
    assert (found.correlation, found.roughness, found.distance, found.from_dtw) == (None, None, 0, 0)
