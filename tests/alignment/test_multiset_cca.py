import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag, eigh
from sklearn.cross_decomposition import CCA

from motionary.pipeline.alignment.multiset_cca import embedding_trace, multiset_cca


def of_one_kind(seed: int, steps: int = 90, dofs: tuple[int, ...] = (3, 5, 2)) -> list[np.ndarray]:
    """Project two hidden signals into sequences of other dimensions and units, with noise and an offset."""
    rng = np.random.default_rng(seed)
    hidden = rng.normal(size=(steps, 2))
    return [
        (hidden @ rng.normal(size=(2, d)) + 0.2 * rng.normal(size=(steps, d)) + 7) * 10.0**place
        for place, d in enumerate(dofs)
    ]


def equation_8(sequences: list[np.ndarray], regularisation: float) -> tuple[np.ndarray, np.ndarray]:
    """Write down C and D, for sequences brought to the scale that the module names."""
    scaled = []
    for values in sequences:
        centred = values - values.mean(axis=0)
        scaled.append(centred / np.sqrt((centred**2).sum() / centred.shape[1]))
    own = block_diag(*(one.T @ one for one in scaled))
    joined = np.hstack(scaled)
    return joined.T @ joined - own, (1 - regularisation) * own + regularisation * np.eye(len(own))


@given(seed=st.integers(0, 10_000), regularisation=st.sampled_from([0.0, 0.1, 0.6, 1.0]))
@settings(max_examples=30, deadline=None)
def test_the_eigenvalues_are_those_of_equation_8(seed: int, regularisation: float) -> None:
    sequences = of_one_kind(seed)
    found = multiset_cca(sequences, regularisation)
    expected = eigh(*equation_8(sequences, regularisation), eigvals_only=True)[::-1]
    np.testing.assert_allclose(found.spectrum, expected, atol=1e-9)
    assert found.trace == pytest.approx(expected[: len(found.correlations)].sum())
    assert embedding_trace(sequences, found.projections, regularisation) == pytest.approx(found.trace)


@given(seed=st.integers(0, 10_000), regularisation=st.sampled_from([0.0, 0.3]))
@settings(max_examples=30, deadline=None)
def test_no_other_projections_have_a_greater_trace(seed: int, regularisation: float) -> None:
    sequences = of_one_kind(seed)
    found = multiset_cca(sequences, regularisation)
    rng = np.random.default_rng(seed + 1)
    for size in (0.01, 0.3, 3.0):
        others = [one + size * np.abs(one).max() * rng.normal(size=one.shape) for one in found.projections]
        assert embedding_trace(sequences, others, regularisation) <= found.trace + 1e-9


def test_projected_sequences_keep_to_the_constraint() -> None:
    sequences = of_one_kind(4)
    found = multiset_cca(sequences)
    projected = found.project(sequences)
    np.testing.assert_allclose(sum(one.T @ one for one in projected), np.eye(2), atol=1e-10)
    np.testing.assert_allclose(np.concatenate(projected, axis=1).mean(axis=0), 0, atol=1e-12)


def test_two_sequences_have_their_canonical_correlations() -> None:
    first, second = of_one_kind(1, dofs=(3, 4))
    found = multiset_cca([first, second], kept=1.0)
    scores = CCA(n_components=2, tol=1e-10, max_iter=5000).fit_transform(first, second)
    expected = [np.corrcoef(scores[0][:, k], scores[1][:, k])[0, 1] for k in range(2)]
    np.testing.assert_allclose(found.correlations[:2], expected, atol=1e-5)


def test_the_fewest_dimensions_are_kept_that_hold_the_share() -> None:
    sequences = of_one_kind(2)
    positive = np.maximum(multiset_cca(sequences).spectrum, 0)
    for kept in (0.1, 0.5, 0.9, 0.97, 1.0):
        size = len(multiset_cca(sequences, kept=kept).correlations)
        assert positive[:size].sum() >= kept * positive.sum() * (1 - 1e-9)
        assert size == 1 or positive[: size - 1].sum() < kept * positive.sum()
    assert len(multiset_cca(sequences).correlations) == 2


