"""Five styles: how the same action is done by somebody energetic, tired, proud or sneaky.

A style scales and shifts an action's channels and never its timing against itself, so a styled take keeps
its template's phases. How long it takes on average is `pace`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from motionary.pipeline.synthetic.posture import Channels


@dataclass(frozen=True)
class Style:
    """What a style changes.

    Parameters
    ----------
    name : str
        As in labels.
    pace : float
        Factor on the action's duration.
    size : float
        Factor on how far arms, chest and lifted feet go.
    stride : float
        Factor on distances over the floor.
    lean, head : float
        Degrees the chest and the head are pitched forward.
    crouch : float
        Leg lengths the pelvis is lowered.
    abduction, elbow : float
        Degrees added to both arms.
    lift : float
        Factor on the height of lifted feet, beside `size`.
    """

    name: str
    pace: float = 1.0
    size: float = 1.0
    stride: float = 1.0
    lean: float = 0.0
    head: float = 0.0
    crouch: float = 0.0
    abduction: float = 0.0
    elbow: float = 0.0
    lift: float = 1.0


_STYLES = (
    Style("neutral"),
    Style(
        "energetic", pace=0.80, size=1.20, stride=1.10, lean=4, crouch=0.01, abduction=3, elbow=16, lift=1.2
    ),
    Style("tired", pace=1.25, size=0.80, stride=0.82, lean=13, head=20, crouch=0.03, elbow=-6, lift=0.75),
    Style("proud", pace=1.08, size=1.05, stride=1.03, lean=-8, head=-8, abduction=9, elbow=6, lift=1.05),
    Style(
        "sneaky",
        pace=1.35,
        size=0.90,
        stride=0.85,
        lean=16,
        head=4,
        crouch=0.10,
        abduction=6,
        elbow=42,
        lift=1.5,
    ),
)
STYLES: dict[str, Style] = {style.name: style for style in _STYLES}
NEUTRAL = _STYLES[0]


def personal(style: Style, rng: np.random.Generator) -> Style:
    """Vary a style a little, as no two takes of one person are quite the same."""
    return replace(
        style,
        pace=style.pace * rng.uniform(0.92, 1.10),
        size=style.size * rng.uniform(0.94, 1.06),
        stride=style.stride * rng.uniform(0.95, 1.03),
        lean=style.lean + rng.uniform(-2, 2),
        head=style.head + rng.uniform(-3, 3),
        crouch=style.crouch + rng.uniform(0, 0.012),
        abduction=style.abduction + rng.uniform(-2, 4),
        elbow=style.elbow + rng.uniform(-3, 5),
    )


def apply(style: Style, channels: Channels) -> Channels:
    """Give an action's channels the style's posture; distances over the floor are the action's own affair.

    Parameters
    ----------
    style : Style
        What to change.
    channels : Channels
        Changed in place.

    Returns
    -------
    Channels
        The same object.
    """
    channels.pelvis[:, 1] -= style.crouch
    # Half of a lean is made by the hips, so that the back does not fold at the waist.
    channels.chest_turn *= style.size
    channels.chest_turn[:, 1] += style.lean / 2
    channels.pelvis_turn[:, 1] += style.lean / 2
    channels.head_turn[:, 1] += style.head
    channels.arms[:, :, 1] += style.abduction
    channels.arms[:, :, 3] = np.hypot(channels.arms[:, :, 3] + style.elbow, 4.0)
    return channels
