"""The similarity index against eq. 9 as printed, and the choice of a reference."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import score_references, select_reference, similarity_index
from tests.alignment import naive


def family(count: int, frames: int, dofs: int, noise: float, seed: int = 0) -> np.ndarray:
    """Noisy copies of one motion, each DOF of each copy at its own scale and offset."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 1, frames)[:, None]
    motion = np.sin(2 * np.pi * (np.arange(1, dofs + 1) * time + rng.random(dofs)))
    copies = motion + noise * rng.normal(size=(count, frames, dofs))
    return copies * rng.uniform(0.5, 2, (count, 1, dofs)) + rng.normal(size=(count, 1, dofs))


@given(
    count=st.integers(1, 6),
    frames=st.integers(2, 9),
    dofs=st.integers(1, 4),
    seed=st.integers(0, 2**32 - 1),
    flags=st.tuples(st.booleans(), st.booleans()),
)
@settings(max_examples=80, deadline=None)
def test_index_is_equation_9(count: int, frames: int, dofs: int, seed: int, flags: tuple[bool, bool]) -> None:
    flat, weighted = flags
    rng = np.random.default_rng(seed)
    clips = rng.normal(size=(count, frames, dofs))
    if flat:
        clips[rng.integers(count), :, rng.integers(dofs)] = rng.normal()
    weights = rng.choice([0.0, 0.25, 1.0, 3.0], dofs) if weighted else None
    index = similarity_index(clips, weights)
    expected = naive.similarity_products(clips, weights)
    assert index.shape == (count,)
    for value, product in zip(index, expected, strict=True):
        assert value == pytest.approx(math.log(product), abs=1e-7) if product > 0 else value == -np.inf


def test_index_of_a_hand_made_set() -> None:
    """rho of (0, 1, 0, -1) with itself plus (1, 0, -1, 0) is 1/sqrt(2); of the two waves 0."""
    a, b = np.array([0.0, 1, 0, -1]), np.array([1.0, 0, -1, 0])
    clips = np.stack([a, a + b, b])[:, :, None]
    half = math.log(0.5)
    np.testing.assert_allclose(similarity_index(clips)[1], half)
    assert similarity_index(clips)[0] < -30  # the product of 1/sqrt(2) and 0 up to rounding
    np.testing.assert_allclose(similarity_index(np.repeat(clips, 2, axis=2), [3, 1])[1], half + math.log(4))


def test_index_of_five_hundred_clips_stays_finite() -> None:
    """The product itself, e to the -1000 and less, lies far under the least float."""
    clips = family(500, 40, 3, noise=2.0).astype(np.float32)
    index = similarity_index(clips)
    assert np.isfinite(index).all()
    assert index.max() < -750
    rho = np.array([np.corrcoef(clips[:, :, dof].astype(float)) for dof in range(3)])
    np.fill_diagonal(rho[0], 1), np.fill_diagonal(rho[1], 1), np.fill_diagonal(rho[2], 1)
    sums = np.log(np.abs(rho)).sum(axis=2)
    expected = sums.max(axis=0) + np.log(np.exp(sums - sums.max(axis=0)).sum(axis=0))
    np.testing.assert_allclose(index, expected, rtol=1e-9)


@pytest.mark.parametrize(("limit", "value"), [("_BLOCK", 5), ("_BLOCK_VALUES", 23 * 4), ("_BLOCK_VALUES", 1)])
def test_index_does_not_depend_on_blocks(monkeypatch: pytest.MonkeyPatch, limit: str, value: int) -> None:
    clips = family(23, 12, 2, noise=0.5)
    whole = similarity_index(clips)
    monkeypatch.setattr(f"motionary.pipeline.alignment.reference.{limit}", value)
    np.testing.assert_allclose(similarity_index(clips), whole, rtol=1e-12)
    lonely = np.stack([np.eye(23)[i][:, None] for i in range(23)])
    lonely[:, 0] = 0
    assert (select_reference(lonely), select_reference(lonely[::-1])) == (0, 22)  # the medoid


@pytest.mark.parametrize("level", [0.0, 0.1, 1e6])
def test_a_constant_dof_contributes_nothing(level: float) -> None:
    clips = family(5, 30, 3, noise=0.3)
    expected = similarity_index(clips[:, :, :2])
    clips[3, :, 2] = level
    np.testing.assert_array_equal(similarity_index(clips), expected)
    assert (similarity_index(clips, [0, 0, 1]) == -np.inf).all()
    assert (similarity_index(clips, [0, 0, 0]) == -np.inf).all()


def test_a_single_clip_is_its_own_reference() -> None:
    clips = family(1, 10, 2, noise=0.1)
    np.testing.assert_allclose(similarity_index(clips, [1, 3]), [math.log(4)])
    assert select_reference(list(clips)) == 0


