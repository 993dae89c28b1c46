import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionary.pipeline.alignment import Warp
from motionary.pipeline.alignment.composed import in_time_of


@st.composite
def shared_steps(draw) -> list[Warp]:
    """Warps of some sequences over common steps, with stays and ends that are left out."""
    steps = draw(st.integers(1, 25))
    warps = []
    for _ in range(draw(st.integers(1, 4))):
        frames = draw(st.integers(1, 20))
        times = draw(st.lists(st.integers(0, 2 * (frames - 1)), min_size=steps, max_size=steps))
        warps.append(Warp(np.sort(np.array(times)) / 2, frames))
    return warps


def passing_time(path: np.ndarray, frame: float) -> float:
    """Walk along a path to the middle of the steps at which it shows a frame, held at its ends."""
    frame = min(max(frame, path[0]), path[-1])
    meeting = [step for step, shown in enumerate(path) if shown == frame]
    if meeting:
        return (meeting[0] + meeting[-1]) / 2
    after = next(step for step, shown in enumerate(path) if shown > frame)
    before = after - 1
    return before + (frame - path[before]) / (path[after] - path[before])


@given(warps=shared_steps(), data=st.data())
@settings(max_examples=150, deadline=None)
def test_other_paths_are_read_where_the_references_passes(warps: list[Warp], data: st.DataObject) -> None:
    reference = data.draw(st.integers(0, len(warps) - 1))
    found = in_time_of(warps, reference)
    own = warps[reference].source_time
    for warp, composed in zip(warps, found, strict=True):
        steps = [passing_time(own, frame) for frame in range(warps[reference].moving_frames)]
        expected = np.interp(steps, np.arange(len(own)), warp.source_time)
        np.testing.assert_allclose(composed.source_time, expected, atol=1e-9)
        assert composed.moving_frames == warp.moving_frames
    frames = np.arange(warps[reference].moving_frames)
    np.testing.assert_allclose(found[reference].source_time, np.clip(frames, own[0], own[-1]), atol=1e-9)


def test_a_stay_counts_by_its_middle_and_ends_are_held() -> None:
    reference, other = Warp([1, 2, 2, 2, 3], 6), Warp([0, 10, 20, 30, 40], 41)
    composed = in_time_of([other, reference], 1)[0]
    assert composed.source_time.tolist() == [0, 0, 20, 40, 40, 40]


def test_what_does_not_share_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="warp 1 has 3 steps and warp 0 2"):
        in_time_of([Warp([0, 1], 2), Warp([0, 1, 1], 2)], 0)
    for reference in (-1, 2):
        with pytest.raises(ValueError, match=f"reference is {reference}; there are 2 warps"):
            in_time_of([Warp([0, 1], 2), Warp([0, 1], 2)], reference)
