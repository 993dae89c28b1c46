"""The additive version of eq. 8, maximised: against every warp, summed by hand."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment.likely_warps import likely_warps
from motionary.pipeline.alignment.matched import matched_pair
from tests.alignment import naive
from tests.alignment.test_cotw import wave

PRICES = (-0.5, 0.0, 0.5)


def sums(problem: naive.Problem, nodes: list[int], moved: list[int]) -> tuple[float, float]:
    """The sums that stand for rho and h, from their formulas in the module."""
    total = math.fsum(problem.weights)
    shown = naive.output(problem, nodes, moved)
    rho = h = 0.0
    for weight, x, y, matched in zip(problem.weights, shown, problem.target, problem.source, strict=True):
        mean, matched_mean = math.fsum(y) / len(y), math.fsum(matched) / len(matched)
        centred = [value - mean for value in y]
        norms = math.sqrt(
            math.fsum(value**2 for value in centred)
            * math.fsum((value - matched_mean) ** 2 for value in matched)
        )
        products = ((value - matched_mean) * other for value, other in zip(x, centred, strict=True))
        rho += weight / total * math.fsum(products) / norms
        steps = [(b - a) ** 2 for a, b in itertools.pairwise(matched)]
        for k, (first, last) in enumerate(itertools.pairwise(nodes)):
            share = math.fsum(steps[first:last]) / math.fsum(steps)
            h += weight / total / 2 * share * ((last - first) / (moved[k + 1] - moved[k]) - 1)
    return rho, h


@given(st.integers(0, 2**32 - 1), st.sampled_from([(16, 8), (19, 6), (21, 7), (24, 8)]), st.integers(1, 3))
@settings(max_examples=20, deadline=None)
def test_no_warp_has_a_greater_sum_at_any_price(seed: int, shape: tuple[int, int], dofs: int) -> None:
    frames, length = shape
    rng = np.random.default_rng(seed)
    moving, reference = rng.normal(size=(frames + 7, dofs)), rng.normal(size=(frames, dofs))
    problem = naive.Problem(moving, reference, length)
    found = list(likely_warps(matched_pair(moving, reference, None), [length], 4, 0.5, "equal", False))
    slack = length - 4
    every = []
    for etas in itertools.product(range(-slack, slack + 1), repeat=problem.segments):
        if sum(etas) == 0:
            spans = np.diff(problem.nodes) + etas
            every.append(sums(problem, problem.nodes, [0, *np.cumsum(spans).tolist()]))
    of_found = [sums(problem, problem.nodes, warp.moved.tolist()) for warp in found]
    for price in PRICES:
        best = max(rho - price * h for rho, h in every)
        assert max(rho - price * h for rho, h in of_found) == pytest.approx(best, abs=1e-9)


def test_little_stretched_the_sums_are_near_to_what_they_stand_for() -> None:
    moving, reference = wave(150, 5, seed=0), wave(120, 5, seed=1)
    problem = naive.Problem(moving, reference, 20)
    found = list(likely_warps(matched_pair(moving, reference, None), [20], 18, 0.5, "equal", False))
    assert max(warp.slack for warp in found) == 2
    for warp in found:
        nodes, moved = problem.nodes, warp.moved.tolist()
        rho, h = naive.whole_output(problem, nodes, moved)
        near_rho, near_h = sums(problem, nodes, moved)
        assert near_rho == pytest.approx(rho, abs=0.02)
        assert abs(near_h) == pytest.approx(h, abs=0.02)


def test_open_ends_begin_before_and_end_after() -> None:
    dense = wave(13001, 6, seed=7)
    pair = matched_pair(dense[::100], dense[1500:11501:100], None)
    found = list(likely_warps(pair, [20, 25], 4, 0.5, "equal", True))
    assert min(warp.moved[0] for warp in found) < 0
    assert max(warp.moved[-1] for warp in found) > 100
    for warp in found:
        assert warp.slack <= warp.segment_length - 4
        assert (np.diff(warp.moved) >= 3).all()


def test_dofs_without_weight_or_variance_count_nothing() -> None:
    moving, reference = wave(60, 3, seed=0), wave(50, 3, seed=1)
    moving[:, 1], reference[:, 2] = 3.0, 0.1

    def moves(weights: list[float] | None) -> list[list[int]]:
        pair = matched_pair(moving, reference, weights)
        return [warp.moved.tolist() for warp in likely_warps(pair, [10, 14], 4, 0.0, "equal", False)]

    assert moves(None) == moves([1, 0, 0])
    assert moves([1, 0, 0]) != moves([0, 1, 1])
