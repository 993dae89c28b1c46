"""Takes for telling styles apart: every style by every body, one skeleton, warps known.

Ten takes an action and style, each body twice, where the embedded library mixes skeletons, rates and hands.
Every take shows its action from the template's first moment, as cut clips of one class do; a gait's take
shows as many cycles as in the library.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from motionary.pipeline.synthetic.actions import ACTIONS, Action
from motionary.pipeline.synthetic.bodies import BODIES, Body
from motionary.pipeline.synthetic.conventions import MIXAMO
from motionary.pipeline.synthetic.library import (
    TEMPLATE_FPS,
    SyntheticTake,
    random_warp,
    template_frames,
)
from motionary.pipeline.synthetic.posture import placed, pose
from motionary.pipeline.synthetic.styles import STYLES, Style, apply, personal


def style_takes(action: str, seed: int = 0, takes: int = 10, strength: float = 1.0) -> list[SyntheticTake]:
    """Perform one action in every style.

    Parameters
    ----------
    action : str
        One of `ACTIONS`.
    seed : int
        Of NumPy's PCG64; one seed is one set of takes.
    takes : int
        Of each style; the five bodies take turns.
    strength : float
        How much of a style is shown, before it is varied a little from take to take: 0 is neutral, 1 the
        style as the library has it.

    Returns
    -------
    list of SyntheticTake
        By style and take, all on the Mixamo-like skeleton at 30 frames a second, none mirrored.

    Raises
    ------
    ValueError
        There is no such action, `takes` is below 1, or `strength` not within 0 .. 1.
    """
    template_frames(action)  # says which actions there are
    if takes < 1:
        raise ValueError(f"takes is {takes}; it must be at least 1")
    if not 0 <= strength <= 1:
        raise ValueError(f"strength is {strength}; it must lie in 0 .. 1")
    bodies = tuple(BODIES.values())
    return [
        _take(
            ACTIONS[action],
            _weakened(style, strength),
            bodies[number % len(bodies)],
            number,
            np.random.default_rng([seed, list(ACTIONS).index(action), place, number]),
        )
        for place, style in enumerate(STYLES.values())
        for number in range(1, takes + 1)
    ]


def _weakened(style: Style, strength: float) -> Style:
    changes = {one.name: one.default for one in fields(style) if one.name != "name"}
    return replace(
        style, **{name: plain + strength * (getattr(style, name) - plain) for name, plain in changes.items()}
    )


def _take(action: Action, style: Style, body: Body, number: int, rng: np.random.Generator) -> SyntheticTake:
    shown = personal(style, rng)
    share = action.taken / action.cycles
    frames = round(action.seconds * share * shown.pace * TEMPLATE_FPS) + 1
    time = share * random_warp(np.linspace(0.0, 1.0, frames), rng)
    posture = pose(apply(shown, action.curves(time, shown)), body)
    heading, place = rng.uniform(-np.pi, np.pi), (rng.uniform(-2, 2), rng.uniform(-2, 2))
    name = f"{action.name}_{style.name}_{body.name}_{number:02d}"
    return SyntheticTake(
        motion=MIXAMO.motion(placed(posture, heading, place), body, TEMPLATE_FPS, name),
        action=action.name,
        style=style.name,
        subject=body.name,
        take=number,
        convention=MIXAMO.name,
        is_mirrored=False,
        warp=time * (template_frames(action.name) - 1),
    )
