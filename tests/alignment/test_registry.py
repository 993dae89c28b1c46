"""What every aligner of the registry must do, whatever it is."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionary.pipeline.alignment import Warp
from motionary.pipeline.alignment.registry import ALIGNERS, Aligner

EVERY = pytest.mark.parametrize("aligner", ALIGNERS.values(), ids=ALIGNERS)
VECTORS = pytest.mark.parametrize(
    "aligner", [one for one in ALIGNERS.values() if one.reads != "rotations"], ids=lambda one: one.name
)
Wave = Callable[[np.ndarray], np.ndarray]


def sequence(aligner: Aligner, times: np.ndarray) -> np.ndarray:
    """A smooth motion that never repeats a pose, seen at some times from 0 to 1, as the aligner reads it."""
    turns = np.stack([np.sin((2 + k) * times + k) + (1 + k) * times for k in range(6)], axis=1)
    if aligner.reads != "rotations":
        return turns
    vectors = turns.reshape(len(times), 2, 3) / 4
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat().reshape(len(times), 2, 4)


def at_rest(aligner: Aligner, frames: int) -> np.ndarray:
    return sequence(aligner, np.full(frames, 0.4))


@EVERY
def test_a_sequence_is_itself_in_its_own_time(aligner: Aligner) -> None:
    values = sequence(aligner, np.linspace(0, 1, 40))
    np.testing.assert_allclose(aligner.align(values, values.copy()).source_time, np.arange(40), atol=0.5)


@EVERY
def test_a_warp_has_a_time_for_every_reference_frame_and_is_the_same_again(aligner: Aligner) -> None:
    even = np.linspace(0, 1, 45)
    moving, reference = sequence(aligner, even**1.3), sequence(aligner, np.linspace(0, 1, 38))
    given = moving.copy(), reference.copy()
    warp = aligner.align(moving, reference)
    assert isinstance(warp, Warp)
    assert (warp.reference_frames, warp.moving_frames) == (38, 45)
    np.testing.assert_array_equal(warp.source_time, aligner.align(moving, reference).source_time)
    np.testing.assert_array_equal(moving, given[0])
    np.testing.assert_array_equal(reference, given[1])


@EVERY
@pytest.mark.parametrize("frames", [(1, 1), (1, 30), (30, 1), (2, 2), (2, 30), (30, 2), (3, 5)])
def test_few_frames_give_a_result_or_one_clear_error(aligner: Aligner, frames: tuple[int, int]) -> None:
    moving, reference = (sequence(aligner, np.linspace(0, 1, one)) for one in frames)
    given_or_refused(aligner, moving, reference)


@EVERY
@pytest.mark.parametrize("still", ["moving", "reference", "both"])
def test_what_does_not_move_gives_a_result_or_one_clear_error(aligner: Aligner, still: str) -> None:
    moving, reference = sequence(aligner, np.linspace(0, 1, 30)), sequence(aligner, np.linspace(0, 1, 24))
    given_or_refused(
        aligner,
        at_rest(aligner, 30) if still != "reference" else moving,
        at_rest(aligner, 24) if still != "moving" else reference,
    )


@VECTORS
@pytest.mark.parametrize("kind", ["constant channel", "collinear", "one dimension", "more DOFs than frames"])
def test_ranks_that_lack_give_a_result_or_one_clear_error(aligner: Aligner, kind: str) -> None:
    moving, reference = sequence(aligner, np.linspace(0, 1, 30)), sequence(aligner, np.linspace(0, 1, 24))
    change: Wave = {
        "constant channel": lambda values: values * [1, 0, 1, 1, 1, 1] + [0, 5, 0, 0, 0, 0],
        "collinear": lambda values: values[:, :1] * np.arange(1.0, 7.0),
        "one dimension": lambda values: values[:, :1],
        "more DOFs than frames": lambda values: np.tile(values, (1, 8)),
    }[kind]
    given_or_refused(aligner, change(moving), change(reference))


@EVERY
@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_the_unit_does_not_matter(aligner: Aligner, size: float) -> None:
    if aligner.reads == "rotations":
        pytest.skip("quaternions have no unit")
    moving = sequence(aligner, np.linspace(0, 1, 30) ** 1.2)
    reference = sequence(aligner, np.linspace(0, 1, 24))
    here, there = aligner.align(moving, reference), aligner.align(moving * size, reference * size)
    np.testing.assert_allclose(here.source_time, there.source_time, atol=0.5)


@EVERY
@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["moving", "reference"])
def test_what_is_not_finite_is_refused_by_its_place(aligner: Aligner, bad: float, name: str) -> None:
    pair = {one: sequence(aligner, np.linspace(0, 1, 20)) for one in ("moving", "reference")}
    pair[name][7, 1] = bad
    with pytest.raises(ValueError, match=f"{name}.*frame 7"):
        aligner.align(**pair)


@EVERY
def test_other_dofs_are_taken_or_refused_as_said(aligner: Aligner) -> None:
    moving, reference = sequence(aligner, np.linspace(0, 1, 30)), sequence(aligner, np.linspace(0, 1, 24))
    fewer = reference[:, :1] if aligner.reads == "rotations" else reference[:, :4]
    if aligner.other_dofs:
        assert aligner.align(moving, fewer).reference_frames == 24
    else:
        with pytest.raises(ValueError, match="reference"):
            aligner.align(moving, fewer)


@EVERY
@pytest.mark.parametrize("shape", [(0, 6), (30,), (30, 0)])
def test_what_is_no_sequence_is_refused(aligner: Aligner, shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="shape"):
        aligner.align(np.zeros(shape), sequence(aligner, np.linspace(0, 1, 24)))


def given_or_refused(aligner: Aligner, moving: np.ndarray, reference: np.ndarray) -> None:
    """A warp of finite times, which `Warp` itself sees to, or a ValueError that says what lacks."""
    try:
        warp = aligner.align(moving, reference)
    except ValueError as error:
        assert re.search(r"moving|reference|sequence|frames", str(error))  # noqa: PT017
    else:
        assert (warp.reference_frames, warp.moving_frames) == (len(reference), len(moving))


def test_names_and_titles_are_told_apart() -> None:
    assert len({one.title for one in ALIGNERS.values()}) == len(ALIGNERS)
    assert all(name == one.name for name, one in ALIGNERS.items())
