"""A library laid out for the work, and where each of its contents can be had without computing it again.

A clip's *key* is a digest of its bytes and of all that reading it depends on. Equal keys mean equal contents,
whatever the clips are called: a clip that was renamed, or that lies in the library twice, is computed once.

Pairs are compared by tiles, each of two *sides*: some hundreds of clips, the more the larger the library, so
that there are not too many tiles. A side is read and aligned in *batches*, a few dozen clips whose frames fit
into memory together.

Clips stay on the side that they are on, so that what is stored of it stays as it is; new ones join a small
last side or make sides of their own. Sides that clips left are laid out anew when they have become many.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate, pairwise
from math import isqrt
from pathlib import Path
from typing import Any, NamedTuple

from motionary.pipeline.readers.amc import rate_in_name
from motionary.pipeline.readers.library import Source

BATCH = 32
"""Clips of a batch, about; twice that at most."""


class Place(NamedTuple):
    """A clip of a batch, or of a side, by its number."""

    number: int
    clip_id: str


@dataclass(frozen=True)
class Earlier:
    """A published run, as far as another one can build upon it.

    Parameters
    ----------
    snapshot_id : str
        Empty where there is none.
    batches, sides : sequences of mapping
        Of each batch or side, the key of every clip, readable or not, in order.
    digests : mapping of str to str
        Of every clip's bytes.
    retry : collection of str
        Clips that could not be read for a reason that may pass.
    results : mapping of str to sequence of str
        Of each stage, the keys of its results, in the order of its tasks.
    settings : mapping of str to str
        Of each stage, the digest of its version and settings.
    side : int
        What its sides were cut by.
    """

    snapshot_id: str = ""
    batches: Sequence[Mapping[str, str]] = ()
    sides: Sequence[Mapping[str, str]] = ()
    digests: Mapping[str, str] = field(default_factory=dict)
    retry: Collection[str] = ()
    results: Mapping[str, Sequence[str]] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    side: int = 0

    @cached_property
    def keys(self) -> dict[str, str]:
        """Of every clip, its key."""
        return {clip_id: key for batch in self.batches for clip_id, key in batch.items()}

    @cached_property
    def places(self) -> dict[str, Place]:
        """Of every key, one of the clips that have it, and its batch."""
        return _first_places(self.batches)

    @cached_property
    def side_places(self) -> dict[str, Place]:
        """Of every key, one of the clips that have it, and its side."""
        return _first_places(self.sides)

    def tile(self, first: int, second: int) -> int:
        """Return the place of a tile among the results of comparing, the first side not after the second."""
        return first * len(self.sides) - first * (first - 1) // 2 + second - first

    def names_of(self, digests: Mapping[str, str]) -> dict[str, str]:
        """Say of every clip that was there what it was called: its name, or that of its bytes if renamed.

        Parameters
        ----------
        digests : mapping of str to str
            Of the clips that are there now.
        """
        gone: dict[str, list[str]] = {}
        for clip_id in sorted(self.digests.keys() - digests.keys(), reverse=True):
            gone.setdefault(self.digests[clip_id], []).append(clip_id)
        names = {}
        for clip_id, digest in digests.items():
            if clip_id in self.digests:
                names[clip_id] = clip_id
            elif digest and gone.get(digest):
                names[clip_id] = gone[digest].pop()
        return names


@dataclass(frozen=True)
class Clip:
    """A clip of a library and the key of its content."""

    source: Source
    key: str

    @property
    def clip_id(self) -> str:
        """Its name."""
        return self.source.clip_id


@dataclass(frozen=True)
class Layout:
    """The clips of a library by sides, and each side by batches; in each, in clip_id order.

    Parameters
    ----------
    cut : sequence of sequence of sequence of Clip
        The batches of every side.
    """

    cut: Sequence[Sequence[Sequence[Clip]]]

    @cached_property
    def sides(self) -> list[list[Clip]]:
        """The clips of every side."""
        return [[clip for batch in side for clip in batch] for side in self.cut]

    @cached_property
    def batches(self) -> list[Sequence[Clip]]:
        """The batches of all sides, one side after the other."""
        return [batch for side in self.cut for batch in side]

    @cached_property
    def batches_of_side(self) -> list[range]:
        """The numbers of every side's batches."""
        ends = [0, *accumulate(map(len, self.cut))]
        return [range(*two) for two in pairwise(ends)]

    @cached_property
    def digests(self) -> dict[str, str]:
        """Of every clip, the digest of its bytes."""
        return {clip.clip_id: clip.source.digest for clip in self}

    @cached_property
    def keys(self) -> dict[str, str]:
        """Of every clip, its key."""
        return {clip.clip_id: clip.key for clip in self}

    @cached_property
    def places(self) -> dict[str, Place]:
        """Of every key, the first clip that has it, and its batch."""
        return _first_places([{clip.clip_id: clip.key for clip in batch} for batch in self.batches])

    @cached_property
    def side_places(self) -> dict[str, Place]:
        """Of every key, the first clip that has it, and its side."""
        return _first_places([{clip.clip_id: clip.key for clip in side} for side in self.sides])

    def __iter__(self) -> Iterator[Clip]:
        return (clip for batch in self.batches for clip in batch)


