"""What the FP-DTW experiment aligns: ordered pairs of takes of one action, as rotations at a rate.

Rotations compare between takes of the same joint names only, and a rate can be tested honestly only on takes
that were recorded at it or above: what lies between the frames of a slower one would be made up. So the
highest of `RATES` at which some action has two such takes sets which takes are tested, at every rate the same
ones, and the others are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from motionary.catalog import Catalog
from motionary.pipeline.canonical import Convention
from motionary.pipeline.joint_rotations import bone_directions, joint_rotations
from motionary.pipeline.motion import FloatArray, Motion
from motionary.pipeline.synthetic import ACTIONS, BODIES, CONVENTIONS, STYLES
from motionary.pipeline.synthetic.library import perform_take
from motionary.pipeline.synthetic.styles import personal
from motionary.workflows.errors import UserError
from motionary.workflows.reproduce.labelled import labelled_clips
from motionary.workflows.reproduce.pairs import Pair, comparable_by_action

RATES = (120, 60)
"""Frames a second, the paper's, the highest first."""

EMBEDDED_TAKES = 2
"""Of each action and style."""

_WHOLE_RATE = 1 - 1e-3  # a frame time printed with few digits (0.0083333) means the whole rate


@dataclass(frozen=True, eq=False)
class TurningClip:
    """A clip as rotations.

    Parameters
    ----------
    rotations : array (frames, J, 4)
        Local unit quaternions of `FP_JOINTS`.
    directions : array (J, 3)
        Along which their bones lie at rest.
    """

    rotations: FloatArray
    directions: FloatArray


@dataclass(frozen=True, eq=False)
class Takes:
    """Takes that can be paired, and how to read one.

    Parameters
    ----------
    groups : mapping of (str, tuple of str) to list of str
        By action and joint names the takes' names, in their order; two or more.
    rates : tuple of int
        At which all were recorded or can be shown.
    motion : callable
        From a take's name to its motion.
    conventions : tuple of Convention
        A user's own.
    note : str
        What they are, and what was left out.
    """

    groups: Mapping[tuple[str, tuple[str, ...]], list[str]]
    rates: tuple[int, ...]
    motion: Callable[[str], Motion]
    conventions: tuple[Convention, ...]
    note: str


def catalog_takes(catalog: Catalog, label_column: str) -> Takes:
    """List the labelled clips of a catalog that can be paired.

    Parameters
    ----------
    catalog : Catalog
        Its motions are read back when they are asked for.
    label_column : str
        The column that holds the actions.

    Raises
    ------
    UserError
        The catalog has no such labels, or no action has two takes of one skeleton at 60 frames a second.
    """
    labelled = labelled_clips(catalog, label_column)
    known = catalog.clips.to_pandas().set_index("clip_id").loc[labelled.clip_ids]
    turning = (known["format"] != "c3d").to_numpy()  # markers have no rotations
    joints = [tuple(skeleton["joints"]) for skeleton in known["skeleton"]]
    for place, rate in enumerate(RATES):
        fast = turning & (known["fps"] >= rate * _WHOLE_RATE).to_numpy()
        found: dict[tuple[str, tuple[str, ...]], list[str]] = {}
        for index in np.flatnonzero(fast):
            key = (labelled.classes[index], joints[index])
            found.setdefault(key, []).append(labelled.clip_ids[index])
        groups = {key: ids for key, ids in sorted(found.items()) if len(ids) > 1}
        if groups:
            return Takes(
                groups,
                RATES[place:],
                catalog.motion,
                catalog.config.features.conventions,
                _catalog_note(groups, label_column, rate, known["fps"].to_numpy(), turning),
            )
    raise UserError(
        f"no action ({label_column}) of {catalog.store.url} has two takes with rotations, of one skeleton, "
        f"recorded at {RATES[-1]} frames a second or more: label such takes, name another column with "
        "--label-column, or leave CATALOG out for the embedded library"
    )


def _catalog_note(
    groups: Mapping[tuple[str, tuple[str, ...]], list[str]],
    label_column: str,
    rate: int,
    fps: FloatArray,
    turning: NDArray[np.bool_],
) -> str:
    used = sum(map(len, groups.values()))
    slow = Counter(round(one, 2) for one in fps[turning & (fps < rate * _WHOLE_RATE)].tolist())
    left_out = [f"{count} recorded at {one:g}" for one, count in sorted(slow.items())]
    if not turning.all():
        left_out.append(f"{int((~turning).sum())} of markers")
    alone = len(fps) - used - sum(slow.values()) - int((~turning).sum())
    if alone:
        left_out.append(f"{alone} alone in their action and skeleton")
    said = (
        f"{used} of {len(fps)} labelled clips, of {len({name for name, _ in groups})} actions "
        f"({label_column}), recorded at {rate} frames a second or more"
    )
    return f"{said}; left out: {', '.join(left_out)}." if left_out else f"{said}."


def embedded_takes(seed: int) -> Takes:
    """Perform takes of the embedded library's actions anew, at the highest of `RATES`.

    The library's own takes are performed at 30 and 60 frames a second. Its actions are curves, so these are
    performed at the rate itself and nothing is interpolated; on one skeleton, none mirrored.
    """
    styles, bodies = tuple(STYLES.values()), tuple(BODIES.values())
    motions: dict[str, Motion] = {}
    groups: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for a, action in enumerate(ACTIONS.values()):
        for s, style in enumerate(styles):
            for number in range(1, EMBEDDED_TAKES + 1):
                rng = np.random.default_rng([seed, a, s, number])
                take = perform_take(
                    action,
                    personal(style, rng),
                    bodies[(a + 2 * s + number) % len(bodies)],
                    CONVENTIONS["mixamo"],
                    fps=float(RATES[0]),
                    is_mirrored=False,
                    start=0.0,
                    number=number,
                    rng=rng,
                )
                motions[take.motion.name] = take.motion
                key = (action.name, take.motion.skeleton.names)
                groups.setdefault(key, []).append(take.motion.name)
    note = (
        f"The embedded library: {len(motions)} takes of {len(groups)} actions in {len(styles)} styles, "
        f"performed at {RATES[0]} frames a second on one skeleton, seed {seed}. They are smooth curves, "
        "without a capture's noise."
    )
    return Takes(dict(sorted(groups.items())), RATES, motions.__getitem__, (), note)


def draw_pairs(takes: Takes, draws: int, seed: int) -> dict[str, list[Pair]]:
    """Draw ordered pairs of takes of one action and one skeleton.

    Parameters
    ----------
    takes : Takes
        Of which to draw; of more than 200 in a group, 200 are drawn first.
    draws : int
        Pairs of every action; all, where there are fewer.
    seed : int
        Of NumPy's PCG64. More draws keep the first ones.

    Returns
    -------
    dict of str to list of Pair
        By action the names of the moving take and of the reference.
    """
    possible = comparable_by_action(takes.groups, seed)
    drawn = {}
    for place, (action, pairs) in enumerate(possible.items()):
        order = np.random.default_rng([seed, place]).permutation(len(pairs))[:draws]
        drawn[action] = [pairs[one] for one in order]
    return drawn


def read_take(takes: Takes, name: str) -> dict[int, TurningClip]:
    """Read a take as rotations at each of the rates."""
    motion = takes.motion(name)
    directions = bone_directions(motion.skeleton, takes.conventions)
    return {
        rate: TurningClip(joint_rotations(motion, rate=rate, conventions=takes.conventions), directions)
        for rate in takes.rates
    }
