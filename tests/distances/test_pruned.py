"""The pairs up to mu: none is lost, none is added, and every value has the bits of the full computation."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.distances import (
    THRESHOLDS,
    compare_clips,
    cost_matrix,
    pairwise_distances,
    random_thresholds,
    weighted_distance,
)
from motionary.pipeline.distances import pruned as module
from motionary.pipeline.distances.lower_bound import (
    Axes,
    box_limit,
    boxed_clips,
    principal_axes,
    runs_apart,
)
from motionary.pipeline.distances.pruned import Pruning, compare_under, pairwise_under
from tests.distances import naive
from tests.distances.strategies import SEEDS, clip_lists, costs, frame_pairs, zoned_costs

FIELDS = ("dtw", "b_dtw", "curve", "weighted", "fuzzy_low", "fuzzy_high")
ENDS = np.array([0, 1])
WEIGHTS = np.array([weighted_distance(row) for row in np.eye(len(THRESHOLDS))])


def chosen_mu(weighted, share, at):
    """A quantile of the distances: between two of them, or one of them, or just below it."""
    mu = np.quantile(weighted.astype(np.float32), share, method="higher") if weighted.size else np.float32(0)
    return {"at": float(mu), "below": max(0.0, np.nextafter(float(mu), -1)), "above": float(mu) * 1.01}[at]


def assert_is_the_full_one(found, full, first, second, mu):
    kept = full.weighted.astype(np.float32).astype(np.float64) <= mu
    np.testing.assert_array_equal(found.first, first[kept])
    np.testing.assert_array_equal(found.second, second[kept])
    for field in FIELDS:
        np.testing.assert_array_equal(
            getattr(found.distances, field), getattr(full, field)[kept], err_msg=field
        )
    assert found.pruning.pairs == kept.size
    assert kept.sum() <= found.pruning.whole <= kept.size


@settings(max_examples=150, deadline=None)
@given(
    clips=clip_lists(most=6, dtypes=(np.float32, np.float64)),
    share=st.floats(0, 1),
    at=st.sampled_from(["at", "below", "above"]),
    seed=st.none() | st.integers(0, 9),
)
def test_the_pairs_of_one_list_are_those_of_the_full_computation(clips, share, at, seed):
    thresholds = THRESHOLDS if seed is None else random_thresholds(seed)
    full = pairwise_distances(clips, n_jobs=1, thresholds=thresholds)
    mu = chosen_mu(full.weighted, share, at)
    found = pairwise_under(clips, mu, thresholds)
    assert_is_the_full_one(found, full, *np.triu_indices(len(clips), 1), mu)


@settings(max_examples=60, deadline=None)
@given(
    clips=clip_lists(most=6, dtypes=(np.float32, np.float64)),
    cut=st.integers(0, 6),
    share=st.floats(0, 1),
    at=st.sampled_from(["at", "below", "above"]),
)
def test_the_pairs_of_two_lists_are_those_of_the_full_computation(clips, cut, share, at):
    one, other = clips[:cut], clips[cut:]
    full = compare_clips(one, other)
    mu = chosen_mu(full.weighted.reshape(-1), share, at)
    flat = dataclasses.replace(
        full, **{f: getattr(full, f).reshape(-1, *getattr(full, f).shape[2:]) for f in FIELDS}
    )
    first, second = np.indices((len(one), len(other))).reshape(2, -1)
    assert_is_the_full_one(compare_under(one, other, mu), flat, first, second, mu)


def library(seed=0, clips=40, d=12):
    """Clips of eight kinds, so that every bound has something to refuse."""
    rng = np.random.default_rng(seed)
    kinds = [np.cumsum(rng.normal(size=(24, d)), axis=0) * 0.1 for _ in range(8)]
    return [
        (kinds[k % 8][rng.integers(0, 6) : rng.integers(12, 25)] + 0.05 * rng.normal(size=d)).astype(
            np.float32
        )
        for k in range(clips)
    ]


def test_every_bound_refuses_something_and_the_counts_add_up():
    clips = library()
    full = pairwise_distances(clips, n_jobs=1)
    found = pairwise_under(clips, float(np.quantile(full.weighted, 0.2)))
    refused = dataclasses.asdict(found.pruning)
    assert refused.pop("pairs") == len(full.weighted)
    assert all(count > 0 for count in refused.values()), refused
    assert found.pruning.whole == len(full.weighted) - sum(refused.values())
    assert len(found.first) <= found.pruning.whole < len(full.weighted) / 2


def test_slots_that_fill_up_lose_nothing(monkeypatch):
    clips = library(1)
    full = pairwise_distances(clips, n_jobs=1)
    for slots in (1, 7):
        monkeypatch.setattr(module, "SLOTS", slots)
        for share in (0.3, 1.0):
            mu = float(np.quantile(full.weighted, share, method="higher")) * 1.001
            assert_is_the_full_one(pairwise_under(clips, mu), full, *np.triu_indices(len(clips), 1), mu)


def test_equal_clips_are_found_at_mu_zero():
    clips = [clip for clip in library(2, clips=5) for _ in range(2)]
    found = pairwise_under(clips, 0.0)
    np.testing.assert_array_equal(
        np.column_stack([found.first, found.second]), [[k, k + 1] for k in range(0, 10, 2)]
    )
    assert not found.distances.curve.any()


def test_thresholds_without_weight_refuse_nothing():
    clips = library(3, clips=6)
    found = pairwise_under(clips, 0.0, thresholds=[0.2, 1.0])
    full = pairwise_distances(clips, n_jobs=1, thresholds=[0.2, 1.0])
    assert_is_the_full_one(found, full, *np.triu_indices(6, 1), 0.0)
    assert found.pruning == Pruning(15, 0, 0, 0, 0)


@pytest.mark.parametrize("few", [[], [np.zeros((3, 2), np.float32)]])
def test_fewer_than_two_clips_have_no_pairs(few):
    assert pairwise_under(few, 1.0).pruning.pairs == 0
    assert compare_under(few, [], 1.0).distances.curve.shape == (0, 8)


@pytest.mark.parametrize("mu", [-1.0, np.nan, np.inf])
def test_a_threshold_that_is_none_is_refused(mu):
    with pytest.raises(ValueError, match="it must be finite and not negative"):
        pairwise_under(library(clips=2), mu)
    with pytest.raises(ValueError, match=r"clips_b\[0\] has shape"):
        compare_under(library(clips=2), [np.zeros((0, 12), np.float32)], 1.0)


@settings(max_examples=150, deadline=None)
@given(frame_pairs(), st.integers(0, 3))
def test_boxes_further_apart_than_their_limit_prove_it(pair, way):
    """The limit is put at the weighted distance itself: then no two clips may count as apart."""
    clips = list(pair)
    least = weighted_distance([float(cost_matrix(*clips).astype(np.float64).min())] * 8)
    axes = principal_axes(clips)
    if way == 1:
        # Any orthonormal axes bound as truly.
        d = clips[0].shape[1]
        q, _ = np.linalg.qr(np.random.default_rng(d).normal(size=(d, min(d, 16))))
        axes = Axes(axes.origin, np.ascontiguousarray(q), 1.0 + 1e-12)
    limit = module._squared(box_limit(least, WEIGHTS, clips, axes), clips[0].dtype)
    a, b = (boxed_clips([clip], axes) for clip in clips)
    assert not runs_apart(a, 0, b, 0, limit)
    one_each = (boxes._replace(runs=boxes.whole, run_start=ENDS, block_start=ENDS) for boxes in (a, b))
    assert not runs_apart(next(one_each), 0, next(one_each), 0, limit)
    for clip, boxes in zip(clips, (a, b), strict=True):
        placed = (clip - axes.origin) @ axes.directions
        for run in range(-(-len(clip) // 2)):
            assert (boxes.runs.low[run] <= placed[2 * run : 2 * run + 2]).all()
            assert (placed[2 * run : 2 * run + 2] <= boxes.runs.high[run]).all()


def test_without_its_margins_the_limit_would_lose_a_pair():
    """Squares that are too small to be added to 1 make the cost less than the distance, and than the gap."""
    clips = [np.zeros((1, 59), np.float32), np.full((1, 59), 1.7e-4, np.float32)]
    clips[1][0, 0] = 1
    cost = float(cost_matrix(*clips)[0, 0])
    assert cost < np.linalg.norm(clips[1].astype(np.float64))
    least, axes = weighted_distance([cost] * 8), principal_axes(clips)
    a, b = (boxed_clips([clip], axes) for clip in clips)
    apart = [
        runs_apart(a, 0, b, 0, module._squared(limit, clips[0].dtype))
        for limit in (least / WEIGHTS.sum() * axes.stretch, box_limit(least, WEIGHTS, clips, axes))
    ]
    assert apart == [True, False]


@settings(max_examples=100, deadline=None)
@given(SEEDS, st.integers(1, 40), st.integers(1, 40), st.sampled_from([np.float32, np.float64]))
def test_boxes_are_apart_just_when_all_gaps_are(seed, m, n, dtype):
    rng = np.random.default_rng(seed)
    clips = [np.cumsum(rng.normal(size=(k, 5)), axis=0).astype(dtype) for k in (m, n)]
    axes = principal_axes(clips)
    a, b = (boxed_clips([clip], axes) for clip in clips)
    gaps = np.maximum(0, np.maximum(a.runs.low[:, None] - b.runs.high, b.runs.low - a.runs.high[:, None]))
    least = float((gaps.astype(np.float64) ** 2).sum(axis=2).min())
    assert runs_apart(a, 0, b, 0, dtype(least * (1 - 1e-5) - 1e-30))
    assert not runs_apart(a, 0, b, 0, dtype(least * (1 + 1e-5)))


@settings(max_examples=150, deadline=None)
@given(st.one_of(costs(longest=9), zoned_costs(longest=15)))
def test_the_profile_is_below_segment_dtw(cost):
    """By definition: stretches of rows, or columns, with a cell up to delta, the least cost of each."""
    low, high = cost.min(), cost.max()
    for threshold in THRESHOLDS[:-1]:
        delta = low + threshold * (high - low)
        bound = max(profile(cost.min(axis=1), delta), profile(cost.min(axis=0), delta))
        assert bound <= naive.segment_dtw(cost, threshold) * (1 + 1e-9)


def profile(least, delta):
    total, stretch = 0.0, []
    for value in [*least, np.inf]:
        if value <= delta:
            stretch.append(value)
        elif stretch:
            total += min(stretch)
            stretch = []
    return total
