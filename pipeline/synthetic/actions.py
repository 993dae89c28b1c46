"""The eight actions, each a smooth curve over its own time that any warp may sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from motionary.pipeline.motion import FloatArray
from motionary.pipeline.synthetic.gaits import RUN_CYCLES, WALK_CYCLES, run, walk
from motionary.pipeline.synthetic.posture import Channels
from motionary.pipeline.synthetic.single_actions import jump, kick, punch, squat, throw, wave
from motionary.pipeline.synthetic.styles import Style


@dataclass(frozen=True)
class Action:
    """One action of the library.

    Parameters
    ----------
    name : str
        As in labels.
    seconds : float
        Duration of the template.
    cycles : int
        Cycles in the template of a gait; 1 where the action begins and ends.
    taken : int
        How many of the cycles a take shows.
    curves : callable
        (times (F,) in 0 .. 1, style) -> Channels.
    """

    name: str
    seconds: float
    cycles: int
    taken: int
    curves: Callable[[FloatArray, Style], Channels]


_ACTIONS = (
    Action("walk", 3.30, WALK_CYCLES, 2, walk),
    Action("run", 2.80, RUN_CYCLES, 3, run),
    Action("jump", 1.90, 1, 1, jump),
    Action("kick", 1.70, 1, 1, kick),
    Action("punch", 1.50, 1, 1, punch),
    Action("wave", 2.80, 1, 1, wave),
    Action("squat", 2.40, 1, 1, squat),
    Action("throw", 1.80, 1, 1, throw),
)
ACTIONS: dict[str, Action] = {action.name: action for action in _ACTIONS}
