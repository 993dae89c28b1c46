"""How well styles are told from what alignment leaves over: CoTW against other ways to bring clips into time.

**[CoTW]** Etemad, Arya, *Correlation-optimized time warping for motion*, 6.3, says that style translation
needs aligned clips, and shows it by a video. Here takes of every action, in five styles by five bodies, whose
timing varies at random and is known, are brought into the time of one reference an action (chosen by the
similarity index, which knows no styles); their residuals predict the style, every body left out once.

Beside the methods stand two limits: `none`, where frame k of a clip meets frame k of the reference (a shorter
clip holds its last frame, a longer one is cut), and `known warp`, the timing that the takes were made with.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyarrow as pa
from rich.console import Group, RenderableType

from motionary.pipeline.alignment import (
    Warp,
    cotw_search,
    dtw,
    select_reference,
    uniform,
)
from motionary.pipeline.config import FeatureConfig
from motionary.pipeline.features import POSE_COLUMNS, frame_features
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.style import residuals, style_accuracy
from motionary.pipeline.synthetic import ACTIONS, STYLES, SyntheticTake, style_takes
from motionary.pipeline.tables import table_field
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.report import spread
from motionary.workflows.reproduce.study import Mean, mean_of
from motionary.workflows.tables import text_table

STRENGTHS = (1.0, 0.5)
"""How much of the styles is shown: the library's, and half of them, where fewer are told apart at once."""

TAKES = 10


@dataclass(frozen=True, eq=False)
class AlignedTake:
    """What an aligner may know: the take, its pose, and those of the reference."""

    take: SyntheticTake
    pose: FloatArray
    reference: SyntheticTake
    reference_pose: FloatArray


def _held(one: AlignedTake) -> Warp:
    last = len(one.pose) - 1
    return Warp(np.minimum(np.arange(len(one.reference_pose), dtype=np.float64), last), len(one.pose))


def _known(one: AlignedTake) -> Warp:
    frames = np.arange(len(one.pose), dtype=np.float64)
    return Warp(np.interp(one.reference.warp, one.take.warp, frames), len(one.pose))


METHODS: Mapping[str, Callable[[AlignedTake], Warp]] = {
    "none": _held,
    "UTW": lambda one: uniform(one.pose, one.reference_pose),
    "DTW": lambda one: dtw(one.pose, one.reference_pose),
    "CoTW": lambda one: cotw_search(one.pose, one.reference_pose, effort="fast"),
    "known warp": _known,
}
"""How a take is brought into its reference's time."""


@dataclass(frozen=True, eq=False)
class StyleStudy:
    """Accuracy of the styles predicted from residuals.

    Parameters
    ----------
    takes : int
        Of an action and style.
    seed : int
        Of the takes.
    references : mapping of (strength, action) to str
        The take that the others were aligned to.
    accuracy : mapping of (strength, action, method) to float
        Share of takes whose style was predicted, 0 .. 1.
    """

    takes: int
    seed: int
    references: Mapping[tuple[float, str], str]
    accuracy: Mapping[tuple[float, str, str], float]

    def mean(self, strength: float, method: str, minus: str | None = None) -> Mean:
        """Average over the actions, or over the differences from another method, action by action."""
        of_strength = [key[:2] for key in self.accuracy if key[0] == strength and key[2] == method]
        values = [
            self.accuracy[(*key, method)] - (self.accuracy[(*key, minus)] if minus else 0.0)
            for key in of_strength
        ]
        return mean_of(np.array(values))

    def to_arrow(self) -> pa.Table:
        """Return a row for every strength, action and method."""
        fields = [
            table_field("strength", pa.float64(), "share of the styles that was shown"),
            table_field("action", pa.string(), "what was done"),
            table_field("method", pa.string(), "how takes were brought into the reference's time"),
            table_field("takes", pa.int32(), "of this action, in five styles by five bodies"),
            table_field("reference", pa.string(), "the take that others were aligned to"),
            table_field("accuracy", pa.float64(), "share of takes whose style was predicted"),
        ]
        rows = [
            {
                "strength": strength,
                "action": action,
                "method": method,
                "takes": self.takes * len(STYLES),
                "reference": self.references[strength, action],
                "accuracy": value,
            }
            for (strength, action, method), value in self.accuracy.items()
        ]
        return pa.Table.from_pylist(rows, schema=pa.schema(fields))


