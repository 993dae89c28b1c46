import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from motionary.pipeline.alignment.bases import FAMILIES, USUAL_BASES, monotone_basis
from motionary.pipeline.alignment.warp_weights import nearest_weights, weight_limits


@given(
    name=st.sampled_from(sorted(FAMILIES)),
    number=st.integers(1, 14),
    frames=st.integers(2, 60),
    steps=st.integers(2, 80),
)
@settings(max_examples=120, deadline=None)
def test_every_function_rises_from_first_to_last_frame(
    name: str, number: int, frames: int, steps: int
) -> None:
    values = monotone_basis({name: number}, frames, steps).values
    assert values.shape == (steps, number)
    np.testing.assert_allclose(values[0], 0, atol=1e-12)
    np.testing.assert_allclose(values[-1], frames - 1)
    assert (np.diff(values, axis=0) >= -1e-12 * frames).all()


@pytest.mark.parametrize(
    ("name", "number", "at_half"),
    [
        ("polynomial", 5, [0.5, 0.25, 0.5**0.5, 0.125, 0.5 ** (1 / 3)]),
        ("exponential", 2, [(np.e - 1) / (np.e**2 - 1), (np.e**2 - 1) / (np.e**4 - 1)]),
        ("logarithm", 1, [np.log(1 + (np.e**2 - 1) / 2) / 2]),
        ("tanh", 1, [0.5]),
        ("ispline", 2, [0.75, 0.25]),
    ],
)
def test_functions_as_they_are_written(name: str, number: int, at_half: list[float]) -> None:
    np.testing.assert_allclose(monotone_basis({name: number}, 2, 5).values[2], at_half)


def test_logarithms_turn_exponentials_round() -> None:
    x = np.linspace(0, 1, 50)
    for place in range(4):
        risen = FAMILIES["exponential"](x, 4)[:, place]
        np.testing.assert_allclose(FAMILIES["logarithm"](risen, 4)[:, place], x, atol=1e-12)


@pytest.mark.parametrize("number", range(1, 9))
def test_a_straight_line_is_within_polynomials_and_splines(number: int) -> None:
    line = np.linspace(0, 29, 40)
    for name in ("polynomial", "ispline"):
        assert nnls(monotone_basis({name: number}, 30, 40).values, line)[1] < 1e-9


def test_a_basis_puts_the_constant_first_and_keeps_the_order() -> None:
    basis = monotone_basis({"tanh": 2, "constant": 1, "polynomial": 1}, 11, 6)
    assert basis.free == 1
    np.testing.assert_array_equal(basis.values[:, 0], 10)
    np.testing.assert_array_equal(basis.values[:, 1:3], monotone_basis({"tanh": 2}, 11, 6).values)
    np.testing.assert_allclose(basis.values[:, 3], np.linspace(0, 10, 6))


@given(
    frames=st.integers(2, 40),
    steps=st.integers(2, 50),
    seed=st.integers(0, 10_000),
    ends=st.sampled_from(["relaxed", "fixed"]),
    least_share=st.sampled_from([0.1, 0.5, 1.0]),
)
@settings(max_examples=80, deadline=None)
def test_weights_near_any_path_keep_to_their_limits(
    frames: int, steps: int, seed: int, ends: str, least_share: float
) -> None:
    path = np.sort(np.random.default_rng(seed).uniform(0, frames - 1, steps))
    basis = monotone_basis(USUAL_BASES, frames, steps)
    limits = weight_limits(basis, ends, least_share)
    weights = nearest_weights(basis, path, limits)
    assert (limits.rows @ weights <= limits.bounds + 1e-5 * frames).all()
    shown = basis.path(weights)
    assert (np.diff(shown) >= 0).all()
    assert shown[-1] - shown[0] >= least_share * (frames - 1) - 1e-5 * frames
    if ends == "fixed":
        np.testing.assert_allclose(shown[[0, -1]], [0, frames - 1], atol=1e-5 * frames)


def test_nearest_weights_find_a_path_of_the_basis_again() -> None:
    basis = monotone_basis({"constant": 1, "tanh": 3, "polynomial": 2}, 50, 60)
    weights = np.array([0.1, 0.2, 0.0, 0.3, 0.15, 0.05])
    found = nearest_weights(basis, basis.path(weights), weight_limits(basis))
    np.testing.assert_allclose(basis.path(found), basis.path(weights), atol=0.01)


@pytest.mark.parametrize(
    ("bases", "problem"),
    [
        ({"step": 2}, "no basis 'step'; there are 'constant', 'polynomial'"),
        ({"tanh": 0}, "0 functions are asked of basis 'tanh'"),
        ({"constant": 2, "tanh": 1}, "a second constant"),
        ({"constant": 1}, "no function that rises"),
        ({}, "no function that rises"),
    ],
)
def test_what_is_no_basis_is_refused(bases: dict[str, int], problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        monotone_basis(bases, 10, 12)


def test_limits_refuse_other_settings() -> None:
    basis = monotone_basis({"tanh": 2}, 10, 12)
    with pytest.raises(ValueError, match="ends is 'open'"):
        weight_limits(basis, "open")
    with pytest.raises(ValueError, match="least_share is 0"):
        weight_limits(basis, "relaxed", 0)
    for path in (np.zeros(5), np.full(12, 9.5), np.full(12, np.nan)):
        with pytest.raises(ValueError, match="it needs"):
            nearest_weights(basis, path, weight_limits(basis))
