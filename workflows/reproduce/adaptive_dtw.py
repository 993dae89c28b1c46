"""Experiment of adaptive DTW: what constraints do to a path, on one's own catalog or the embedded library.

**[ADTW]** Heloir, Courty, Gibet, Multon, *Temporal alignment of communicative gesture sequences*. The paper
aligns records of one long sequence of signs, a minute each, to the first of them, and shows what comes out as
curves: it prints no number. Here two takes of one action are aligned, of two people first where that is
known; and sequences made of takes: of one rig the moving takes of the actions' first pairs joined one after
another, and the references of these pairs likewise, then those of the second pairs, and so on. Where takes
meet, the joined motion leaps. Only clips whose joints have the same names can be compared, and clips of
markers not at all; of the actions with such clips six are drawn, so that what is joined stays a sequence of
minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from motionary.catalog import Catalog
from motionary.pipeline.canonical import Convention
from motionary.pipeline.features import at_rate
from motionary.pipeline.motion import Motion
from motionary.pipeline.synthetic import TEMPLATE_FPS, synthetic_library, template
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce.adaptive_dtw_measures import (
    METHODS,
    SEQUENCES,
    SETTINGS,
    TAKES,
    WITH_SETTINGS,
    Method,
    measure_known,
    measure_pair,
)
from motionary.workflows.reproduce.conducted import Conducted
from motionary.workflows.reproduce.cotw_measures import Measurement, Measurements, known_takes
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.labelled import LabelledClips, labelled_clips
from motionary.workflows.reproduce.pairs import MOST_ACTIONS, Pair, comparable_by_action

Group = tuple[str, frozenset[str]]
"""An action, and the names of the joints of those of its clips that can be compared with each other."""


@dataclass(frozen=True, eq=False)
class Library:
    """Clips with rotations: their classes, the names of their joints, and how a motion is read."""

    clips: LabelledClips
    joints: dict[str, tuple[str, ...]]
    read: Callable[[str], Motion]
    rate: float
    conventions: tuple[Convention, ...]


def study_adaptive_dtw(
    catalog: Catalog | None, label_column: str, draws: int, seed: int, show: Show
) -> Conducted[Measurements]:
    """Align pairs of takes, and sequences of takes, by DTW, constrained DTW and adaptive DTW.

    Parameters
    ----------
    catalog : Catalog or None
        Whose clips are aligned; those of the embedded library, but the mirrored, where there is none.
    label_column : str
        The column of the catalog that holds the actions.
    draws : int
        Pairs of every action, at most.
    seed : int
        Of the draws. The same seed gives the same result, but for the seconds.
    show : callable
        Shows progress, see `motionary.workflows.progress`.

    Raises
    ------
    UserError
        The catalog has no such labels, or no two clips of one label have the same joints.
    """
    library = _embedded() if catalog is None else _catalogued(catalog, label_column)
    pairs = comparable_pairs(library, draws, seed)
    if not pairs:
        raise UserError(
            "no two clips of one label have joints of the same names, and rotations are compared joint by "
            "joint: label more clips of one rig, or leave out CATALOG for the embedded library"
        )
    names = set(template(synthetic_library()[0].action).skeleton.names)
    takes = [one for one in known_takes(synthetic_library()) if set(one.motion.skeleton.names) == names]
    several = sum(len(of_action) for of_action in pairs.values())
    joined = pairs_to_join(library, pairs)
    rows: list[Measurement] = []
    with show({"align": several, "sequences": len(joined), "known warps": len(takes)}) as advance:
        _load_kernels(library, pairs)
        for action, of_action in pairs.items():
            for pair in of_action:
                motions = [library.read(one) for one in pair]
                rows += _measure(TAKES, action, pair, motions, library)
                rows += _measure(SETTINGS, action, pair, motions, library, WITH_SETTINGS)
                advance("align")
        for together in joined:
            sides = [_joined([library.read(pair[side]) for pair in together], library) for side in (0, 1)]
            moving, reference = (" + ".join(pair[side] for pair in together) for side in (0, 1))
            rows += _measure(SEQUENCES, "several", (moving, reference), sides, library)
            advance("sequences")
        for take in takes:
            rows += measure_known(take)
            advance("known warps")
    return Conducted(Measurements(rows), _notes(library, rows, pairs, catalog, seed))


def comparable_pairs(library: Library, draws: int, seed: int) -> dict[str, list[Pair]]:
    """Draw ordered pairs of clips of one action and with the same joints.

    Parameters
    ----------
    library : Library
        Of which to draw; of more than 200 clips of one action and rig, 200 are drawn first.
    draws : int
        Pairs of every action; all, where there are fewer.
    seed : int
        Of NumPy's PCG64. More draws keep the first ones.

    Returns
    -------
    dict of str to list of Pair
        By action, six at most of those that have some: pairs of two people first, where subjects are known.
    """
    clips = library.clips
    who = dict(zip(clips.clip_ids, clips.classes if clips.subjects is None else clips.subjects, strict=True))
    possible = comparable_by_action(_comparable(library), seed)
    drawn = {}
    for place in np.sort(np.random.default_rng(seed).permutation(len(possible))[:MOST_ACTIONS]).tolist():
        action, pairs = list(possible.items())[place]
        order = np.random.default_rng([seed, place]).permutation(len(pairs))
        shuffled = [pairs[one] for one in order]
        drawn[action] = sorted(shuffled, key=lambda pair: who[pair[0]] == who[pair[1]])[:draws]
    return drawn


def pairs_to_join(library: Library, pairs: Mapping[str, list[Pair]]) -> list[list[Pair]]:
    """Put together, rig by rig, the first pairs of the actions, then the second ones, two or more each."""
    by_rig: dict[frozenset[str], dict[str, list[Pair]]] = {}
    for action, of_action in pairs.items():
        for pair in of_action:
            rig = by_rig.setdefault(frozenset(library.joints[pair[0]]), {})
            rig.setdefault(action, []).append(pair)
    together = [
        [of_action[k] for of_action in actions.values() if k < len(of_action)]
        for actions in by_rig.values()
        for k in range(max(map(len, actions.values())))
    ]
    return [some for some in together if len(some) > 1]


def _comparable(library: Library) -> dict[Group, list[str]]:
    """List the clips of every action and rig that has two or more, by action and by first clip."""
    groups: dict[Group, list[str]] = {}
    for clip_id, action in zip(library.clips.clip_ids, library.clips.classes.tolist(), strict=True):
        if clip_id in library.joints:
            groups.setdefault((action, frozenset(library.joints[clip_id])), []).append(clip_id)
    several = ((group, ids) for group, ids in groups.items() if len(ids) > 1)
    return dict(sorted(several, key=lambda found: found[0][0]))


def _embedded() -> Library:
    takes = {take.path: take for take in known_takes(synthetic_library())}
    clips = LabelledClips(
        list(takes),
        np.array([take.action for take in takes.values()], dtype=object),
        np.array([take.subject for take in takes.values()], dtype=object),
    )
    joints = {path: take.motion.skeleton.names for path, take in takes.items()}
    return Library(clips, joints, lambda path: takes[path].motion, TEMPLATE_FPS, ())


def _catalogued(catalog: Catalog, label_column: str) -> Library:
    clips = labelled_clips(catalog, label_column)
    rows = catalog.sql(
        "select clip_id, skeleton.joints as joints from clips where format <> 'c3d'"
    ).to_pylist()
    joints = {row["clip_id"]: tuple(row["joints"]) for row in rows}
    features = catalog.config.features
    return Library(clips, joints, catalog.motion, features.frame_rate, features.conventions)


def _measure(
    part: str,
    action: str,
    pair: Pair,
    motions: Sequence[Motion],
    library: Library,
    methods: Mapping[str, Method] = METHODS,
) -> list[Measurement]:
    moving, reference = motions
    return measure_pair(part, action, pair, moving, reference, library.rate, library.conventions, methods)


def _load_kernels(library: Library, pairs: dict[str, list[Pair]]) -> None:
    """Align a pair once for nothing: what is compiled takes its time when it is first called."""
    action, (pair, *_) = next(iter(pairs.items()))
    _measure("", action, pair, [library.read(one) for one in pair], library)


def _joined(motions: Sequence[Motion], library: Library) -> Motion:
    """Show motions of the same joints one after another, at the library's rate."""
    first, *others = (at_rate(motion, library.rate) for motion in motions)
    order = [[one.skeleton.index(name) for name in first.skeleton.names] for one in others]
    turned = [one.rotations[:, joints] for one, joints in zip(others, order, strict=True)]
    return replace(
        first,
        root_position=np.concatenate([first.root_position, *(one.root_position for one in others)]),
        rotations=np.concatenate([first.rotations, *turned]),
    )


def _notes(
    library: Library,
    rows: Sequence[Measurement],
    pairs: Mapping[str, list[Pair]],
    catalog: Catalog | None,
    seed: int,
) -> list[str]:
    where = "the embedded library" if catalog is None else catalog.store.url
    joined = len({(row.moving, row.reference) for row in rows if row.part == SEQUENCES})
    actions = len(set(library.clips.classes.tolist()))
    return [
        f"Pairs of takes: {sum(map(len, pairs.values()))}, of {len(pairs)} of {actions} actions; of "
        f"sequences of takes joined: {joined}. Of {where}, seed {seed}, at {library.rate:g} frames a second."
    ]