@pytest.mark.parametrize("regularisation", [0.0, 0.1])
def test_constant_and_collinear_dimensions_change_nothing(regularisation: float) -> None:
    sequences = of_one_kind(3)
    plain = multiset_cca(sequences, regularisation)
    first = sequences[0]
    constant = np.full((len(first), 1), 0.1)  # whose mean is rounded
    with_constant = multiset_cca([np.hstack([first, constant]), *sequences[1:]])
    np.testing.assert_allclose(with_constant.correlations, multiset_cca(sequences).correlations)
    collinear = multiset_cca([np.hstack([first, first @ np.ones((3, 2))]), *sequences[1:]], regularisation)
    assert np.isfinite(np.concatenate(collinear.projections)).all()
    if not regularisation:
        np.testing.assert_allclose(collinear.correlations, plain.correlations)
    np.testing.assert_array_equal(with_constant.projections[0][3], 0)


@pytest.mark.parametrize("regularisation", [1e-6, 0.1, 1.0])
def test_more_steps_than_dimensions_are_no_other_case(regularisation: float) -> None:
    # Dimensions of zeros leave the rest as it is, but for lambda's scale and the way that is taken to whiten.
    rng = np.random.default_rng(6)
    sequences = [rng.normal(size=(9, 4)).cumsum(axis=0) * np.geomspace(1, 1e-5, 4) for _ in range(3)]
    for padded in (4, 40):
        wide = [np.hstack([one, np.zeros((9, padded - 4))]) for one in sequences]
        spectrum = multiset_cca(wide, regularisation).spectrum
        expected = eigh(*equation_8(wide, regularisation), eigvals_only=True)[::-1]
        assert len(spectrum) == 12
        positive = spectrum > 1e-4
        np.testing.assert_allclose(spectrum[positive], expected[: positive.sum()], atol=1e-8)


def test_units_do_not_matter_and_signs_are_fixed() -> None:
    sequences = of_one_kind(5)
    found = multiset_cca(sequences, 0.2)
    in_other_units = multiset_cca([1000 * sequences[0], -sequences[1], sequences[2] + 3], 0.2)
    np.testing.assert_allclose(found.spectrum, in_other_units.spectrum)
    stacked = np.concatenate(found.projections)
    assert (stacked[np.abs(stacked).argmax(axis=0), range(stacked.shape[1])] > 0).all()


@pytest.mark.parametrize("regularisation", [0.0, 0.5])
def test_few_steps_give_numbers(regularisation: float) -> None:
    rng = np.random.default_rng(0)
    found = multiset_cca([rng.normal(size=(2, 4)), rng.normal(size=(2, 1))], regularisation)
    assert np.isfinite(found.spectrum).all()
    assert len(found.correlations) == 1


@pytest.mark.parametrize(
    ("sequences", "options", "problem"),
    [
        ([np.eye(3)], {}, "1 sequences"),
        ([np.eye(3), np.eye(4)], {}, "sequence 1 has 4 steps and sequence 0 3"),
        ([np.eye(3), np.full((3, 2), 0.1)], {}, "sequence 1 does not vary over its 3 steps"),
        ([np.ones((1, 2)), np.ones((1, 3))], {}, "sequence 0 does not vary"),
        ([np.eye(3), np.array([[1.0], [np.nan], [2.0]])], {}, "sequence 1 holds nan at frame 1, DOF 0"),
        ([np.eye(3), np.eye(3)], {"regularisation": 1.5}, "regularisation is 1.5"),
        ([np.eye(3), np.eye(3)], {"regularisation": np.nan}, "regularisation is nan"),
        ([np.eye(3), np.eye(3)], {"kept": 0.0}, "kept is 0.0"),
    ],
)
def test_what_cannot_be_correlated_is_refused(sequences: list, options: dict, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        multiset_cca(sequences, **options)
