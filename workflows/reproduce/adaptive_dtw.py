"""Experiment of adaptive DTW: what constraints do to a path, on one's own catalog or the embedded library.

**[ADTW]** Heloir, Courty, Gibet, Multon, *Temporal alignment of communicative gesture sequences*. The paper
aligns records of one long sequence of signs, a minute each, to the first of them, and shows what comes out as
curves: it prints no number. Here two takes of one action are aligned, by two people where that is known; and
sequences made of takes: the moving takes of every action's first pair joined one after another, and the
references of these pairs likewise, then those of the second pairs, and so on. Where takes meet, the joined
motion leaps. Only clips whose joints have the same names can be compared, and clips of markers not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
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
from motionary.workflows.reproduce.cotw_measures import Measurement, Measurements, known_takes
from motionary.workflows.reproduce.dtw_curve import Show
from motionary.workflows.reproduce.labelled import LabelledClips, labelled_clips
from motionary.workflows.reproduce.pairs import Pair, draw_actions

_ALL = 1_000_000  # draws: every pair, so that enough are left of those that can be compared


@dataclass(frozen=True, eq=False)
class AdaptiveExperiment:
    """The measurements, and what they were made on."""

    study: Measurements
    notes: list[str]


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
) -> AdaptiveExperiment:
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
    rows: list[Measurement] = []
    with show({"align": several, "sequences": draws, "known warps": len(takes)}) as advance:
        _load_kernels(library, pairs)
        for action, of_action in pairs.items():
            for pair in of_action:
                motions = [library.read(one) for one in pair]
                rows += _measure(TAKES, action, pair, motions, library)
                rows += _measure(SETTINGS, action, pair, motions, library, WITH_SETTINGS)
                advance("align")
        for k in range(draws):
            for together in _of_one_rig([of[k] for of in pairs.values() if k < len(of)], library):
                sides = [_joined([library.read(pair[side]) for pair in together], library) for side in (0, 1)]
                ends = (" + ".join(pair[side] for pair in together) for side in (0, 1))
                rows += _measure(SEQUENCES, "all", (next(ends), next(ends)), sides, library)
            advance("sequences")
        for take in takes:
            rows += measure_known(take)
            advance("known warps")
    return AdaptiveExperiment(Measurements(rows), _notes(library, rows, several, catalog, seed))


def comparable_pairs(library: Library, draws: int, seed: int) -> dict[str, list[Pair]]:
    """Draw pairs of clips with the same joints, for each action that has some."""
    found = {}
    for action in draw_actions(library.clips, _ALL, seed):
        every = next(iter(action.pairs.values()))
        alike = [
            pair
            for pair in every
            if all(one in library.joints for one in pair)
            and set(library.joints[pair[0]]) == set(library.joints[pair[1]])
        ]
        if alike:
            found[action.name] = alike[:draws]
    return found


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


def _of_one_rig(pairs: Sequence[Pair], library: Library) -> Iterator[list[Pair]]:
    """Part pairs by the names of their joints, and pass over what stands alone."""
    groups: dict[frozenset[str], list[Pair]] = {}
    for pair in pairs:
        groups.setdefault(frozenset(library.joints[pair[0]]), []).append(pair)
    return (group for group in groups.values() if len(group) > 1)


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
    library: Library, rows: Sequence[Measurement], pairs: int, catalog: Catalog | None, seed: int
) -> list[str]:
    where = "the embedded library" if catalog is None else catalog.store.url
    joined = len({row.moving for row in rows if row.part == SEQUENCES})
    return [
        f"{pairs} pairs of takes and {joined} sequences of takes joined, of {where}, seed {seed}, at "
        f"{library.rate:g} frames a second."
    ]
