"""From an action's channels to a posed body: how every segment is turned in the world.

An action is written in channels that do not depend on the body: places in leg lengths, angles in degrees.
The trunk and the arms are posed forwards, segment by segment; the legs backwards, by two-bone inverse
kinematics from the hip to the ankle that the foot's channels ask for, so a planted foot stays planted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic.bodies import SIDES, SIGN, TOE_HEIGHT, Body

STANDING_HEIGHT = 0.985
"""Height of the hips over the ankles, in leg lengths, with the knees not quite straight."""


@dataclass
class Channels:
    """An action over F frames, free of any body: what a choreographer would write down.

    Parameters
    ----------
    pelvis : array (F, 3)
        Leg lengths: to the left, height of the hips over the standing ankle, forward.
    pelvis_turn, chest_turn, head_turn : array (F, 3)
        Degrees: to the left, forward, to the right (about +Y, +X, +Z in that order); the chest relative to
        the pelvis, the head relative to the direction of the action.
    arms : array (F, 2, 4)
        Degrees, left and right: flexion (0 hangs, 90 points forward), abduction, inward twist, elbow.
    feet : array (F, 2, 3)
        Ball of the foot in leg lengths from where it stands at rest: outward, up, forward.
    foot_turn : array (F, 2, 2)
        Degrees: outward, and heel up.
    """

    pelvis: FloatArray
    pelvis_turn: FloatArray
    chest_turn: FloatArray
    head_turn: FloatArray
    arms: FloatArray
    feet: FloatArray
    foot_turn: FloatArray


@dataclass(frozen=True, eq=False)
class Posture:
    """A posed body over F frames.

    Parameters
    ----------
    pelvis : array (F, 3)
        Metres, Y up, the floor at 0.
    turns : dict of str to array (F, 3, 3)
        Rotation of every segment from the T-pose into the world.
    """

    pelvis: FloatArray
    turns: dict[str, FloatArray]


def standing(frames: int) -> Channels:
    """Stand upright with hanging arms, feet a hip's width apart, for an action to depart from."""
    channels = Channels(
        pelvis=np.zeros((frames, 3)),
        pelvis_turn=np.zeros((frames, 3)),
        chest_turn=np.zeros((frames, 3)),
        head_turn=np.zeros((frames, 3)),
        arms=np.zeros((frames, 2, 4)) + (2.0, 8.0, 15.0, 14.0),
        feet=np.zeros((frames, 2, 3)),
        foot_turn=np.zeros((frames, 2, 2)) + (7.0, 0.0),
    )
    channels.pelvis[:, 1] = STANDING_HEIGHT
    return channels


def pose(channels: Channels, body: Body) -> Posture:
    """Pose a body by an action's channels.

    Parameters
    ----------
    channels : Channels
        F frames.
    body : Body
        Whose lengths turn leg lengths into metres.

    Returns
    -------
    Posture
        F frames, standing on the floor y = 0 and acting towards +Z.
    """
    landmarks = body.landmarks()
    rest_height = -landmarks["left_toe"][1] + TOE_HEIGHT - body.leg
    pelvis = channels.pelvis * body.leg + (0.0, rest_height, 0.0)
    turns = _trunk(channels)
    for index, side in enumerate(SIDES):
        turns |= _arm(turns["thorax"], channels.arms[:, index], side)
        turns |= _leg(
            pelvis, turns["pelvis"], channels.feet[:, index], channels.foot_turn[:, index], side, body
        )
    return Posture(pelvis, turns)


def mirrored(posture: Posture) -> Posture:
    """Swap left and right across the plane x = 0."""
    flip = np.array([-1.0, 1.0, 1.0])
    other = {"left": "right", "right": "left"}
    turns = {}
    for segment, turn in posture.turns.items():
        side, _, name = segment.partition("_")
        turns[f"{other[side]}_{name}" if side in other else segment] = turn * np.outer(flip, flip)
    return Posture(posture.pelvis * flip, turns)


def placed(posture: Posture, heading: float, place: tuple[float, float]) -> Posture:
    """Turn the action by `heading` radians to the left and begin it at `place`, metres along X and Z."""
    turn = Rotation.from_rotvec([0.0, heading, 0.0]).as_matrix()
    origin = posture.pelvis[0] * (1.0, 0.0, 1.0)
    pelvis = (posture.pelvis - origin) @ turn.T + (place[0], 0.0, place[1])
    return Posture(pelvis, {segment: turn @ matrix for segment, matrix in posture.turns.items()})


def _turn(angles: FloatArray) -> FloatArray:
    return Rotation.from_euler("YXZ", angles, degrees=True).as_matrix()


