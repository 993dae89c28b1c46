"""The embedded library: takes of eight actions, each with its known warp against its action's template.

Every take shows its action's curves at times of the template that a smooth increasing function of the
take's own time gives: with x the share of the take that has passed,

    w(x) = x + sum_k a_k sin(k pi x) / (k pi),    sum_k |a_k| < 1,

so that w(0) = 0, w(1) = 1 and the speed 1 + sum_k a_k cos(k pi x) is never zero. What a take shows at a
time is therefore known exactly, whatever its style, body, skeleton, rate, heading and place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.synthetic.actions import ACTIONS, Action
from motionary.pipeline.synthetic.bodies import BODIES, DEFAULT_BODY, Body
from motionary.pipeline.synthetic.conventions import CONVENTIONS, MIXAMO, SkeletonConvention
from motionary.pipeline.synthetic.posture import Posture, mirrored, placed, pose
from motionary.pipeline.synthetic.styles import NEUTRAL, STYLES, Style, apply, personal

TEMPLATE_FPS = 30.0
CLIPS = 80
"""Of the library that `motionary demo` writes unless told otherwise."""
_TOGETHER = 100
"""Take numbers whose files share a folder: 500 files, however large the library."""


@dataclass(frozen=True, eq=False)
class SyntheticTake:
    """One take of the embedded library and what is known of it.

    Parameters
    ----------
    motion : Motion
        T frames.
    action, style, subject : str
        What is done, how, and by which body.
    take : int
        Number among the takes of one action and style, from 1.
    convention : str
        Name of the skeleton's convention.
    is_mirrored : bool
        Left and right are swapped; the warp is then against the mirrored template.
    warp : array (T,) float64
        For each frame the time of the action's template it shows, in frames of `template(action)` at
        `TEMPLATE_FPS`, fractional, strictly increasing, within 0 .. frames - 1. A gait's take shows a
        stretch of the template, any other take the whole of it.
    """

    motion: Motion
    action: str
    style: str
    subject: str
    take: int
    convention: str
    is_mirrored: bool
    warp: FloatArray

    @property
    def path(self) -> str:
        """The take's file in a written library, with forward slashes; from take 100 on by hundreds."""
        hundreds = self.take // _TOGETHER * _TOGETHER
        return f"{self.action}/{f'{hundreds}/' if hundreds else ''}{self.motion.name}.bvh"

    @property
    def description(self) -> str:
        """The take in words."""
        hands = ", left and right swapped" if self.is_mirrored else ""
        return f"{self.action}, {self.style}, by {self.subject}{hands}"


def template(action: str, fps: float = TEMPLATE_FPS) -> Motion:
    """Perform an action plainly: neutral style, default body, unwarped, towards +Z from the origin.

    Parameters
    ----------
    action : str
        One of `ACTIONS`.
    fps : float
        Frames a second; warps count frames at `TEMPLATE_FPS`.

    Returns
    -------
    Motion
        On the Mixamo-like skeleton, centimetres.

    Raises
    ------
    ValueError
        There is no such action.
    """
    frames = template_frames(action, fps)
    posture = _perform(ACTIONS[action], np.linspace(0.0, 1.0, frames), NEUTRAL, DEFAULT_BODY)
    return MIXAMO.motion(placed(posture, 0.0, (0.0, 0.0)), DEFAULT_BODY, fps, f"{action}_template")


def template_frames(action: str, fps: float = TEMPLATE_FPS) -> int:
    """Return the number of frames of an action's template."""
    if action not in ACTIONS:
        raise ValueError(f"there is no action {action!r}; the actions are {', '.join(ACTIONS)}")
    return round(ACTIONS[action].seconds * fps) + 1


def synthetic_library(seed: int = 0, takes: int = 2) -> list[SyntheticTake]:
    """Perform the embedded library.

    Parameters
    ----------
    seed : int
        Of NumPy's PCG64; one seed is one library.
    takes : int
        Takes of each of the eight actions in each of the five styles; 2 make 80 clips.

    Returns
    -------
    list of SyntheticTake
        By action, style and take. The first neutral take of each action is the template itself but for
        its timing, skeleton, rate, heading and place.

    Raises
    ------
    ValueError
        `takes` is below 1.
    """
    if takes < 1:
        raise ValueError(f"takes is {takes}; it must be at least 1")
    return [numbered_take(seed, *one) for one in take_numbers(takes * len(ACTIONS) * len(STYLES))]


