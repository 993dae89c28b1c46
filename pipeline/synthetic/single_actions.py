"""Actions that begin and end: jump, squat, kick, punch, wave, throw, as key poses in times 0 .. 1."""

from __future__ import annotations

import numpy as np

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic.curves import keys
from motionary.pipeline.synthetic.posture import STANDING_HEIGHT, Channels, standing
from motionary.pipeline.synthetic.styles import Style

LEFT, RIGHT = 0, 1


def jump(time: FloatArray, style: Style) -> Channels:
    """Jump forward off both feet and land on both."""
    channels = standing(len(time))
    far, high, size = 1.0 * style.stride, 0.26 * style.lift * style.size, style.size
    channels.pelvis[:, 1:] = keys(
        time,
        (0.00, STANDING_HEIGHT, 0.0),
        (0.05, STANDING_HEIGHT, 0.0),
        (0.30, 0.62, -0.06),
        (0.42, 1.02, 0.16),
        (0.53, 1.00 + high, 0.52 * far),
        (0.64, 0.95, 0.86 * far),
        (0.77, 0.66, 0.96 * far),
        (0.94, STANDING_HEIGHT, far),
        (1.00, STANDING_HEIGHT, far),
    )
    channels.pelvis_turn[:, 1] = keys(
        time, (0.04, 0), (0.30, 34), (0.46, 4), (0.60, 8), (0.75, 30), (0.94, 0)
    )
    channels.chest_turn[:, 1] = keys(
        time, (0.04, 0), (0.30, 14), (0.46, -4), (0.60, 4), (0.75, 14), (0.94, 0)
    )
    channels.head_turn[:, 1] = keys(time, (0.04, 0), (0.30, 12), (0.46, -6), (0.75, 12), (0.94, 0))
    flexion = keys(time, (0.03, 2), (0.26, -30), (0.49, 140), (0.58, 105), (0.74, 30), (0.95, 2))
    channels.arms[:, :, 0] = (2 + (flexion - 2) * size)[:, None]
    channels.arms[:, :, 3] = keys(
        time, (0.03, 14), (0.28, 20), (0.40, 45), (0.50, 20), (0.74, 45), (0.95, 14)
    )[:, None]
    channels.feet[:, :, 0] = 0.02
    channels.feet[:, :, 1] = keys(time, (0.42, 0), (0.535, 1.25 * high), (0.64, 0))[:, None]
    channels.feet[:, :, 2] = far * keys(time, (0.42, 0), (0.53, 0.50), (0.64, 1.0))[:, None]
    channels.foot_turn[:, :, 1] = keys(time, (0.34, 0), (0.43, 52), (0.50, 35), (0.60, -8), (0.66, 0))[
        :, None
    ]
    return channels


def squat(time: FloatArray, style: Style) -> Channels:
    """Go down with the arms held forward, stay a moment and come up."""
    channels = standing(len(time))
    depth = 0.47 * min(style.size, 1.05)
    down = keys(time, (0.06, 0), (0.44, 1), (0.56, 1), (0.94, 0))
    channels.pelvis[:, 1] -= depth * down
    channels.pelvis[:, 2] = -0.24 * down
    channels.pelvis_turn[:, 1] = 30 * down
    channels.chest_turn[:, 1] = 9 * down
    channels.arms[:, :, 0] = (2 + 112 * style.size * keys(time, (0.03, 0), (0.36, 1), (0.60, 1), (0.95, 0)))[
        :, None
    ]
    channels.feet[:, :, 0] = 0.09
    channels.foot_turn[:, :, 0] = 20
    return channels


