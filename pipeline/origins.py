"""Where rows of a batch or a tile can be had without computing them: see `motionary.pipeline.layout`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from motionary.pipeline.layout import Clip, Earlier, Layout, Place


class Origin(NamedTuple):
    """Where rows can be had: a batch of the earlier run, or one of this run that comes before.

    Parameters
    ----------
    earlier : bool
    batch : int
    """

    earlier: bool
    batch: int


class PairOrigin(NamedTuple):
    """Where pairs can be had: the tile of two sides.

    Parameters
    ----------
    earlier : bool
        Whether it is the earlier run's.
    sides : tuple of int
        The smaller first.
    """

    earlier: bool
    sides: tuple[int, int]


@dataclass(frozen=True)
class Block:
    """Pairs that can be had elsewhere: all of some clips with some others.

    Parameters
    ----------
    origin : PairOrigin
    first, second : mapping of str to str
        Of clips of a tile's first and second side, what they are called there.
    """

    origin: PairOrigin
    first: Mapping[str, str]
    second: Mapping[str, str]


def clip_origins(batch: int, layout: Layout, earlier: Earlier) -> dict[Origin, dict[str, str]]:
    """Say where the clips of a batch can be had.

    Returns
    -------
    dict of Origin to dict
        What each clip is called there. Those that are not listed are to be read.
    """
    found: dict[Origin, dict[str, str]] = {}
    for clip in layout.batches[batch]:
        before, own = earlier.places.get(clip.key), layout.places[clip.key]
        if before is not None:
            found.setdefault(Origin(True, before.number), {})[clip.clip_id] = before.clip_id
        elif own.number < batch:
            found.setdefault(Origin(False, own.number), {})[clip.clip_id] = own.clip_id
    return found


def pair_origins(tile: tuple[int, int], layout: Layout, earlier: Earlier) -> list[Block]:
    """Say where the pairs of a tile can be had; those that are in no block are to be computed."""
    first, second = (layout.sides[side] for side in tile)
    blocks = []
    for one, ones in _by_earlier_side(first, earlier).items():
        for other, others in _by_earlier_side(second, earlier).items():
            if one is not None and other is not None:
                blocks.append(_block(True, one, other, ones, others, earlier.side_places))
            else:
                blocks += _own_blocks(tile, ones, others, layout)
    return blocks


def _own_blocks(
    tile: tuple[int, int], ones: Sequence[Clip], others: Sequence[Clip], layout: Layout
) -> Iterator[Block]:
    """Find the pairs of contents that a tile before this one compares."""
    for one, some in _by_own_side(ones, layout).items():
        for other, more in _by_own_side(others, layout).items():
            if (min(one, other), max(one, other)) != tile:
                yield _block(False, one, other, some, more, layout.side_places)


def _block(
    earlier: bool,
    one: int,
    other: int,
    ones: Sequence[Clip],
    others: Sequence[Clip],
    places: Mapping[str, Place],
) -> Block:
    first, second = ({clip.clip_id: places[clip.key].clip_id for clip in clips} for clips in (ones, others))
    return Block(PairOrigin(earlier, (min(one, other), max(one, other))), first, second)


def _by_earlier_side(clips: Sequence[Clip], earlier: Earlier) -> dict[int | None, list[Clip]]:
    groups: dict[int | None, list[Clip]] = {}
    for clip in clips:
        place = earlier.side_places.get(clip.key)
        groups.setdefault(None if place is None else place.number, []).append(clip)
    return groups


def _by_own_side(clips: Sequence[Clip], layout: Layout) -> dict[int, list[Clip]]:
    groups: dict[int, list[Clip]] = {}
    for clip in clips:
        groups.setdefault(layout.side_places[clip.key].number, []).append(clip)
    return groups