def test_the_cleanest_clip_is_chosen() -> None:
    clips = family(12, 50, 4, noise=0.0)
    rng = np.random.default_rng(1)
    noisy = clips + 0.3 * rng.normal(size=clips.shape)
    for clean in (0, 7, 11):
        sequences = list(noisy)
        sequences[clean] = clips[clean]
        assert select_reference(sequences) == clean


def test_sequences_of_different_lengths_are_length_matched() -> None:
    """Lengths 31, 40 and 60: what is compared is 40 frames of each."""
    rng = np.random.default_rng(3)
    time = np.linspace(0, 1, 601)
    motion = np.stack([np.sin(7 * time), np.cos(11 * time)], axis=1)
    sequences = [motion[:: 600 // (n - 1)] for n in (31, 41, 61)]
    sequences[0] = sequences[0] + 0.2 * rng.normal(size=sequences[0].shape)
    sequences[1] = sequences[1] + 0.05 * rng.normal(size=sequences[1].shape)
    assert [len(s) for s in sequences] == [31, 41, 61]
    matched = np.array(
        [
            np.stack([naive.length_matched(column, 41) for column in naive.columns(s)], axis=1)
            for s in sequences
        ]
    )
    assert select_reference(sequences) == int(np.argmax(naive.similarity_products(matched))) == 2


def test_weights_choose_the_dof_that_counts() -> None:
    rng = np.random.default_rng(0)
    clips = family(6, 40, 2, noise=0.0) + 0.4 * rng.normal(size=(6, 40, 2))
    clean = family(6, 40, 2, noise=0.0)
    clips[2, :, 0], clips[4, :, 1] = clean[2, :, 0], clean[4, :, 1]
    assert select_reference(list(clips), [1, 0]) == 2
    assert select_reference(list(clips), [0, 1]) == 4


def test_scores_keep_every_index() -> None:
    clips = family(7, 20, 3, noise=0.4)
    scores = score_references(list(clips), [1, 2, 0])
    np.testing.assert_array_equal(scores.similarity, similarity_index(clips, [1, 2, 0]))
    assert scores.index == select_reference(list(clips), [1, 2, 0]) == int(np.argmax(scores.similarity))


def test_ties_go_to_the_lowest_place() -> None:
    clips = family(9, 33, 5, noise=0.4)
    assert select_reference([clips[0], clips[1]]) == 0
    assert select_reference([clips[1], clips[0]]) == 0
    best = select_reference(list(clips))
    others = np.delete(np.arange(9), best)
    for copies in range(2, 12):
        order = [*others[:5], *[best] * (copies - 1), *others[5:], best]
        assert select_reference(list(clips[order])) == 5


def test_the_medoid_where_nothing_correlates() -> None:
    flat = [np.full((n, 2), level) for n, level in [(10, 0.0), (12, 5.0), (9, 6.0), (10, 9.0)]]
    assert (
        select_reference(flat) == 1
    )  # sums of distances are proportional to 20, 10, 10, 16; the tie to the lowest
    distances = np.array([[0, 9, 1, 9], [9, 0, 1, 9], [1, 1, 0, 9], [9, 9, 9, 0.0]])
    assert select_reference(flat, distances=distances) == 2
    assert select_reference(list(family(4, 10, 2, 0.0)), weights=[0, 0]) == 0


def test_distances_count_only_where_nothing_correlates() -> None:
    clips = family(4, 40, 2, noise=0.5)
    distances = np.ones((4, 4)) - np.eye(4)
    for i in range(4):
        lure = distances.copy()
        lure[i] = 0
        assert select_reference(list(clips), distances=lure) == select_reference(list(clips))


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (([],), "no sequence"),
        (([np.zeros((3, 2)), np.zeros((3, 1))],), "sequence 1 has 1 DOFs and sequence 0 2"),
        (([np.zeros((3, 2)), np.zeros(3)],), "sequence 1 has shape"),
        (([np.array([[1.0], [np.nan]])],), "sequence 0 holds nan at frame 1"),
        (([np.zeros((3, 2))], [1.0]), "weights have shape"),
        (([np.zeros((3, 2))], None, np.zeros(1)), r"distances have shape \(1,\).*\(1, 1\)"),
        (([np.zeros((3, 2))], None, np.full((1, 1), np.nan)), "distances hold a value"),
    ],
)
def test_what_is_no_set_of_sequences_is_refused(arguments: tuple, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        select_reference(*arguments)


def test_index_refuses_what_is_no_stack() -> None:
    with pytest.raises(ValueError, match="clips, frames, dofs"):
        similarity_index(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="clip 1 holds inf at frame 0, DOF 1"):
        similarity_index(np.array([[[0.0, 0.0]], [[0.0, np.inf]]]))
