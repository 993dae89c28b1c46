"""Zones: the rectangles around the 8-connected regions of cells not above delta."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from motionary.pipeline.distances import similar_zones
from tests.distances import naive
from tests.distances.strategies import SEEDS, costs, zoned_costs

THRESHOLDS = st.sampled_from([0.0, 0.25, 0.3, 0.35, 0.5, 0.75, 0.85, 0.95, 1.0])


def labelled(cost, threshold):
    """The zones as scipy finds them."""
    delta = cost.min() + threshold * (cost.max() - cost.min()) if threshold < 1 else cost.max()
    regions, _ = ndimage.label(cost <= delta, structure=np.ones((3, 3)))
    boxes = ndimage.find_objects(regions)
    return sorted((rows.start, rows.stop - 1, columns.start, columns.stop - 1) for rows, columns in boxes)


@settings(max_examples=150, deadline=None)
@given(st.one_of(costs(longest=9), zoned_costs()), THRESHOLDS)
def test_agrees_with_flood_fill(cost, threshold):
    zones = similar_zones(cost, threshold)
    assert [tuple(zone) for zone in zones] == naive.zones(cost, threshold) == labelled(cost, threshold)
    assert zones.dtype == np.int64


@settings(max_examples=100, deadline=None)
@given(st.one_of(costs(longest=9), zoned_costs()), THRESHOLDS)
def test_exchange_of_the_motions_exchanges_rows_and_columns(cost, threshold):
    exchanged = similar_zones(cost.T, threshold)[:, [2, 3, 0, 1]]
    assert sorted(exchanged.tolist()) == similar_zones(cost, threshold).tolist()


@settings(max_examples=80, deadline=None)
@given(
    SEEDS,
    st.tuples(st.integers(1, 30), st.sampled_from([1, 2, 31, 62, 63, 64, 65, 126, 127, 128, 129, 190, 260])),
    st.sampled_from([0.1, 0.4, 0.6, 0.9]),
    st.sampled_from([0.05, 0.45, 0.95]),
    st.booleans(),
)
def test_agrees_with_scipy_at_any_width(seed, shape, share, threshold, transposed):
    """Runs of low cells that begin and end anywhere, across whatever words of bits they are kept in."""
    rng = np.random.default_rng(seed)
    flips = rng.random(shape) < rng.choice([0.05, 0.5])
    cost = np.where((np.cumsum(flips, axis=1) % 2 == 0) & (rng.random(shape) < share), 0.0, 1.0)
    cost = cost.T if transposed else cost
    assert [tuple(zone) for zone in similar_zones(cost, threshold)] == labelled(cost, threshold)


@pytest.mark.parametrize("smooth", [0, 1, 3])
@pytest.mark.parametrize("threshold", [0.2, 0.45, 0.6, 0.9])
@pytest.mark.parametrize("shape", [(40, 127), (200, 3)])
def test_agrees_with_scipy_on_smooth_costs(shape, smooth, threshold):
    noise = np.random.default_rng(smooth).random(shape)
    cost = ndimage.uniform_filter(noise, size=smooth) if smooth else noise
    assert [tuple(zone) for zone in similar_zones(cost, threshold)] == labelled(cost, threshold)


def test_corners_touch_and_rings_enclose():
    cost = np.ones((5, 6))
    cost[0, 0] = cost[1, 1] = 0  # touch by a corner
    cost[4, 3:] = cost[2, 3:] = cost[2:, 3] = cost[2:, 5] = 0  # a ring around one dear cell
    np.testing.assert_array_equal(similar_zones(cost, 0.5), [[0, 1, 0, 1], [2, 4, 3, 5]])
    cost[1, 2] = 0
    np.testing.assert_array_equal(similar_zones(cost, 0.5), [[0, 4, 0, 5]])


def test_region_inside_a_ring_is_a_zone_of_its_own():
    cost = np.zeros((5, 5))
    cost[1:4, 1:4] = 1
    cost[2, 2] = 0
    np.testing.assert_array_equal(similar_zones(cost, 0.5), [[0, 4, 0, 4], [2, 2, 2, 2]])


def test_everything_is_kept_at_one():
    # In floating point, 0.2 + 1.0 * (0.9 - 0.2) falls short of 0.9.
    cost = np.array([[0.2, 0.9, 0.2]])
    assert 0.2 + 1.0 * (0.9 - 0.2) < 0.9
    np.testing.assert_array_equal(similar_zones(cost, 1.0), [[0, 0, 0, 2]])
    np.testing.assert_array_equal(similar_zones(np.ones((2, 3)), 0.0), [[0, 1, 0, 2]])


def test_the_least_cost_is_kept_at_zero_and_delta_itself_anywhere():
    np.testing.assert_array_equal(similar_zones([[1.0, 2.0, 1.0]], 0.0), [[0, 0, 0, 0], [0, 0, 2, 2]])
    np.testing.assert_array_equal(similar_zones([[2.0, 1.0, 3.0]], 0.5), [[0, 0, 0, 1]])


def test_every_other_cell_is_a_region():
    cost = np.ones((41, 131))
    cost[::2, ::2] = 0
    zones = similar_zones(cost, 0.5)
    assert len(zones) == 21 * 66
    assert zones.tolist() == sorted(zones.tolist())


@pytest.mark.parametrize("threshold", [-0.1, 1.1, np.nan])
def test_refuses_thresholds_outside(threshold):
    with pytest.raises(ValueError, match="must lie in 0 .. 1"):
        similar_zones([[0.0]], threshold)
