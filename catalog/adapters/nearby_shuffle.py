"""A random order of a dataset's items that opens every part of the catalog once.

Parts are compressed, so that reading a single clip takes as long as reading the 32 clips of its part. A free
shuffle, such as a DataLoader's `shuffle=True`, reads a part an item. Here the parts are shuffled, and then
the items of a few parts at a time: as many as a dataset keeps in memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from motionary.catalog.adapters.torch import MotionDataset


class NearbyShuffle:
    """The items of a dataset in random order, every time another: a `sampler` for a DataLoader.

    Parameters
    ----------
    dataset : MotionDataset
    seed : int
        The orders follow from it.
    """

    def __init__(self, dataset: MotionDataset, seed: int = 0) -> None:
        self.dataset = dataset
        self.seed = seed
        self._times = 0

    def __len__(self) -> int:
        return len(self.dataset)

    def __iter__(self) -> Iterator[int]:
        draw = np.random.default_rng([self.seed, self._times])
        self._times += 1
        part_of_item, together = self.dataset.parts, self.dataset.kept_parts
        parts = draw.permutation(np.unique(part_of_item))
        for first in range(0, len(parts), together):
            items = np.flatnonzero(np.isin(part_of_item, parts[first : first + together]))
            yield from draw.permutation(items).tolist()
