"""A library laid out in batches, and where each of its contents can be had without computing it again.

A clip's *key* is a digest of its bytes and of all that reading it depends on. Equal keys mean equal contents,
whatever the clips are called: a clip that was renamed, or that lies in the library twice, is computed once.

Clips stay in the batch that they are in, so that what is stored of it stays as it is; new ones join a small
last batch or make batches of their own. Batches that clips left are laid out anew when they have become many.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from motionary.pipeline.readers.amc import rate_in_name
from motionary.pipeline.readers.library import Source


class Place(NamedTuple):
    """A clip of a batch."""

    batch: int
    clip_id: str


@dataclass(frozen=True)
class Earlier:
    """A published run, as far as another one can build upon it.

    Parameters
    ----------
    snapshot_id : str
        Empty where there is none.
    batches : sequence of mapping
        Of each batch, the key of every clip, readable or not, in order.
    digests : mapping of str to str
        Of every clip's bytes.
    retry : collection of str
        Clips that could not be read for a reason that may pass.
    results : mapping of str to sequence of str
        Of each stage, the keys of its results, in the order of its tasks.
    settings : mapping of str to str
        Of each stage, the digest of its version and settings.
    batch_size : int
        What its batches were cut by.
    """

    snapshot_id: str = ""
    batches: Sequence[Mapping[str, str]] = ()
    digests: Mapping[str, str] = field(default_factory=dict)
    retry: Collection[str] = ()
    results: Mapping[str, Sequence[str]] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    batch_size: int = 0

    @cached_property
    def keys(self) -> dict[str, str]:
        """Of every clip, its key."""
        return {clip_id: key for batch in self.batches for clip_id, key in batch.items()}

    @cached_property
    def places(self) -> dict[str, Place]:
        """Of every key, one of the clips that have it."""
        return _first_places(self.batches)

    def tile(self, first: int, second: int) -> int:
        """Return the place of a tile among the results of comparing, the first batch not after the second."""
        return first * len(self.batches) - first * (first - 1) // 2 + second - first

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
    """The clips of a library in batches; in each, in clip_id order."""

    batches: Sequence[Sequence[Clip]]

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
        """Of every key, the first clip that has it."""
        return _first_places([{clip.clip_id: clip.key for clip in batch} for batch in self.batches])

    def __iter__(self) -> Iterator[Clip]:
        return (clip for batch in self.batches for clip in batch)


def lay_out(sources: Sequence[Source], reading: Any, size: int, earlier: Earlier) -> Layout:
    """Give every clip its key and its batch.

    Parameters
    ----------
    sources : sequence of Source
        In clip_id order.
    reading : JSON value
        What the content of a clip depends on beside its files.
    size : int
        Clips of a batch, about.
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
    stored = [sorted(there[one] for one in batch if one in there) for batch in earlier.batches]
    batches = _batches([*clips], stored if earlier.batch_size == size else [], size)
    return Layout([[clips[clip_id] for clip_id in batch] for batch in batches])


def _named(source: Source) -> Any:
    """Return what reading a clip takes from its name and place."""
    alone = source.format == "asf/amc" and len(source.files) == 1  # the files beside it say why it is refused
    if alone or not source.digest:
        return source.clip_id
    return rate_in_name(Path(source.path).stem) if source.format == "asf/amc" else None


def _batches(clip_ids: Sequence[str], stored: Sequence[Sequence[str]], size: int) -> list[list[str]]:
    """Lay clips out around those that are stored together, which stay so."""
    batches = [list(batch) for batch in stored if batch]
    if len(batches) > 2 + 2 * len(clip_ids) // size:
        batches = []
    placed = {one for batch in batches for one in batch}
    new = [one for one in clip_ids if one not in placed]
    if new and batches and len(batches[-1]) < size // 2:
        new = sorted([*new, *batches.pop()])
    return batches + batched_by_name(new, size)


def digest_of_settings(*settings: Any) -> str:
    """Digest JSON values, 128 bits, in hexadecimal."""
    about = json.dumps(settings, sort_keys=True)
    return hashlib.blake2b(about.encode(), digest_size=16).hexdigest()


def batched_by_name(clip_ids: Sequence[str], size: int) -> list[list[str]]:
    """Cut clips into batches of about `size`, twice that at most.

    A batch ends after a clip whose name says so, by its digest. So a clip that comes or goes after a run that
    was killed changes its own batch, not all that follow, and the results of the others are found again.
    """
    batches: list[list[str]] = [[]]
    for clip_id in clip_ids:
        batches[-1].append(clip_id)
        drawn = int.from_bytes(hashlib.blake2b(clip_id.encode(), digest_size=8).digest())
        if drawn % size == 0 or len(batches[-1]) == 2 * size:
            batches.append([])
    return [batch for batch in batches if batch]


def _first_places(batches: Sequence[Mapping[str, str]]) -> dict[str, Place]:
    places: dict[str, Place] = {}
    for number, batch in enumerate(batches):
        for clip_id, key in batch.items():
            places.setdefault(key, Place(number, clip_id))
    return places