def kick(time: FloatArray, style: Style) -> Channels:
    """Kick forward with the right leg, the left foot planted."""
    channels = standing(len(time))
    size = style.size
    height = 0.62 + 0.30 * min(size, 1.1)
    channels.pelvis[:, 0] = keys(time, (0, 0), (0.22, 0.06), (0.68, 0.06), (0.92, 0))
    channels.pelvis[:, 1] = keys(
        time, (0, 0.92), (0.20, 0.91), (0.42, 0.95), (0.50, 0.95), (0.85, 0.91), (1, 0.92)
    )
    channels.pelvis[:, 2] = keys(
        time, (0, 0), (0.18, 0.07), (0.32, 0.08), (0.44, 0.13), (0.65, 0.08), (0.95, 0)
    )
    channels.pelvis_turn[:, 0] = keys(time, (0.05, -12), (0.42, 14), (0.52, 14), (0.85, -12))
    channels.pelvis_turn[:, 1] = keys(time, (0.05, 4), (0.30, -4), (0.43, -18), (0.52, -18), (0.85, 4))
    channels.chest_turn[:, 0] = keys(time, (0.05, 4), (0.43, -16), (0.52, -16), (0.85, 4))
    channels.chest_turn[:, 1] = keys(time, (0.05, 4), (0.30, 12), (0.43, 4), (0.52, 4), (0.85, 4))
    channels.arms[:, LEFT] = keys(
        time, (0.02, 30, 12, 30, 70), (0.30, 45, 20, 40, 85), (0.44, 62, 20, 40, 70), (0.90, 30, 12, 30, 70)
    )
    channels.arms[:, RIGHT] = keys(
        time, (0.02, 30, 12, 30, 70), (0.30, 20, 20, 20, 65), (0.44, -28, 24, 10, 35), (0.90, 30, 12, 30, 70)
    )
    channels.feet[:, :, 0] = 0.02
    channels.feet[:, LEFT, 2] = 0.14
    channels.feet[:, RIGHT, 1:] = keys(
        time,
        (0.00, 0.0, -0.22),
        (0.12, 0.0, -0.22),
        (0.31, 0.44, 0.02),
        (0.43, height, 0.92),
        (0.48, height, 0.92),
        (0.60, 0.44, 0.05),
        (0.86, 0.0, -0.22),
        (1.00, 0.0, -0.22),
    )
    channels.foot_turn[:, RIGHT, 1] = keys(
        time, (0.06, 0), (0.14, 30), (0.30, 42), (0.42, -48), (0.49, -48), (0.61, 35), (0.78, 30), (0.87, 0)
    )
    return channels


def punch(time: FloatArray, style: Style) -> Channels:
    """Punch with the right fist out of a guard, the hips turning behind it."""
    channels = standing(len(time))
    strike = keys(time, (0.22, 0), (0.45, 1), (0.50, 1), (0.80, 0))
    load = keys(time, (0.04, 0), (0.23, 1), (0.36, 0))
    channels.pelvis[:, 1] = 0.90 - 0.02 * load - 0.015 * strike
    channels.pelvis[:, 2] = -0.03 * load + 0.10 * style.stride * strike
    channels.pelvis_turn[:, 0] = -28 - 8 * load + 52 * strike
    channels.pelvis_turn[:, 1] = 4 + 5 * strike
    channels.chest_turn[:, 0] = -6 - 14 * load + 34 * strike
    channels.chest_turn[:, 1] = 6 + 4 * strike
    channels.head_turn[:, 1] = 5
    channels.arms[:, LEFT] = (42, 12, 42, 118)
    channels.arms[:, LEFT, 0] += -8 * strike
    guard, out = np.array([32.0, 14.0, 40.0, 125.0]), np.array([84.0, 40.0, 45.0, 6.0])
    channels.arms[:, RIGHT] = (
        guard + strike[:, None] * (out - guard) + load[:, None] * (-34.0, 6.0, -10.0, 0.0)
    )
    channels.feet[:, :, 0] = 0.05
    channels.feet[:, LEFT, 2] = 0.24
    channels.feet[:, RIGHT, 2] = -0.20
    channels.foot_turn[:, LEFT, 0] = 4
    channels.foot_turn[:, RIGHT, 0] = 42 - 34 * strike
    channels.foot_turn[:, RIGHT, 1] = 6 + 34 * strike
    return channels


