"""Walk and run, written per cycle: the left foot comes down at phase 0, the right at .5."""

from __future__ import annotations

import numpy as np

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic.curves import cycle_keys, ease
from motionary.pipeline.synthetic.posture import Channels, standing
from motionary.pipeline.synthetic.styles import Style

LEFT, RIGHT = 0, 1
WALK_CYCLES = 3
RUN_CYCLES = 4


def walk(time: FloatArray, style: Style) -> Channels:
    """Walk straight on."""
    phase, stance, stride = time * WALK_CYCLES, 0.60, 1.40 * style.stride
    channels = standing(len(phase))
    angle = 2 * np.pi * phase
    # A foot comes down 0.25 strides ahead: that fixes how high the hips can be at double support.
    low = np.sqrt(0.978**2 - (0.25 * stride) ** 2)
    channels.pelvis[:, 0] = 0.03 * np.cos(angle - 0.6 * np.pi)
    channels.pelvis[:, 1] = low + 0.022 * (1 - np.cos(2 * angle - 0.2 * np.pi))
    channels.pelvis[:, 2] = stride * (phase - 0.25)
    channels.pelvis_turn[:, 0] = -5 * np.cos(angle)
    channels.pelvis_turn[:, 1] = 2
    channels.pelvis_turn[:, 2] = 3 * np.cos(angle - 0.6 * np.pi)
    channels.chest_turn[:, 0] = 11 * np.cos(angle)
    channels.chest_turn[:, 2] = -3 * np.cos(angle - 0.6 * np.pi)
    for side, shift in ((LEFT, 0.0), (RIGHT, 0.5)):
        own = phase + shift
        swing = -np.cos(2 * np.pi * (own - 0.02))
        channels.arms[:, side, 0] = 3 + 25 * style.size * swing
        channels.arms[:, side, 3] = 20 + 13 * style.size * swing
        lift = style.size * style.lift
        channels.feet[:, side, 0] = -0.03
        channels.feet[:, side, 1] = cycle_keys(
            own, (0, 0.045), (0.08, 0), (0.60, 0), (0.72, 0.11 * lift), (0.88, 0.07 * lift)
        )
        channels.feet[:, side, 2] = _steps(own, stance, stride) - stride * shift
        channels.foot_turn[:, side, 1] = cycle_keys(
            own, (0, -18), (0.08, 0), (0.36, 0), (0.60, 48), (0.78, 14), (0.92, -16)
        )
    return channels


def run(time: FloatArray, style: Style) -> Channels:
    """Run straight on, with both feet off the ground twice a cycle."""
    phase, stance, stride = time * RUN_CYCLES, 0.36, 2.5 * style.stride
    channels = standing(len(phase))
    angle = 2 * np.pi * phase
    channels.pelvis[:, 1] = 0.875 - 0.045 * np.cos(2 * angle - 0.72 * np.pi)
    channels.pelvis[:, 2] = stride * (phase - 0.15)
    channels.pelvis_turn[:, 0] = -9 * np.cos(angle)
    channels.pelvis_turn[:, 1] = 7
    channels.chest_turn[:, 0] = 20 * np.cos(angle)
    channels.chest_turn[:, 1] = 5
    for side, shift in ((LEFT, 0.0), (RIGHT, 0.5)):
        own = phase + shift
        swing = -np.cos(2 * np.pi * (own - 0.02))
        channels.arms[:, side, 0] = -4 + 42 * style.size * swing
        channels.arms[:, side, 1] = 14
        channels.arms[:, side, 2] = 25
        channels.arms[:, side, 3] = 88 + 14 * swing
        lift = 0.7 + 0.3 * style.size * style.lift
        channels.feet[:, side, 0] = -0.06
        channels.feet[:, side, 1] = cycle_keys(
            own,
            (0.02, 0),
            (0.36, 0),
            (0.50, 0.24 * lift),
            (0.62, 0.33 * lift),
            (0.80, 0.18 * lift),
            (0.93, 0.07),
        )
        channels.feet[:, side, 2] = _steps(own, stance, stride) - stride * shift
        channels.foot_turn[:, side, 1] = cycle_keys(
            own, (0.02, -4), (0.07, 0), (0.18, 5), (0.36, 52), (0.52, 88), (0.65, 75), (0.82, 12), (0.94, -6)
        )
    return channels


def _steps(phase: FloatArray, stance: float, stride: float) -> FloatArray:
    """Advance a foot by a stride in every cycle, at rest through the first `stance` of it."""
    return stride * (np.floor(phase) + ease((np.mod(phase, 1.0) - stance) / (1 - stance)))