def _about(axis: str, degrees: FloatArray) -> FloatArray:
    return Rotation.from_euler(axis, degrees[:, None], degrees=True).as_matrix()


def _trunk(channels: Channels) -> dict[str, FloatArray]:
    pelvis = _turn(channels.pelvis_turn)
    thorax = pelvis @ _turn(channels.chest_turn)
    head = _turn(channels.head_turn)
    return {
        "pelvis": pelvis,
        "waist": pelvis @ _turn(channels.chest_turn / 3),
        "lumbar": pelvis @ _turn(channels.chest_turn * 2 / 3),
        "thorax": thorax,
        "neck": _halfway(thorax, head),
        "head": head,
    }


def _halfway(first: FloatArray, second: FloatArray) -> FloatArray:
    between = Rotation.from_matrix(np.swapaxes(first, 1, 2) @ second).as_rotvec()
    return first @ Rotation.from_rotvec(between / 2).as_matrix()


def _arm(thorax: FloatArray, angles: FloatArray, side: str) -> dict[str, FloatArray]:
    sign = SIGN[side]
    flexion, abduction, twist, elbow = angles.T
    # A quarter turn about Z brings the T-pose's arm down to hang; a raised arm lifts the clavicle a little.
    raised = np.sqrt(flexion**2 + abduction**2 + 100.0)
    clavicle = thorax @ _about("z", sign * 0.08 * raised)
    hang = _about("z", sign * (abduction - 90.0))
    upper_arm = thorax @ _about("x", -flexion) @ hang @ _about("x", twist)
    forearm = upper_arm @ _about("y", -sign * elbow)
    turns = {"clavicle": clavicle, "upper_arm": upper_arm, "forearm": forearm, "hand": forearm}
    return {f"{side}_{name}": turn for name, turn in turns.items()}


def _leg(
    pelvis: FloatArray, pelvis_turn: FloatArray, ball: FloatArray, turn: FloatArray, side: str, body: Body
) -> dict[str, FloatArray]:
    sign, landmarks = SIGN[side], body.landmarks()
    hip = pelvis + pelvis_turn @ landmarks[f"{side}_hip"]
    outward, heel_up = turn.T
    yaw = _about("y", sign * outward)
    foot = yaw @ _about("x", heel_up)
    rest_ball = np.array([sign * body.hip_width / 2, TOE_HEIGHT, body.foot])
    ankle_to_ball = landmarks[f"{side}_toe"] - landmarks[f"{side}_ankle"]
    ankle = rest_ball + ball * body.leg * (sign, 1.0, 1.0) - foot @ ankle_to_ball
    hinge = (pelvis_turn @ _about("y", 0.6 * sign * outward))[:, :, 0]
    thigh, shank = _two_bones(hip, ankle, hinge, body)
    # The toes lie flat on the floor and along the foot in the air.
    lift = np.clip(ball[:, 1], 0, None)
    toes = yaw @ _about("x", heel_up * lift / (lift + 0.05))
    turns = {"thigh": thigh, "shank": shank, "foot": foot, "toes": toes}
    return {f"{side}_{name}": turn for name, turn in turns.items()}


def _two_bones(
    hip: FloatArray, ankle: FloatArray, hinge: FloatArray, body: Body
) -> tuple[FloatArray, FloatArray]:
    """Bend the knee about the axis `hinge` so that the ankle is met: the law of cosines."""
    line = ankle - hip
    length = np.linalg.norm(line, axis=1)
    reach = _soft_limit(length / body.leg) * body.leg
    axis_x = hinge - line * (np.sum(hinge * line, axis=1) / length**2)[:, None]
    axis_x /= np.linalg.norm(axis_x, axis=1, keepdims=True)
    cosine_hip = (body.thigh**2 + reach**2 - body.shank**2) / (2 * body.thigh * reach)
    cosine_ankle = (body.shank**2 + reach**2 - body.thigh**2) / (2 * body.shank * reach)
    axis_y = -line / length[:, None]
    straight = np.stack([axis_x, axis_y, np.cross(axis_x, axis_y)], axis=2)
    thigh = straight @ _about("x", -np.degrees(np.arccos(cosine_hip)))
    shank = straight @ _about("x", np.degrees(np.arccos(cosine_ankle)))
    return thigh, shank


def _soft_limit(reach: FloatArray) -> FloatArray:
    """Keep a leg's reach between a folded and a nearly straight knee, without a kink."""
    folded, straight = 0.40, 0.98
    limited = np.where(reach > straight, straight + 0.016 * np.tanh((reach - straight) / 0.016), reach)
    return np.where(reach < folded, folded - 0.12 * np.tanh((folded - reach) / 0.12), limited)