def take_numbers(clips: int) -> Iterator[tuple[str, str, int]]:
    """List the takes of a library of any size; a larger one has those of a smaller one, and more.

    Parameters
    ----------
    clips : int
        Any two actions have as many but for one, and any two styles.

    Yields
    ------
    (action, style, take)
        By action, style and take.

    Raises
    ------
    ValueError
        `clips` is below 1.
    """
    if clips < 1:
        raise ValueError(f"clips is {clips}; it must be at least 1")
    rounds, rest = divmod(clips, len(ACTIONS) * len(STYLES))
    for action, style in product(ACTIONS, STYLES):
        for number in range(1, rounds + (_turn(action, style) < rest) + 1):
            yield action, style, number


def least_clips(action: str, style: str, number: int) -> int:
    """Return how many clips a library has at least if it has this take."""
    return (number - 1) * len(ACTIONS) * len(STYLES) + _turn(action, style) + 1


def _turn(action: str, style: str) -> int:
    """Return the place of an action in a style in a round of all: 5 styles and 8 actions go round at once."""
    a, s = list(ACTIONS).index(action), list(STYLES).index(style)
    return next(
        turn for turn in range(a, len(ACTIONS) * len(STYLES), len(ACTIONS)) if turn % len(STYLES) == s
    )


def numbered_take(seed: int, action: str, style: str, number: int) -> SyntheticTake:
    """Perform one take of the library of a seed, which is the same whatever the library's size."""
    bodies, conventions = tuple(BODIES.values()), tuple(CONVENTIONS.values())
    a, s = list(ACTIONS).index(action), list(STYLES).index(style)
    plain = STYLES[style] == NEUTRAL and number == 1
    rng = np.random.default_rng([seed, a, s, number])
    # Remainders by 2, 3 and 5 mix skeletons, rates, hands and bodies evenly, whatever the seed.
    return perform_take(
        ACTIONS[action],
        STYLES[style] if plain else personal(STYLES[style], rng),
        DEFAULT_BODY if plain else bodies[(a + 2 * s + number) % len(bodies)],
        conventions[(a + s + number) % len(conventions)],
        fps=60.0 if (a + s + number) % 3 == 0 else 30.0,
        is_mirrored=not plain and (2 * a + 2 * s + number) % 5 == 4,
        start=rng.uniform(0.0, 1.0 - ACTIONS[action].taken / ACTIONS[action].cycles),
        number=number,
        rng=rng,
    )


def perform_take(
    action: Action,
    style: Style,
    body: Body,
    convention: SkeletonConvention,
    *,
    fps: float,
    is_mirrored: bool,
    start: float,
    number: int,
    rng: np.random.Generator,
) -> SyntheticTake:
    """Perform an action once, from a share `start` of its template on; timing and place are drawn."""
    share = action.taken / action.cycles
    frames = round(action.seconds * share * style.pace * fps) + 1
    time = start + share * random_warp(np.linspace(0.0, 1.0, frames), rng)
    posture = _perform(action, time, style, body)
    if is_mirrored:
        posture = mirrored(posture)
    heading, place = rng.uniform(-np.pi, np.pi), (rng.uniform(-2, 2), rng.uniform(-2, 2))
    name = f"{action.name}_{style.name}_{body.name}_{number:02d}"
    return SyntheticTake(
        motion=convention.motion(placed(posture, heading, place), body, fps, name),
        action=action.name,
        style=style.name,
        subject=body.name,
        take=number,
        convention=convention.name,
        is_mirrored=is_mirrored,
        warp=time * (template_frames(action.name) - 1),
    )


def random_warp(share: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draw a smooth time warp of 0 .. 1 onto itself, at between .4 and 1.6 times the even speed.

    Parameters
    ----------
    share : array (T,)
        x, the share of the take that has passed.
    rng : numpy.random.Generator
        Three amplitudes are drawn.

    Returns
    -------
    array (T,)
        w(x) as in the module's docstring, strictly increasing in x.
    """
    order = np.arange(1, 4)
    amplitude = rng.uniform(-1, 1, 3) * (0.30, 0.20, 0.10)
    waves = np.sin(np.pi * np.multiply.outer(share, order)) / (np.pi * order)
    warped: FloatArray = share + waves @ amplitude
    return np.clip(warped, 0.0, 1.0)


def _perform(action: Action, time: FloatArray, style: Style, body: Body) -> Posture:
    return pose(apply(style, action.curves(time, style)), body)
