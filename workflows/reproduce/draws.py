"""Seeded draws of clips: six classes at most, their sizes by a rule.

    6-20        each class gives a number of clips drawn from 6 to 20
    paper       11, 6, 7, 17, 20 and 19 clips, the sizes of [DC] 6, in an order drawn anew each time
    one large   one class, drawn, gives 20 clips and the others 5 each
    whole       every labelled clip of the catalog; one set, not a draw

A class that has fewer clips gives all it has, so the sizes of a small catalog are nearer to each other than
the rule says. Only classes of at least 6 clips are drawn from.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

RULES = ("6-20", "paper", "one large")
WHOLE = "whole"

MOST_CLASSES = 6
LEAST, MOST = 6, 20
PAPER_SIZES = (11, 6, 7, 17, 20, 19)
OTHERS = 5


def drawable_classes(classes: Sequence[str] | NDArray[np.object_]) -> list[str]:
    """Return, sorted, the classes that have enough clips to be drawn from."""
    names, counts = np.unique(np.asarray(classes, dtype=str), return_counts=True)
    return [str(name) for name in names[counts >= LEAST]]


def draw(classes: Sequence[str] | NDArray[np.object_], rule: str, seed: int, number: int) -> NDArray[np.intp]:
    """Draw one set of clips.

    Parameters
    ----------
    classes : sequence of str (N,)
        Class of every clip.
    rule : str
        One of `RULES`, or `WHOLE`.
    seed, number : int
        The study's seed, and which of its draws this is. A draw depends on these and the rule alone, not on
        how many others are made.

    Returns
    -------
    array (n,) of int
        Places of the drawn clips, ascending.

    Raises
    ------
    ValueError
        No such rule, or fewer than two classes have enough clips.
    """
    values = np.asarray(classes, dtype=str)
    if rule == WHOLE:
        return np.arange(len(values))
    if rule not in RULES:
        raise ValueError(f"rule is {rule!r}; it must be one of {', '.join((*RULES, WHOLE))}")
    names = drawable_classes(values)
    if len(names) < 2:
        raise ValueError(f"{len(names)} classes have {LEAST} clips or more; a draw needs 2")
    rng = np.random.default_rng([seed, RULES.index(rule), number])
    chosen = rng.permutation(names)[:MOST_CLASSES]
    members = [np.flatnonzero(values == name) for name in chosen]
    drawn = [
        rng.choice(inside, min(size, len(inside)), replace=False)
        for inside, size in zip(members, _sizes(rule, len(chosen), rng), strict=True)
    ]
    return np.sort(np.concatenate(drawn))


def _sizes(rule: str, count: int, rng: np.random.Generator) -> list[int]:
    if rule == "6-20":
        return rng.integers(LEAST, MOST + 1, count).tolist()
    if rule == "paper":
        return rng.permutation(PAPER_SIZES)[:count].tolist()
    # The classes stand in drawn order already, so the first is as good as any.
    return [MOST] + [OTHERS] * (count - 1)
