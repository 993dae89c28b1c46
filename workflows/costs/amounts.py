"""How much a library is, read off its layout without opening a file of it."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from motionary.pipeline.graph import LibraryGraph
from motionary.pipeline.layout import Layout
from motionary.pipeline.readers.library import Source
from motionary.pipeline.readers.zipped import archive_of

_UNZIPPED = 4  # times a zip's bytes, of what lies in it: BVH and AMC are text


@dataclass(frozen=True)
class Amounts:
    """What the memory of a run depends on.

    Parameters
    ----------
    clips : int
    batch, file : int
        Bytes of the files of the largest batch, and of the largest clip.
    largest : str
        That clip.
    tile : int
        Pairs of the largest tile.
    library : int
        Bytes of all files.
    landmarks : int, optional
        Clips all pairs of which are compared, where those of all are not.
    pruned : bool
        Whether only near pairs are kept; how many that are is known when they are compared.
    """

    clips: int
    batch: int
    file: int
    largest: str
    tile: int
    library: int
    landmarks: int | None = None
    pruned: bool = False

    @staticmethod
    def of(graph: LibraryGraph) -> Amounts:
        """Read them off a library's graph."""
        layout, config = graph.layout, graph.config
        sizes = clip_sizes(layout)
        batches = [sum(sizes[clip.clip_id] for clip in batch) for batch in layout.batches]
        sides = sorted(map(len, graph.compared_sides), reverse=True)
        return Amounts(
            clips=len(sizes),
            batch=max(batches, default=0),
            file=max(sizes.values(), default=0),
            largest=max(sizes, key=lambda one: sizes[one], default=""),
            tile=sides[0] * sides[min(1, len(sides) - 1)] if sides else 0,
            library=sum(batches),
            landmarks=config.clusters.landmarks,
            pruned=config.distances.pairs == "pruned",
        )

    @property
    def clustered(self) -> int:
        """Clips of which there are dendrograms."""
        return self.clips if self.landmarks is None else self.landmarks


def clip_sizes(layout: Layout) -> dict[str, int]:
    """Say of every clip how many bytes it is read from; of what lies in a zip, its even share of that."""
    inside = Counter(_archive(clip.source) for clip in layout)
    return {clip.clip_id: _size(clip.source, inside) for clip in layout}


def _size(source: Source, inside: Mapping[str | None, int]) -> int:
    archive = _archive(source)
    if archive is not None:
        return _UNZIPPED * _on_disk(archive) // inside[archive]
    return sum(state.size for state in source.states) or sum(map(_on_disk, source.files))


def _on_disk(file: str) -> int:
    with suppress(OSError, ValueError):  # gone meanwhile, or a name that is none
        return os.stat(file).st_size  # noqa: PTH116 - of thousands of files
    return 0


def _archive(source: Source) -> str | None:
    found = archive_of(source.files[0])
    return None if found is None else str(found[0])
