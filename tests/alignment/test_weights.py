import numpy as np
import pytest

from motionary.pipeline.alignment import PRESETS, joint_weights
from motionary.pipeline.alignment.weights import varying_dofs

JOINTS = (
    "pelvis spine chest neck head "
    "left_shoulder left_elbow left_wrist right_shoulder right_elbow right_wrist "
    "left_hip left_knee left_ankle left_toe right_hip right_knee right_ankle right_toe"
).split()


def by_joint(weights: np.ndarray) -> dict[str, float]:
    columns = weights.reshape(19, 3)
    assert (columns == columns[:, :1]).all()
    return dict(zip(JOINTS, columns[:, 0].tolist(), strict=True))


def test_presets_are_the_columns_of_table_2() -> None:
    legs, arms = by_joint(joint_weights("legs")), by_joint(joint_weights("arms"))
    assert set(PRESETS) == {"full", "legs", "arms"}
    assert (joint_weights("full") == np.ones(57)).all()
    for joint in JOINTS:
        leg = joint == "pelvis" or joint.endswith(("hip", "knee", "ankle", "toe"))
        arm = (
            1.0
            if joint.endswith(("shoulder", "elbow", "wrist"))
            else 0.5
            if joint in ("spine", "chest")
            else 0.0
        )
        assert (legs[joint], arms[joint]) == (float(leg), arm)


def test_a_name_without_its_side_means_both() -> None:
    weights = by_joint(joint_weights({"knee": 2, "left_wrist": 0.5}))
    assert {joint: weight for joint, weight in weights.items() if weight} == {
        "left_knee": 2,
        "right_knee": 2,
        "left_wrist": 0.5,
    }


def test_a_name_with_its_side_goes_before() -> None:
    for mapping in ({"toe": 1, "left_toe": 0}, {"left_toe": 0, "toe": 1}):
        weights = by_joint(joint_weights(mapping))
        assert (weights["left_toe"], weights["right_toe"]) == (0, 1)


def test_any_joints_and_columns() -> None:
    np.testing.assert_array_equal(joint_weights({"hip": 3}, ["left_hip", "tail"], 2), [3, 3, 0, 0])


@pytest.mark.parametrize(
    ("weights", "problem"),
    [
        ("hands", "no preset 'hands'; there are full, legs, arms"),
        ({"thigh": 1}, "no joint 'thigh' to weigh; there are pelvis, spine, .*toe"),
        ({"left_pelvis": 1}, "no joint 'left_pelvis'"),
        ({"knee": -1}, "joint 'knee' has weight -1"),
        ({"knee": float("nan")}, "joint 'knee' has weight nan"),
    ],
)
def test_unknown_names_and_weights_are_refused(weights: object, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        joint_weights(weights)


def test_what_moves_in_no_sequence_weighs_nothing() -> None:
    still, left, right = np.full((4, 3), 0.1), np.eye(3), np.diag([0.0, 0.0, 2.0])
    right[:, 0] = 5.0
    assert varying_dofs([still, left[:, [0, 0, 0]] * [1, 0, 0]]).tolist() == [1, 0, 0]
    assert varying_dofs([right, left * [1, 0, 0]]).tolist() == [1, 0, 1]
    assert varying_dofs([still]).tolist() == [0, 0, 0]
