"""Which parts of the body an alignment attends to [CoTW Table 2].

The paper weighs the angles of bones; we compare the positions of joints. An angle shows in the joint at the
far end of the bone that it turns, so a joint takes the weight of that bone:

=================  ==================================================================
pelvis             Global displacement (Global orientation has no position of its own)
spine, chest       Spine
neck, head         Neck, Head
shoulder           Shoulders (the clavicles)
elbow, wrist       Arms (upper and lower)
hip                Hips (pelvis to hip joint)
knee               Thighs
ankle              Legs (the shanks)
toe                Feet
=================  ==================================================================

Hands, Fingers and Toes turn what lies beyond the canonical wrists and toes, and have no joint to weigh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from motionary.pipeline.canonical import CANONICAL_JOINTS
from motionary.pipeline.motion import FloatArray

_ARMS = ("shoulder", "elbow", "wrist")
_LEGS = ("hip", "knee", "ankle", "toe")

PRESETS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "full": MappingProxyType(dict.fromkeys(CANONICAL_JOINTS, 1.0)),
        "legs": MappingProxyType(dict.fromkeys(("pelvis", *_LEGS), 1.0)),
        "arms": MappingProxyType({"spine": 0.5, "chest": 0.5} | dict.fromkeys(_ARMS, 1.0)),
    }
)
"""Table 2's columns; joints that are not named weigh 0."""


def joint_weights(
    weights: str | Mapping[str, float],
    joints: Sequence[str] = CANONICAL_JOINTS,
    dofs_per_joint: int = 3,
) -> FloatArray:
    """Turn weights by joint into weights by DOF.

    Parameters
    ----------
    weights : {"full", "legs", "arms"} or mapping
        A preset, or joint name -> weight. A name without its side ("knee") means both sides; a name with
        its side goes before it. Joints that are not named weigh 0.
    joints : sequence of str
        The joints in the order of the columns; by default the canonical joints of a pose.
    dofs_per_joint : int
        Neighbouring columns of one joint.

    Returns
    -------
    array (len(joints) * dofs_per_joint,) float64
        57 for the canonical joints.

    Raises
    ------
    ValueError
        A preset or a joint is unknown, or a weight is negative or not finite.
    """
    if isinstance(weights, str):
        if weights not in PRESETS:
            raise ValueError(f"no preset {weights!r}; there are {', '.join(PRESETS)}")
        weights = PRESETS[weights]
    sided = {joint: joint.removeprefix("left_").removeprefix("right_") for joint in joints}
    known = {*sided, *sided.values()}
    for name, weight in weights.items():
        if name not in known:
            raise ValueError(
                f"no joint {name!r} to weigh; there are {', '.join(dict.fromkeys(sided.values()))}"
            )
        if not 0 <= weight < np.inf:
            raise ValueError(f"joint {name!r} has weight {weight}; weights must be finite and not negative")
    by_joint = [weights.get(joint, weights.get(sided[joint], 0.0)) for joint in joints]
    return np.repeat(np.asarray(by_joint, dtype=np.float64), dofs_per_joint)