def wave(time: FloatArray, style: Style) -> Channels:
    """Raise the right hand and wave it from side to side."""
    channels = standing(len(time))
    up = keys(time, (0.02, 0), (0.22, 1), (0.80, 1), (0.98, 0))
    side = np.sin(2 * np.pi * 4 * (time - 0.22) / 0.58) * keys(
        time, (0.18, 0), (0.26, 1), (0.76, 1), (0.84, 0)
    )
    channels.pelvis[:, 0] = 0.035 * up
    channels.pelvis[:, 1] -= 0.004 * up
    channels.pelvis_turn[:, 2] = -2 * up
    channels.chest_turn[:, 2] = -3 * up + 1.5 * side
    channels.head_turn[:, 2] = 4 * up
    down, raised = np.array([2.0, 8.0, 15.0, 14.0]), np.array([18.0, 98.0, -78.0, 70.0])
    channels.arms[:, RIGHT] = down + up[:, None] * (raised - down)
    channels.arms[:, RIGHT, 3] += 30 * style.size * side
    channels.arms[:, RIGHT, 1] += 5 * style.size * side
    channels.feet[:, :, 0] = 0.02
    return channels


def throw(time: FloatArray, style: Style) -> Channels:
    """Throw overhand with the right arm, the left foot stepping into it."""
    channels = standing(len(time))
    step = 0.46 * style.stride
    channels.pelvis[:, 1:] = keys(
        time,
        (0.00, 0.96, 0.0),
        (0.24, 0.92, -0.08),
        (0.42, 0.88, 0.10),
        (0.54, 0.87, 0.26 * style.stride),
        (0.72, 0.88, 0.32 * style.stride),
        (1.00, 0.91, 0.30 * style.stride),
    )
    channels.pelvis_turn[:, 0] = keys(
        time, (0.02, 0), (0.30, -48), (0.40, -40), (0.53, 14), (0.68, 30), (0.98, 4)
    )
    channels.pelvis_turn[:, 1] = keys(time, (0.02, 0), (0.30, -6), (0.53, 6), (0.68, 16), (0.98, 2))
    channels.chest_turn[:, 0] = keys(
        time, (0.02, 0), (0.32, -28), (0.42, -30), (0.55, 22), (0.68, 32), (0.98, 0)
    )
    channels.chest_turn[:, 1] = keys(
        time, (0.02, 0), (0.34, -9), (0.44, -8), (0.55, 10), (0.68, 26), (0.98, 2)
    )
    channels.chest_turn[:, 2] = keys(time, (0.02, 0), (0.34, 8), (0.54, -12), (0.68, -6), (0.98, 0))
    channels.head_turn[:, 1] = keys(time, (0.02, 0), (0.50, 2), (0.68, 12), (0.98, 0))
    channels.arms[:, RIGHT] = keys(
        time,
        (0.02, 2, 8, 15, 14),
        (0.20, -10, 50, -20, 70),
        (0.36, 0, 95, -95, 98),
        (0.42, 10, 96, -100, 100),
        (0.49, 85, 85, -30, 80),
        (0.55, 138, 40, 0, 18),
        (0.68, 50, -6, 15, 16),
        (0.98, 4, 8, 15, 18),
    )
    channels.arms[:, LEFT] = keys(
        time,
        (0.02, 2, 8, 15, 14),
        (0.32, 74, 22, 20, 24),
        (0.42, 72, 24, 20, 24),
        (0.56, 12, 24, 20, 75),
        (0.98, 4, 8, 15, 18),
    )
    channels.feet[:, :, 0] = 0.03
    lift = 0.20 * style.size * style.lift
    channels.feet[:, LEFT, 1] = keys(time, (0.14, 0), (0.28, lift), (0.43, 0))
    channels.feet[:, LEFT, 2] = step * keys(time, (0.16, 0), (0.43, 1))
    channels.foot_turn[:, LEFT, 1] = keys(time, (0.14, 0), (0.25, 22), (0.36, -8), (0.43, 0))
    channels.foot_turn[:, RIGHT, 0] = keys(time, (0.10, 10), (0.30, 34), (0.44, 34), (0.62, 8))
    channels.foot_turn[:, RIGHT, 1] = keys(time, (0.38, 0), (0.55, 36), (0.70, 46), (1.0, 40))
    return channels
