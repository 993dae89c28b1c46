"""Foot sliding: known speeds, made-up takes that do not slide, and real clips."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from motionary.pipeline.readers import read_motion
from motionary.pipeline.style import fastest_joint, foot_sliding, standing_toes
from motionary.pipeline.style.root_motion import features_by_frame
from motionary.pipeline.synthetic import BODIES, synthetic_library, template
from tests.style.figures import moved, performed


def test_a_standing_figure_that_is_pulled_along_slides_at_that_speed():
    still = performed("wave", body="bea", frames=61)
    assert foot_sliding(still) < 1e-3
    along = np.linspace(0, 40, 61)  # centimetres, in two seconds
    pulled = replace(still, root_position=still.root_position + np.multiply.outer(along, [0.6, 0.0, 0.8]))
    assert foot_sliding(pulled) == pytest.approx(20.0, rel=1e-5)
    assert foot_sliding(moved(pulled, 1.2, (100, 30, -5))) == pytest.approx(20.0, rel=1e-5)
    # Half as many frames, each twice as far: the same speed.
    fewer = replace(
        pulled, fps=15.0, root_position=pulled.root_position[::2], rotations=pulled.rotations[::2]
    )
    assert foot_sliding(fewer) == pytest.approx(20.0, rel=1e-5)
    # Without a unit the leg counts as .90 m long.
    unknown = replace(pulled, unit=None)
    assert foot_sliding(unknown) == pytest.approx(20.0 * 0.90 / BODIES["bea"].leg, rel=1e-5)


def test_against_a_frame_at_a_time():
    motion = performed("run", "tired", "chidi", frames=70)
    toes = [motion.positions()[:, motion.skeleton.index(f"{side}ToeBase")] for side in ("Left", "Right")]
    lower = [min(range(2), key=lambda side, k=k: toes[side][k, 1]) for k in range(70)]
    heights = sorted(toes[lower[k]][k, 1] for k in range(70))
    place = 0.02 * 69
    floor = heights[int(place)] + (place % 1) * (heights[int(place) + 1] - heights[int(place)])
    limit = floor + 2.5 / 0.90 * BODIES["chidi"].leg
    speeds = []
    for k in range(69):
        one = lower[k]
        if one == lower[k + 1] and max(toes[one][k, 1], toes[one][k + 1, 1]) <= limit:
            step = toes[one][k + 1] - toes[one][k]
            speeds.append(math.hypot(step[0], step[2]) * 30)
    assert 5 < len(speeds) < 60
    assert foot_sliding(motion) == pytest.approx(np.mean(speeds), rel=1e-9)


def test_takes_whose_feet_stand_still_do_not_slide():
    for take in synthetic_library():
        limit = 4.0 if take.action in ("run", "jump") else 0.1
        assert foot_sliding(take.motion) < limit, take.path


def test_nothing_slides_where_nothing_stands():
    motion = performed("wave", frames=2)
    assert (
        foot_sliding(replace(motion, root_position=motion.root_position[:1], rotations=motion.rotations[:1]))
        == 0
    )
    flying = motion.root_position + [[0, 0, 0], [50, 100, 0]]
    assert foot_sliding(replace(motion, root_position=flying)) == 0


def test_standing_toes_against_a_frame_at_a_time():
    motion = performed("run", "tired", "chidi", frames=70)
    toes = [motion.positions()[:, motion.skeleton.index(f"{side}ToeBase")] for side in ("Left", "Right")]
    leg = features_by_frame(motion).leg_length
    limit = np.percentile([min(toes[0][k, 1], toes[1][k, 1]) for k in range(70)], 2) + 2.5 / 90 * leg
    expected = np.zeros((70, 2), bool)
    for side, toe in enumerate(toes):
        for k in range(70):
            before, after = max(k - 1, 0), min(k + 1, 69)
            speed = math.dist(toe[after], toe[before]) / (after - before) * motion.fps
            expected[k, side] = toe[k, 1] <= limit and speed <= 0.6 * leg
    found = standing_toes(motion)
    np.testing.assert_array_equal(found, expected)
    assert (0.05 < found.mean(axis=0)).all()
    assert (found.mean(axis=0) < 0.95).all()


def test_a_low_toe_that_slides_does_not_stand():
    still = performed("wave", body="bea", frames=61)
    assert standing_toes(still).all()
    leg = features_by_frame(still).leg_length
    for speed, stands in ((0.5, True), (0.7, False)):  # leg lengths a second
        along = np.multiply.outer(np.arange(61) / 30 * speed * leg, [0.6, 0.0, 0.8])
        found = standing_toes(replace(still, root_position=still.root_position + along))
        assert (found == stands).all()


def test_toes_of_a_single_frame_stand_where_they_are_low():
    one = performed("wave", frames=2).sampled([0.0])
    assert standing_toes(one).tolist() == [[True, True]]


def test_real_walkers_slide_a_little(shared_data: Path):
    clips = sorted((shared_data / "bandai").glob("dataset-1_walk_*.bvh"))[:6]
    found = [foot_sliding(read_motion(path)) for path in clips]
    assert 0 < min(found)
    assert max(found) < 20


def test_the_fastest_joint_is_told_in_leg_lengths():
    take = template("kick")
    leg = features_by_frame(take, ()).leg_length
    places = take.positions()
    by_hand = max(
        np.linalg.norm(places[frame + 1, joint] - places[frame, joint])
        for frame in range(take.frames - 1)
        for joint in range(places.shape[1])
    )
    assert fastest_joint(take) == pytest.approx(by_hand * take.fps / leg)
    assert fastest_joint(take.sampled([0.0])) == 0.0
