"""Takes for telling styles apart, and the study that does it."""

import io
from collections import Counter
from contextlib import contextmanager

import numpy as np
import pytest
from rich.console import Console

from motionary.pipeline.synthetic import BODIES, STYLES, style_takes, template, template_frames
from motionary.workflows.reproduce.style import METHODS, StyleStudy, study_style, style_report

SOME_ACTIONS = ("walk", "jump", "throw")


def test_every_body_does_every_style_twice():
    takes = style_takes("kick")
    assert len(takes) == 50
    assert set(Counter((one.style, one.subject) for one in takes).values()) == {2}
    assert {one.style for one in takes} == set(STYLES)
    assert {one.subject for one in takes} == set(BODIES)
    assert {one.motion.fps for one in takes} == {30.0}
    assert len({one.motion.skeleton.names for one in takes}) == 1
    assert not any(one.is_mirrored for one in takes)
    assert len({one.motion.name for one in takes}) == 50


@pytest.mark.parametrize("action", ["walk", "punch"])
def test_warps_are_known_and_begin_together(action):
    for one in style_takes(action, seed=1, takes=2):
        assert one.warp.shape == (one.motion.frames,)
        assert one.warp[0] == 0
        assert (np.diff(one.warp) > 0).all()
        assert one.warp[-1] <= template_frames(action) - 1 + 1e-9
    ends = {round(float(one.warp[-1]), 6) for one in style_takes(action, takes=2)}
    assert len(ends) == 1


def test_takes_are_seeded_and_varied():
    first, again, other = (style_takes("wave", seed, takes=1)[3] for seed in (4, 4, 5))
    assert first.motion.rotations.tolist() == again.motion.rotations.tolist()
    assert first.motion.frames != other.motion.frames or not np.array_equal(
        first.motion.rotations, other.motion.rotations
    )


def test_a_style_of_no_strength_is_nearly_neutral():
    def bent(strength: float) -> float:
        """How much further a sneaky elbow is bent than the template's, on average, radians."""
        take = next(one for one in style_takes("walk", takes=5, strength=strength) if one.style == "sneaky")
        shown = template("walk").sampled(take.warp)
        elbow = take.motion.skeleton.index("LeftForeArm")
        agree = np.abs(np.sum(take.motion.rotations[:, elbow] * shown.rotations[:, elbow], axis=1))
        return float(2 * np.arccos(np.clip(agree, 0, 1)).mean())

    assert bent(0.0) < bent(0.5) < bent(1.0)
    assert bent(0.0) < 0.3 * bent(1.0)


def test_what_cannot_be_performed():
    with pytest.raises(ValueError, match="no action 'dance'"):
        style_takes("dance")
    with pytest.raises(ValueError, match="takes is 0"):
        style_takes("walk", takes=0)
    with pytest.raises(ValueError, match="strength is 2"):
        style_takes("walk", strength=2)


@contextmanager
def counted(steps: dict):
    done = []
    yield done.append
    assert Counter(done) == steps


@pytest.fixture(scope="module")
def study() -> StyleStudy:
    return study_style(counted, actions=SOME_ACTIONS, methods=("UTW", "CoTW", "known warp"), strengths=(0.5,))


@pytest.mark.slow
def test_styles_are_predicted_better_after_cotw_than_after_utw(study):
    utw, cotw, known = (study.mean(0.5, one).value for one in ("UTW", "CoTW", "known warp"))
    assert utw < cotw
    assert utw < known
    assert 0.2 < utw  # chance
    difference = study.mean(0.5, "CoTW", minus="UTW")
    assert difference.value == pytest.approx(cotw - utw)
    assert difference.value > 0.02


@pytest.mark.slow
def test_so_they_are_over_all_actions_and_at_full_strength():
    whole = study_style(counted, methods=("UTW", "CoTW"))
    for strength in (1.0, 0.5):
        assert whole.mean(strength, "CoTW", minus="UTW").value > 0


@pytest.mark.slow
def test_the_study_as_a_table_and_as_a_report(study):
    rows = study.to_arrow().to_pylist()
    assert len(rows) == 3 * 3
    assert {row["takes"] for row in rows} == {50}
    assert {row["reference"].split("_")[0] for row in rows} == set(SOME_ACTIONS)
    by_method = [row["accuracy"] for row in rows if row["method"] == "CoTW"]
    assert np.mean(by_method) == pytest.approx(study.mean(0.5, "CoTW").value)
    shown = io.StringIO()
    Console(file=shown, width=200).print(style_report(study))
    text = shown.getvalue()
    assert "10 takes of each of 3 actions in 5 styles, seed 0" in text
    assert "CoTW minus UTW" in text
    assert f"{study.mean(0.5, 'CoTW', minus='UTW').value:+.2f}" in text
    for action in SOME_ACTIONS:
        assert f"\n{action} " in text


def test_every_method_is_studied_and_a_study_repeats_itself():
    asked = {"takes": 5, "actions": ("punch",), "strengths": (1.0,)}
    one = study_style(counted, **asked)
    assert [method for _, _, method in one.accuracy] == list(METHODS)
    assert set(one.accuracy.values()) <= {count / 25 for count in range(26)}
    again = study_style(counted, **asked, methods=("UTW",))
    assert again.accuracy.items() <= one.accuracy.items()
