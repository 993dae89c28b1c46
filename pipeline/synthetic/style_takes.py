"""Takes for telling styles apart: every style by every body, one skeleton, warps known.

Ten takes an action and style, each body twice, where the embedded library mixes skeletons, rates and hands.
Every take shows its action from the template's first moment, as cut clips of one class do; a gait's take
shows as many cycles as in the library.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from motionary.pipeline.synthetic.actions import ACTIONS
from motionary.pipeline.synthetic.bodies import BODIES
from motionary.pipeline.synthetic.conventions import MIXAMO
from motionary.pipeline.synthetic.library import (
    TEMPLATE_FPS,
    SyntheticTake,
    perform_take,
    template_frames,
)
from motionary.pipeline.synthetic.styles import STYLES, Style, personal


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
    performed = []
    for place, style in enumerate(STYLES.values()):
        shown = _weakened(style, strength)
        for number in range(1, takes + 1):
            rng = np.random.default_rng([seed, list(ACTIONS).index(action), place, number])
            performed.append(
                perform_take(
                    ACTIONS[action],
                    personal(shown, rng),
                    bodies[number % len(bodies)],
                    MIXAMO,
                    fps=TEMPLATE_FPS,
                    is_mirrored=False,
                    start=0.0,
                    number=number,
                    rng=rng,
                )
            )
    return performed


def _weakened(style: Style, strength: float) -> Style:
    changes = {one.name: one.default for one in fields(style) if one.name != "name"}
    return replace(
        style, **{name: plain + strength * (getattr(style, name) - plain) for name, plain in changes.items()}
    )
