"""Seeded draws of pairs: six actions at most, and of each some pairs of clips to align.

Pairs are of two people and of one, where the subject of every clip is known and two actions have such pairs;
else of any two clips.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from motionary.workflows.reproduce.labelled import LabelledClips

MOST_ACTIONS = 6
MOST_CLIPS = 200  # of an action; among more, these are drawn first
MOST_MEMBERS = 15  # that a reference is sought among, as in [CoTW] Figure 10

TWO_PEOPLE, ONE_PERSON, ANYONE = "two people", "one person", "any two clips"

Pair = tuple[str, str]
"""Names of the moving clip and of the reference."""


@dataclass(frozen=True)
class Action:
    """What is drawn of one action.

    Parameters
    ----------
    name : str
        The label.
    pairs : mapping of str to list of Pair
        By whose clips they are. All actions have the same kinds, but not all need have pairs of each.
    members : list of str
        Clips to find a reference among.
    """

    name: str
    pairs: Mapping[str, list[Pair]]
    members: list[str]

    def __iter__(self) -> Iterator[tuple[str, Pair]]:
        """Go through all pairs, each with whose it is."""
        return ((people, pair) for people, pairs in self.pairs.items() for pair in pairs)


def draw_actions(clips: LabelledClips, draws: int, seed: int) -> list[Action]:
    """Draw actions of two clips or more, and pairs of their clips.

    Parameters
    ----------
    clips : LabelledClips
        Whatever is labelled.
    draws : int
        Pairs of each action and kind; all, where there are fewer.
    seed : int
        Of NumPy's PCG64. More draws keep the first ones.

    Returns
    -------
    list of Action
        By name.
    """
    counts = Counter(clips.classes.tolist())
    several = sorted(name for name, count in counts.items() if count > 1)
    chosen = sorted(np.random.default_rng(seed).permutation(several)[:MOST_ACTIONS].tolist())
    actions = [_draw_action(clips, name, draws, [seed, several.index(name)]) for name in chosen]
    known = () if clips.subjects is None else (TWO_PEOPLE, ONE_PERSON)
    kinds = [kind for kind in known if sum(bool(action.pairs[kind]) for action in actions) > 1] or [ANYONE]
    return [replace(action, pairs={kind: action.pairs[kind] for kind in kinds}) for action in actions]


def comparable_by_action(groups: Mapping[Any, Sequence[str]], seed: int) -> dict[str, list[Pair]]:
    """List the ordered pairs of clips that can be compared.

    Parameters
    ----------
    groups : mapping of (action, what must be the same) to sequence of str
        Names of clips; of more than 200 in a group, 200 are drawn first.
    seed : int
        Of NumPy's PCG64.

    Returns
    -------
    dict of str to list of Pair
        By action.
    """
    possible: dict[str, list[Pair]] = {}
    for place, ((action, _), ids) in enumerate(groups.items()):
        some = np.sort(np.random.default_rng([seed, place]).permutation(len(ids))[:MOST_CLIPS])
        chosen = [ids[one] for one in some]
        pairs = [(one, other) for one in chosen for other in chosen if one != other]
        possible.setdefault(action, []).extend(pairs)
    return possible


def _draw_action(clips: LabelledClips, name: str, draws: int, seed: list[int]) -> Action:
    inside = np.flatnonzero(clips.classes == name)
    inside = np.sort(np.random.default_rng(seed).permutation(inside)[:MOST_CLIPS])
    members = np.sort(np.random.default_rng(seed).permutation(inside)[:MOST_MEMBERS])
    others = ~np.eye(len(inside), dtype=bool)
    who = inside if clips.subjects is None else clips.subjects[inside]
    same = who[:, None] == who
    allowed = {TWO_PEOPLE: ~same, ONE_PERSON: same & others, ANYONE: others}
    pairs = {}
    for people, table in allowed.items():
        possible = inside[np.argwhere(table)]
        drawn = np.random.default_rng(seed).permutation(len(possible))[:draws]
        pairs[people] = [(clips.clip_ids[one], clips.clip_ids[other]) for one, other in possible[drawn]]
    return Action(name, pairs, [clips.clip_ids[one] for one in members])
