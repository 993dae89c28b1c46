"""Which joint of a file is the pelvis, and what stands above it.

From the file's root the search goes down while a joint has exactly one child joint. It ends at the first
joint that branches, or earlier at one whose name ends in hip, hips or pelvis as a word of its own
(`mixamorig:Hips`, `Bip01 Pelvis`, but not `LHip`). What it passed (joint_Root, RL_BoneRoot, Reference,
Armature) is to be composed into the pelvis. A skeleton that never branches keeps its root.

Unreal hangs control joints beside the pelvis (`ik_foot_root`, `interaction`, ...). They are no part of the
body: the search looks past them and they are left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

_PELVIS_NAME = re.compile(r"(^|[^a-z])(hips?|pelvis)$", re.IGNORECASE)
_CONTROL_NAME = re.compile(r"ik_|interaction$|center_of_mass$", re.IGNORECASE)


@dataclass(frozen=True)
class PelvisTree:
    """The skeleton from the pelvis down.

    Parameters
    ----------
    chain : list of int
        File's joints from its root down to the pelvis, both included.
    kept : list of int
        File's joints that remain, the pelvis first.
    parents : tuple of int
        Of the joints that remain, by their new index; -1 for the pelvis.
    notes : list of str
        What was composed or left out.
    """

    chain: list[int]
    kept: list[int]
    parents: tuple[int, ...]
    notes: list[str]


def find_pelvis(names: Sequence[str], parents: Sequence[int]) -> PelvisTree:
    """Find the pelvis and number the joints from it down.

    Parameters
    ----------
    names : sequence of str
    parents : sequence of int
        -1 for the first; parents before children.
    """
    children: list[list[int]] = [[] for _ in names]
    for joint, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(joint)
    chain = [0]
    while not _PELVIS_NAME.search(names[chain[-1]]):
        body = [j for j in children[chain[-1]] if not _CONTROL_NAME.match(names[j])]
        if len(body) == 0:
            chain = [0]  # it never branched
        if len(body) != 1:
            break
        chain.append(body[0])
    new_index = {chain[-1]: 0}
    for joint, parent in enumerate(parents):
        if parent in new_index:
            new_index[joint] = len(new_index)
    kept = list(new_index)
    new_parents = tuple(new_index.get(parents[j], -1) for j in kept)
    return PelvisTree(chain, kept, new_parents, _notes(names, chain, kept))


def _notes(names: Sequence[str], chain: list[int], kept: list[int]) -> list[str]:
    notes = []
    if len(chain) > 1:
        above = ", ".join(names[j] for j in chain[:-1])
        notes.append(f"composed into the pelvis {names[chain[-1]]!r}: {above}")
    gone = [names[j] for j in sorted(set(range(len(names))) - set(chain) - set(kept))]
    if gone:
        notes.append(f"left out beside the pelvis: {', '.join(gone)}")
    return notes
