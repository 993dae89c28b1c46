"""How well held-out takes are assigned, in a terminal."""

from __future__ import annotations

import numpy as np
from rich.console import Group, RenderableType

from motionary.workflows.reproduce.assign import CLASSES, SUBJECTS, TAKES, AssignStudy
from motionary.workflows.reproduce.assign_trial import BOTH, FROM_CLIP, FROM_REFERENCE, NEAREST, RULES
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.tables import text_table

REACHES = (FROM_REFERENCE, FROM_CLIP, BOTH)


def assign_report(experiment: Conducted[AssignStudy]) -> RenderableType:
    """Lay a study out for reading; the rows are `AssignStudy.to_arrow`."""
    share = experiment.study.share
    sets = list(dict.fromkeys(experiment.study.to_arrow()["clips"].to_pylist()))
    right, reached = [], []
    for clips in sets:
        for held_out in (TAKES, SUBJECTS, CLASSES):
            if np.isnan(share("tested", clips, held_out, NEAREST)):
                continue
            tested = f"{share('tested', clips, held_out, NEAREST):.0f}"
            within = [share("assigned", clips, held_out, NEAREST, reach) for reach in REACHES]
            reached.append([clips, held_out, tested, *map(_figure, within)])
            if held_out != CLASSES:
                named = [share("right", clips, held_out, rule) for rule in RULES]
                sure = share("confidence", clips, held_out, NEAREST)
                right.append([clips, held_out, tested, *map(_figure, [*named, sure])])
    return Group(
        *experiment.notes,
        "",
        text_table(
            ["clips", "held out", "tested", *RULES, "confidence"],
            right,
            "Share that get their class's name, reach aside, and the mean confidence by the nearest clip",
        ),
        "",
        text_table(
            ["clips", "held out", "tested", *REACHES],
            reached,
            "Share within reach, by the nearest clip: takes and subjects should be, classes should not",
        ),
    )


def _figure(value: float) -> str:
    return f"{value:.3f}"