def side_for(clips: int, earlier: Earlier) -> int:
    """Choose how many clips a side has: few enough that a tile fits into memory, else so many that it pays.

    That is 32 up to 113 clips, 512 for 10,000 and 1,024, the most, from 29,128. The earlier run's is kept
    while it is not off by more than a factor of two.
    """
    side = 1 << (min(max(32, isqrt(36 * clips)), 1024).bit_length() - 1)
    return earlier.side if side <= 2 * earlier.side <= 4 * side else side


def lay_out(sources: Sequence[Source], reading: Any, size: int, earlier: Earlier) -> Layout:
    """Give every clip its key, its side and its batch.

    Parameters
    ----------
    sources : sequence of Source
        In clip_id order.
    reading : JSON value
        What the content of a clip depends on beside its files.
    size : int
        Clips of a side, about; see `side_for`.
    earlier : Earlier
        A clip that could not be read there for a reason that may pass gets another key, so that it is read
        again.
    """
    same_reading = earlier.settings.get("ingest") == digest_of_settings(reading)

    def key(source: Source) -> str:
        unchanged = same_reading and earlier.digests.get(source.clip_id) == source.digest
        if unchanged and source.clip_id not in earlier.retry:
            return earlier.keys[source.clip_id]
        again = earlier.snapshot_id if unchanged else None
        return digest_of_settings(reading, source.digest, source.format, _named(source), again)

    clips = {source.clip_id: Clip(source, key(source)) for source in sources}
    names = earlier.names_of({source.clip_id: source.digest for source in sources})
    there = {before: now for now, before in names.items()}
    stored = [sorted(there[one] for one in side if one in there) for side in earlier.sides]
    sides = _sides([*clips], stored if earlier.side == size else [], size)
    return Layout(
        [
            [[clips[clip_id] for clip_id in batch] for batch in cut_by_name(side, min(size, BATCH))]
            for side in sides
        ]
    )


def _named(source: Source) -> Any:
    """Return what reading a clip takes from its name and place."""
    alone = source.format == "asf/amc" and len(source.files) == 1  # the files beside it say why it is refused
    if alone or not source.digest:
        return source.clip_id
    return rate_in_name(Path(source.path).stem) if source.format == "asf/amc" else None


def _sides(clip_ids: Sequence[str], stored: Sequence[Sequence[str]], size: int) -> list[list[str]]:
    """Lay clips out around those that are stored together, which stay so."""
    sides = [list(side) for side in stored if side]
    if len(sides) > 2 + 2 * len(clip_ids) // size:
        sides = []
    placed = {one for side in sides for one in side}
    new = [one for one in clip_ids if one not in placed]
    if new and sides and len(sides[-1]) < size // 2:
        new = sorted([*new, *sides.pop()])
    return sides + cut_by_name(new, size)


def digest_of_settings(*settings: Any) -> str:
    """Digest JSON values, 128 bits, in hexadecimal."""
    about = json.dumps(settings, sort_keys=True)
    return hashlib.blake2b(about.encode(), digest_size=16).hexdigest()


def cut_by_name(clip_ids: Sequence[str], size: int) -> list[list[str]]:
    """Cut clips into runs of about `size`, half as many more at most.

    From half the size on, a run ends after a clip whose name says so, by its digest. So a clip that comes or
    goes after a job that was killed changes its own run and maybe the next ones, not all that follow, and the
    results of the others are found again.
    """
    runs: list[list[str]] = [[]]
    for clip_id in clip_ids:
        runs[-1].append(clip_id)
        drawn = int.from_bytes(hashlib.blake2b(clip_id.encode(), digest_size=8).digest())
        length, half = len(runs[-1]), (size + 1) // 2
        if length >= size + size // 2 or (length >= half and drawn % max(half, 2) == 0):
            runs.append([])
    return [run for run in runs if run]


def _first_places(groups: Sequence[Mapping[str, str]]) -> dict[str, Place]:
    places: dict[str, Place] = {}
    for number, clips in enumerate(groups):
        for clip_id, key in clips.items():
            places.setdefault(key, Place(number, clip_id))
    return places
