"""Experiment of [CoTW] 6.1 on a catalog of one's own: which method aligns two clips of one action best.

**[CoTW]** Etemad, Arya, *Correlation-optimized time warping for motion*. The paper has one pair of clips for
each of six actions; here some pairs of each of at most six. An action's value is the mean over its pairs.
Distances are divided by the largest of the methods' within the action, means and deviations are taken over
actions, and the t test is the paper's: two samples of as many values as there are actions.

The paper's DOFs are joint angles and the root; a run compares positions of joints, as the catalog keeps them,
at its common rate and before merging. Nor does the paper say who is aligned to whom. So the experiment is
made by both kinds of DOFs, and with pairs of two people and of one: first as in a run, with two people.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np

from motionary.catalog import Catalog
from motionary.pipeline.features import POSE_COLUMNS
from motionary.pipeline.motion import FloatArray
from motionary.pipeline.stages.columns import matrix, per_clip
from motionary.pipeline.synthetic import synthetic_library
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw_measures import (
    METHODS,
    WITH_ANY_DISTORTION,
    Measurement,
    Measurements,
    known_takes,
    measure_fixed,
    measure_known,
    measure_pair,
    measure_references,
)
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.joint_angles import joint_angles
from motionary.workflows.reproduce.labelled import labelled_clips
from motionary.workflows.reproduce.pairs import MOST_ACTIONS, Action, draw_actions

POSITIONS, ANGLES = "joint positions", "root and joint angles"


def study_cotw(
    catalog: Catalog, label_column: str, draws: int, seed: int, show: Show
) -> Conducted[Measurements]:
    """Align pairs of labelled clips, and takes of the embedded library, by every method.

    Parameters
    ----------
    catalog : Catalog
        Its features are compared, and its motions.
    label_column : str
        The column that holds the actions.
    draws : int
        Pairs of every action and kind, at most.
    seed : int
        Of the draws. The same seed gives the same result, but for the seconds.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    UserError
        The catalog has no such labels, or fewer than two of two clips.
    """
    actions = draw_actions(labelled_clips(catalog, label_column), draws, seed)
    paired = sorted({clip_id for action in actions for _, pair in action for clip_id in pair})
    takes = known_takes(synthetic_library())
    positions = _read_positions(catalog, {*paired, *(one for action in actions for one in action.members)})
    rate = catalog.config.features.frame_rate
    pairs = sum(len(list(action)) for action in actions)
    stages = {"read": len(paired), "align": 2 * pairs, "known warps": len(takes), "references": len(actions)}
    with show(stages) as advance:
        angles, skeletons = {}, {}
        for clip_id in paired:
            motion = catalog.motion(clip_id)
            if motion.places is None:  # markers have no angles
                angles[clip_id], skeletons[clip_id] = joint_angles(motion, rate), motion.skeleton.names
            advance("read")
        _load_kernels(actions, positions)
        alike = dict.fromkeys(positions, ())
        rows = _measure_pairs(POSITIONS, actions, positions, alike, partial(advance, "align"))
        rows += _measure_pairs(ANGLES, actions, angles, skeletons, partial(advance, "align"))
        for take in takes:
            rows += measure_known(take)
            advance("known warps")
        for action in actions:
            rows += measure_references(
                action.name, action.members, [positions[one] for one in action.members]
            )
            advance("references")
    return Conducted(Measurements(rows), _notes(actions, positions, label_column, len(takes), seed))


def _read_positions(catalog: Catalog, clip_ids: Iterable[str]) -> dict[str, FloatArray]:
    rows = catalog.sql(
        "select clip_id, feature from features where clip_id in (select unnest($wanted)) "
        "order by clip_id, frame",
        {"wanted": sorted(clip_ids)},
    )
    return {clip_id: matrix(one["feature"])[:, :POSE_COLUMNS] for clip_id, one in per_clip(rows).items()}


def _measure_pairs(
    dofs: str,
    actions: list[Action],
    clips: Mapping[str, FloatArray],
    skeletons: Mapping[str, tuple[str, ...]],
    advance: Callable[[], None],
) -> list[Measurement]:
    """Measure all pairs of clips whose skeletons are given and are the same."""
    rows: list[Measurement] = []
    for place, people in enumerate(actions[0].pairs):
        is_first = dofs == POSITIONS and place == 0
        methods = WITH_ANY_DISTORTION if is_first else METHODS
        for action in actions:
            for ids in action.pairs[people]:
                advance()
                names = [skeletons.get(one) for one in ids]
                if names[0] is None or names[0] != names[1]:
                    continue
                moving, reference = (clips[one] for one in ids)
                rows += measure_pair(f"{dofs}, {people}", action.name, ids, moving, reference, methods)
                if is_first:
                    rows += measure_fixed(action.name, ids, moving, reference)
    return rows


def _load_kernels(actions: list[Action], clips: Mapping[str, FloatArray]) -> None:
    """Align the longest pair once for nothing: what is compiled takes its time when it is first called."""
    pairs = [(action.name, ids) for action in actions for _, ids in action]
    name, ids = max(pairs, key=lambda pair: len(clips[pair[1][1]]))
    moving, reference = (clips[one] for one in ids)
    measure_pair("", name, ids, moving, reference)
    measure_fixed(name, ids, moving, reference)


def _notes(
    actions: list[Action], clips: Mapping[str, FloatArray], label_column: str, takes: int, seed: int
) -> list[str]:
    kinds = list(actions[0].pairs)
    counts = {kind: sum(len(action.pairs[kind]) for action in actions) for kind in kinds}
    lengths = [len(clips[ids[1]]) for action in actions for _, ids in action]
    said = [
        f"Pairs of {len(actions)} actions ({label_column}), seed {seed}: "
        f"{', '.join(f'{count} of {kind}' for kind, count in counts.items())}. "
        f"Their references have {min(lengths)} to {max(lengths)} frames, {np.mean(lengths):.0f} on average. "
        f"Known warps: {takes} takes of the embedded library, mirrored ones left out."
    ]
    if len(actions) < MOST_ACTIONS:
        said.append(f"The paper's six actions cannot be had here: there are {len(actions)}.")
    return said
