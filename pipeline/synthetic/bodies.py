"""Bodies of the embedded library: segment lengths, and where every landmark lies at rest.

At rest a body stands in a T-pose facing +Z with its left side at +X and the pelvis at the origin.
Lengths are metres. Bodies are symmetric, so a mirrored take is one that the same body could have done.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from motionary.pipeline.motion import FloatArray

SIDES = ("left", "right")
SIGN = {"left": 1.0, "right": -1.0}
ANKLE_HEIGHT = 0.085
TOE_HEIGHT = 0.025


@dataclass(frozen=True)
class Body:
    """Segment lengths of one actor, in metres.

    Parameters
    ----------
    name : str
        What the actor is called in file names and labels.
    thigh, shank, foot : float
        Hip to knee, knee to ankle, and ankle to ball of the foot along the floor.
    hip_width, shoulder_width : float
        Between the two hip joints, between the two shoulder joints.
    trunk : float
        Pelvis to neck.
    neck : float
        Neck to head joint.
    upper_arm, forearm : float
        Shoulder to elbow, elbow to wrist.
    """

    name: str
    thigh: float
    shank: float
    foot: float
    hip_width: float
    shoulder_width: float
    trunk: float
    neck: float
    upper_arm: float
    forearm: float

    @property
    def leg(self) -> float:
        """Leg length, thigh and shank: the unit in which actions are written."""
        return self.thigh + self.shank

    @property
    def hip_drop(self) -> float:
        """Height of the pelvis joint over the hip joints."""
        return 0.15 * self.trunk

    def landmarks(self) -> dict[str, FloatArray]:
        """Place every landmark of the body at rest.

        Returns
        -------
        dict of str to array (3,)
            Metres from the pelvis; paired landmarks begin with `left_` and `right_`.
        """
        trunk = self.trunk
        places = {
            "pelvis": (0.0, 0.0, 0.0),
            "waist": (0.0, 0.10 * trunk, 0.0),
            "spine": (0.0, 0.28 * trunk, 0.0),
            "chest": (0.0, 0.50 * trunk, 0.0),
            "collar": (0.0, 0.86 * trunk, 0.0),
            "neck": (0.0, trunk, 0.0),
            "head": (0.0, trunk + self.neck, 0.2 * self.neck),
        }
        for side in SIDES:
            places |= {f"{side}_{name}": at for name, at in self._limb_landmarks(SIGN[side]).items()}
        return {name: np.array(place) for name, place in places.items()}

    def _limb_landmarks(self, sign: float) -> dict[str, tuple[float, float, float]]:
        hip, hip_height = sign * self.hip_width / 2, -self.hip_drop
        ankle_height = hip_height - self.leg
        shoulder, arm_height = self.shoulder_width / 2, 0.90 * self.trunk
        elbow = shoulder + self.upper_arm
        wrist = elbow + self.forearm
        return {
            "hip": (hip, hip_height, 0.0),
            "knee": (hip, hip_height - self.thigh, 0.0),
            "ankle": (hip, ankle_height, 0.0),
            "toe": (hip, ankle_height - ANKLE_HEIGHT + TOE_HEIGHT, self.foot),
            "clavicle": (sign * 0.03, arm_height, 0.0),
            "shoulder": (sign * shoulder, arm_height, 0.0),
            "elbow": (sign * elbow, arm_height, 0.0),
            "wrist": (sign * wrist, arm_height, 0.0),
            "fingers": (sign * (wrist + 0.09), arm_height, 0.0),
            "fingertips": (sign * (wrist + 0.15), arm_height, 0.0),
            "thumb": (sign * (wrist + 0.03), arm_height, 0.03),
        }


_BODIES = (
    Body("alex", 0.43, 0.42, 0.135, 0.18, 0.36, 0.50, 0.10, 0.29, 0.26),
    Body("bea", 0.38, 0.37, 0.120, 0.19, 0.31, 0.45, 0.09, 0.25, 0.23),
    Body("chidi", 0.49, 0.48, 0.150, 0.18, 0.38, 0.51, 0.11, 0.33, 0.29),
    Body("dora", 0.33, 0.31, 0.110, 0.16, 0.29, 0.42, 0.08, 0.22, 0.20),
    Body("emil", 0.42, 0.38, 0.140, 0.20, 0.44, 0.55, 0.09, 0.30, 0.25),
)
BODIES: dict[str, Body] = {body.name: body for body in _BODIES}
DEFAULT_BODY = _BODIES[0]