@dataclass(frozen=True, eq=False)
class StyleExperiment:
    """The study, as experiments hand it on."""

    study: StyleStudy


def conduct_style(takes: int, seed: int, show: Show) -> StyleExperiment:
    """Conduct `study_style` on all actions, by all methods."""
    return StyleExperiment(study_style(show, takes, seed))


def study_style(
    show: Show,
    takes: int = TAKES,
    seed: int = 0,
    actions: Sequence[str] = tuple(ACTIONS),
    methods: Sequence[str] = tuple(METHODS),
    strengths: Sequence[float] = STRENGTHS,
) -> StyleStudy:
    """Predict styles from residuals after every method of alignment.

    Parameters
    ----------
    show : callable
        Shows progress, see `motionary.workflows.progress`.
    takes : int
        Of each action and style; five or more let every body do every style.
    seed : int
        Of the takes. The same seed gives the same result.
    actions, methods : sequence of str
        Some of `ACTIONS` and of `METHODS`.
    strengths : sequence of float
        How much of the styles is shown, see `style_takes`.
    """
    references: dict[tuple[float, str], str] = {}
    accuracy: dict[tuple[float, str, str], float] = {}
    with show({"style": len(strengths) * len(actions)}) as advance:
        for strength in strengths:
            for action in actions:
                several = _in_one_time(style_takes(action, seed, takes, strength))
                references[strength, action] = several[0].reference.motion.name
                for method in methods:
                    accuracy[strength, action, method] = _accuracy(several, METHODS[method])
                advance("style")
    return StyleStudy(takes, seed, references, accuracy)


def _in_one_time(takes: Sequence[SyntheticTake]) -> list[AlignedTake]:
    config = FeatureConfig(epsilon=0.0)
    poses = [frame_features(one.motion, config).values[:, :POSE_COLUMNS] for one in takes]
    chosen = select_reference(poses)
    return [
        AlignedTake(take, pose, takes[chosen], poses[chosen]) for take, pose in zip(takes, poses, strict=True)
    ]


def _accuracy(several: Sequence[AlignedTake], method: Callable[[AlignedTake], Warp]) -> float:
    aligned = [method(one).apply_motion(one.take.motion) for one in several]
    vectors = [one.vector() for one in residuals(aligned, several[0].reference.motion)]
    return style_accuracy(vectors, [one.take.style for one in several], [one.take.subject for one in several])


def style_report(study: StyleStudy) -> RenderableType:
    """Lay a study out for reading: means, differences from UTW, and every action."""
    strengths = list(dict.fromkeys(key[0] for key in study.accuracy))
    actions = list(dict.fromkeys(key[1] for key in study.accuracy))
    methods = list(dict.fromkeys(key[2] for key in study.accuracy))
    mean = partial(_mean_row, study, methods)
    title = (
        "Share of takes whose style is predicted from the residual; ± half of the 95% interval over actions"
    )
    parts: list[RenderableType] = [
        f"{study.takes} takes of each of {len(actions)} actions in {len(STYLES)} styles, seed {study.seed}: "
        "residuals against one reference an action, 16 stretches; standardised, 20 principal components, "
        "logistic regression, every body left out once.",
        "",
        text_table(
            ["styles shown", *methods, *(f"{one} minus UTW" for one in methods if one != "UTW")],
            [mean(one) for one in strengths],
            title,
        ),
    ]
    for strength in strengths:
        rows = [
            [
                one,
                *(f"{study.accuracy[strength, one, method]:.2f}" for method in methods),
                study.references[strength, one],
            ]
            for one in actions
        ]
        parts += [
            "",
            text_table(["action", *methods, "reference"], rows, f"By action, styles shown {strength:g}"),
        ]
    return Group(*parts)


def _mean_row(study: StyleStudy, methods: Sequence[str], strength: float) -> list[str]:
    plain = [spread(study.mean(strength, one)) for one in methods]
    against = [spread(study.mean(strength, one, "UTW"), sign=True) for one in methods if one != "UTW"]
    return [f"{strength:g}", *plain, *against]
