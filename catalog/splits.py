"""Clips shared out among parts, such as train and test, a whole group at a time.

Groups are what must not be parted: see `motionary.catalog.kept_together`. The part of the smallest share is
filled first, then the next, and what is left is the last one's. Each gets as near to its share of the *clips*
(not of their seconds) as whole groups of those left allow, exactly, and at least one group.

Many choices of groups are equally near. A hash of the seed and the group's name lays the groups in an order
that nothing else changes, and says where each would like to go; of the nearest choices the one is taken that
puts the fewest clips elsewhere, and of groups of one size those first in that order. So clips that are added
to a library move few others while groups are small; where a few large ones make up a part, whole groups may
change places. Equal clips always give equal parts, in whatever order they come.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b

from motionary.catalog.errors import CatalogError
from motionary.catalog.export_choice import rows_of
from motionary.catalog.kept_together import kept_together
from motionary.catalog.query import Catalog
from motionary.catalog.subset_sum import nearest_counts

_PART = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


@dataclass(frozen=True)
class Split:
    """Clips shared out among parts.

    Parameters
    ----------
    shares : mapping of str to float
        What was asked for.
    columns : tuple of str
        Clips that agree in one of them are in one part.
    shared_frames : bool
        So are clips that share a frame.
    seed : int
    part_of : mapping of str to str
        Each clip's part.
    groups : mapping of str to int
        Of every part, how many groups of clips that must not be parted it has.
    without : int
        Clips that have no value in one of the columns.
    recordings : int
        Groups by bytes, and by shared frames where these count.
    """

    shares: Mapping[str, float]
    columns: tuple[str, ...]
    shared_frames: bool
    seed: int
    part_of: Mapping[str, str]
    groups: Mapping[str, int]
    without: int
    recordings: int


def split_clips(
    catalog: Catalog,
    clip_ids: Sequence[str],
    shares: Mapping[str, float],
    columns: Sequence[str] = (),
    shared_frames: bool = True,
    seed: int = 0,
) -> Split:
    """Share clips out among parts and part no recording and, where columns say which there are, no subject.

    Parameters
    ----------
    catalog : Catalog
    clip_ids : sequence of str
    shares, columns, shared_frames, seed
        Those of `Split`.

    Raises
    ------
    CatalogError
        The shares are none, there is no such column, or there are fewer groups than parts.
    """
    check_shares(shares)
    clips = rows_of(catalog.clips.to_arrow(), clip_ids)
    together = kept_together(catalog, clips, columns, shared_frames)
    parts = parts_of(together.groups, shares, seed)
    groups = Counter(part for part, _ in set(zip(parts, together.groups, strict=True)))
    return Split(
        dict(shares),
        tuple(columns),
        shared_frames,
        seed,
        dict(zip(clip_ids, parts, strict=True)),
        {part: groups[part] for part in shares},
        together.without,
        together.recordings,
    )


def read_shares(text: str) -> dict[str, float]:
    """Read `train=.8,test=.2`.

    Raises
    ------
    CatalogError
        It is not written so, or the shares are none; see `check_shares`.
    """
    shares: dict[str, float] = {}
    for one in text.split(","):
        name, equals, share = (word.strip() for word in one.partition("="))
        try:
            number = float(share)
        except ValueError:
            equals = ""
        if not equals:
            raise CatalogError(f"split {text!r}: {one.strip()!r} is not NAME=SHARE, as in train=.8,test=.2")
        if name in shares:
            raise CatalogError(f"split {text!r} names {name!r} twice")
        shares[name] = number
    check_shares(shares)
    return shares


def check_shares(shares: Mapping[str, float]) -> None:
    """Check that parts are folders that differ everywhere, and that their shares make up the whole.

    Raises
    ------
    CatalogError
        They do not.
    """
    for name, share in shares.items():
        if not _PART.fullmatch(name):
            raise CatalogError(
                f"part {name!r} of the split is to be a folder: write letters, digits, _ and - only"
            )
        if not 0 < share < 1:
            raise CatalogError(f"part {name!r} of the split has share {share:g}; it must be between 0 and 1")
    if len({name.casefold() for name in shares}) < max(len(shares), 2):
        raise CatalogError(f"the split has {', '.join(shares) or 'no parts'}; it needs two parts that differ")
    if abs(math.fsum(shares.values()) - 1) > 1e-6:
        raise CatalogError(f"the shares of the split add up to {math.fsum(shares.values()):g} instead of 1")


def parts_of(groups: Sequence[str], shares: Mapping[str, float], seed: int = 0) -> list[str]:
    """Say to which part each clip goes.

    Parameters
    ----------
    groups : sequence of str
        Each clip's group.
    shares : mapping of str to float
        Of each part; see `check_shares`.
    seed : int
        Another one gives another choice.

    Returns
    -------
    list of str
        Each clip's part.

    Raises
    ------
    CatalogError
        There are fewer groups than parts.
    """
    check_shares(shares)
    sizes = Counter(groups)
    if len(sizes) < len(shares):
        raise CatalogError(
            f"the clips make {len(sizes)} group{'s' if len(sizes) > 1 else ''} that must not be parted, "
            f"too few for the {len(shares)} parts {', '.join(shares)}"
        )
    places = {group: _place(group, seed) for group in sizes}
    left = sorted(sizes, key=lambda group: (places[group], group))
    names = sorted(shares, key=lambda name: (shares[name], name))
    part_of: dict[str, str] = {}
    until = 0.0
    for after, name in zip(range(len(names) - 1, 0, -1), names, strict=False):
        until += shares[name]
        by_size = Counter(sizes[group] for group in left)
        liked = Counter(sizes[group] for group in left if places[group] < until)
        counts = nearest_counts(by_size, liked, shares[name] * len(groups), after)
        for group in left:
            if counts.get(sizes[group], 0) > 0:
                counts[sizes[group]] -= 1
                part_of[group] = name
        left = [group for group in left if group not in part_of]
    return [part_of.get(group, names[-1]) for group in groups]


def _place(group: str, seed: int) -> float:
    """Lay a group between 0 and 1, evenly over all groups."""
    digest = blake2b(f"{seed}\0{group}".encode(errors="surrogatepass"), digest_size=8).digest()
    return int.from_bytes(digest, "big") / 2**64
